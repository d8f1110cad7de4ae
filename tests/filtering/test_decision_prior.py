"""What the prior of the learned decision draws, and the columns that tell it."""

from dataclasses import replace

import numpy as np
import pytest

from filtering.judging.decision.columns import DONE, largest_part
from filtering.judging.decision.description import describe
from filtering.judging.decision.observed import Observed, canonical
from filtering.judging.decision.prior.effects import (
    HIDDEN,
    UNSEEN,
    Sight,
    draw_sight,
    surprises,
)
from filtering.judging.decision.prior.mistakes import skip
from filtering.judging.decision.prior.noise import (
    LARGEST_RATE,
    LARGEST_SLIP,
    LEAST_RATE,
    LEAST_SLIP,
    NOISELESS,
    SLIPS,
    TOLD,
    Noise,
    draw_noise,
    report,
)
from filtering.judging.decision.prior.people import CLEAN, STYLE_SHARES, STYLES, draw_people
from filtering.judging.decision.prior.pools import _largest_way, draw_groups, draw_pool
from filtering.judging.decision.prior.tasks import Task, draw_task
from filtering.judging.norm.steps import StepList, count_steps

STEPS = 8


def line() -> Task:
    """A task whose steps have one order, none of them optional."""
    before = np.triu(np.ones((STEPS, STEPS), bool), 1)
    return Task(
        before,
        np.zeros(STEPS, np.int64),
        np.arange(STEPS),
        np.ones(STEPS),
        np.full(STEPS, 50.0),
        STEPS,
    )


def lists(orders: list[list[int]]) -> tuple[StepList, ...]:
    return tuple(StepList(tuple(order), (10,) * len(order)) for order in orders)


def left_out(*out: int) -> list[int]:
    return [step for step in range(STEPS) if step not in out]


def part_of(out: tuple[int, ...]) -> float:
    """How surprising the largest part is that one of nine leaves out."""
    counts = count_steps(lists([list(range(STEPS))] * 8 + [left_out(*out)]), STEPS)
    omitted = 1 - counts.occurs
    return float(largest_part(omitted, counts)[-1])


@pytest.mark.parametrize(
    ("out", "expected"),
    [((), 0.0), ((3,), 1.0), ((2, 3, 4), 3.0), ((0, 7), 1.0), ((1, 3, 5), 1.0)],
)
def test_neighbours_that_are_left_out_are_one_part(out, expected):
    assert part_of(out) == expected


def test_a_step_that_is_done_is_taken_off_a_part():
    counts = count_steps(lists([list(range(STEPS))] * 8 + [left_out(1, 2, 4, 5)]), STEPS)
    omitted = 2 * (1 - counts.occurs)
    found = largest_part(omitted, counts)[-1]
    assert found == pytest.approx(8 - DONE)


def test_steps_that_few_do_are_in_no_part():
    orders = [left_out(3)] * 8 + [list(range(STEPS)), left_out(2, 3, 4)]
    counts = count_steps(lists(orders), STEPS)
    assert largest_part(1 - counts.occurs, counts)[-1] == 2


def test_durations_do_not_matter_where_steps_do_not_take_turns():
    orders = [list(range(STEPS))] * 5 + [left_out(2)]
    found = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        steps = [
            StepList(tuple(order), tuple(rng.integers(1, 500, len(order)).tolist()))
            for order in orders
        ]
        own = canonical(Observed(tuple(steps)))
        described = describe(own.pool)
        # The null is drawn at random, step by step in the order of their numbers.
        known = [not name.startswith("null.") for name in described.names]
        found.append(described.rows[np.argsort(own.rows)][:, known])
    assert found[0] == pytest.approx(found[1], abs=1e-5)


def test_who_skips_a_part_leaves_out_neighbours():
    rng = np.random.default_rng(0)
    for _ in range(50):
        order = skip(rng, line(), list(range(STEPS)))
        assert order is not None
        out = np.setdiff1d(range(STEPS), order)
        assert 2 <= len(out) <= 6
        assert (np.diff(out) == 1).all()
    assert skip(rng, line(), [0, 1]) is None


def noise(seed: int, **known: float) -> Noise:
    drawn = draw_noise(np.random.default_rng(seed), 30, exact=True)
    return Noise(**{**vars(drawn), **known})


def test_labels_are_confused_with_those_of_about_the_same_time():
    away = [abs(noise(seed).alike - np.arange(30)[:, None]) for seed in range(20)]
    assert np.median(away) <= 2
    assert np.max(away) > 10
    assert np.mean(np.array(away) > 10) > 0.03


def test_segments_are_right_without_errors_and_keep_most_steps_with_them():
    rng = np.random.default_rng(1)
    labels, usual = list(range(STEPS)), np.full(STEPS, 50.0)
    exact = report(rng, line(), noise(3, rate=0.0, spread=0.0, loop=0.0), labels, usual)
    assert exact.steps == StepList(tuple(labels), (50,) * STEPS)
    assert exact.errors == 0
    known = noise(3, rate=0.1, mix=np.ones(5), weak=np.ones(30), loop=0.0)
    reports = [report(rng, line(), known, labels, usual) for _ in range(200)]
    assert sum(one.errors for one in reports) > 0
    kept = [len(set(one.steps.labels) & set(labels)) / STEPS for one in reports]
    assert 0.7 < np.mean(kept) < 1


def test_told_segments_hardly_err_and_have_no_reliability():
    drawn = [draw_noise(np.random.default_rng(seed), 10, exact=True) for seed in range(400)]
    told, found = [one for one in drawn if one.told], [one for one in drawn if not one.told]
    assert np.mean([one.told for one in drawn]) == pytest.approx(NOISELESS * TOLD, abs=0.07)
    assert all(one.trust == 0 for one in told)
    assert any(one.trust > 0 for one in found)
    slips = [one.rate for one in told if one.rate > 0]
    assert len(slips) / len(told) == pytest.approx(SLIPS, abs=0.15)
    assert LEAST_SLIP <= min(slips) < max(slips) <= LARGEST_SLIP
    errs = [one.rate for one in found if one.rate > 0]
    assert LEAST_RATE <= min(errs) < max(errs) <= LARGEST_RATE
    assert any(one.rate == 0 for one in found)


def test_drawn_pools_say_whether_their_segments_are_told():
    pools = [draw_pool(np.random.default_rng([8, k]), n_demos=5).observed for k in range(60)]
    assert {pool.told for pool in pools} == {False, True}
    assert all(pool.reliability is None for pool in pools if pool.told)


def test_who_leaves_out_an_optional_step_keeps_the_order_of_the_others():
    chance = np.ones(STEPS)
    chance[3] = 0.5
    task = replace(line(), chance=chance)
    orders = [list(range(STEPS)), left_out(3), [1, 0, *range(2, STEPS)], left_out(5)]
    correct = np.array([False, False, False, True])
    assert _largest_way(task, orders, correct) == (2, 2)
    assert _largest_way(line(), orders, correct) == (1, 3)


def test_segments_without_effect_surprise_and_others_seldom_do():
    rng = np.random.default_rng(2)
    sight = Sight(doubtful=0.05, haze=0.5, clear=8.0)
    usual = surprises(rng, sight, np.zeros(20_000, bool))
    assert (usual >= 0).all()
    assert (usual > 0).mean() == pytest.approx(sight.doubtful + HIDDEN, abs=0.01)
    useless = surprises(rng, sight, np.ones(20_000, bool))
    seen = useless[useless > 1.5]
    assert len(seen) / len(useless) == pytest.approx(1 - UNSEEN, abs=0.03)
    assert seen.mean() == pytest.approx(sight.clear, rel=0.1)


def test_effects_are_seen_worse_in_some_pools():
    drawn = [draw_sight(np.random.default_rng(seed)) for seed in range(200)]
    assert max(one.doubtful for one in drawn) > 5 * min(one.doubtful for one in drawn)
    assert min(one.clear for one in drawn) > 2 * max(one.haze for one in drawn)


def test_people_with_an_order_each_share_no_incorrect_recipe():
    rng = np.random.default_rng(0)
    drawn = {
        style: [group for _ in range(100) for group in draw_groups(rng, 14, style)]
        for style in ("orders", "script")
    }
    assert not any(group.shared for group in drawn["orders"])
    assert any(group.shared for group in drawn["script"])


def test_a_script_is_followed_by_half_of_a_pool_of_two_other_ways():
    rng = np.random.default_rng(0)
    for _ in range(300):
        groups = draw_groups(rng, 20, "script")
        if len(groups) == 2:
            assert sum(group.count for group in groups) <= 11  # each is rounded


def test_a_share_of_the_pools_is_clean():
    clean = [draw_pool(np.random.default_rng([7, k]), n_demos=5).facts[0] for k in range(300)]
    assert np.mean(clean) == pytest.approx(np.dot(STYLE_SHARES, CLEAN), abs=0.08)


def test_who_varies_much_errs_more_often():
    people = [draw_people(np.random.default_rng(seed)) for seed in range(100)]
    assert {one.style: one.clean for one in people} == dict(zip(STYLES, CLEAN, strict=True))
    assert max(CLEAN[3:]) < min(CLEAN[:3])


def test_optional_steps_of_a_script_are_done_by_about_half():
    rng = np.random.default_rng(0)
    chances = np.concatenate([draw_task(rng, exact=True).chance for _ in range(300)])
    optional = chances[chances < 1]
    assert 0.35 < optional.min() < optional.max() < 0.8
