"""The learned decision: exact invariance, masks, words, and the model that is shipped."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from filtering.judging.config import JudgingConfig
from filtering.judging.decision.decide import PoolDecision, decide, observed
from filtering.judging.decision.description import describe
from filtering.judging.decision.model import CHECKPOINT, SHIPPED, load_model, shipped_model
from filtering.judging.decision.observed import Observed, canonical
from filtering.judging.decision.prior.pools import FACTS, draw_pool
from filtering.judging.evidence import Evidence
from filtering.judging.judges import JUDGES, by_norm
from filtering.judging.norm.steps import StepList
from teasim.common.errors import CheckpointError, ConfigError
from teasim.pool import Span

ORDERS = st.lists(st.lists(st.integers(0, 4), min_size=1, max_size=6), min_size=3, max_size=8)
"""Short lists, so that labels and demonstrations are often alike."""
QUIET = dict.fromkeys(FACTS, 0.0)


def pool_of(orders: list[list[int]], length: int = 10) -> Observed:
    return Observed(tuple(StepList(tuple(o), (length,) * len(o)) for o in orders))


def disguised(pool: Observed, seed: int) -> tuple[Observed, np.ndarray]:
    """The same pool with other numbers for its labels, in another order."""
    rng = np.random.default_rng(seed)
    most = 1 + max(max(demo.labels) for demo in pool.steps)
    numbers, rows = rng.permutation(most + 3), rng.permutation(len(pool.steps))
    steps = tuple(
        StepList(tuple(int(numbers[label]) for label in demo.labels), demo.lengths)
        for demo in pool.steps
    )
    return replace(pool, steps=steps).chosen(rows), rows


def evidence(orders: list[list[int]]) -> Evidence:
    names = tuple(f"step_{k}" for k in range(8))
    spans = tuple(
        tuple(Span(names[a], 10 * n, 10 * n + 10) for n, a in enumerate(order)) for order in orders
    )
    return Evidence(names, spans)


@given(orders=ORDERS, seed=st.integers(0, 99))
@settings(max_examples=15, deadline=None)
def test_names_and_order_change_not_one_bit(orders: list[list[int]], seed: int) -> None:
    pool = pool_of(orders)
    other, rows = disguised(pool, seed)
    first, second = decide(pool, 2.0), decide(other, 2.0)
    assert np.array_equal(second.probabilities, first.probabilities[rows])
    assert second.facts == first.facts
    assert np.isfinite(first.probabilities).all()


@pytest.mark.parametrize("n_demos", [9, 70])
def test_drawn_pools_of_any_size_are_judged_alike_in_any_order(n_demos: int) -> None:
    pool = draw_pool(np.random.default_rng(n_demos), n_demos=n_demos).observed
    other, rows = disguised(pool, 3)
    first, second = decide(pool, 2.0), decide(other, 2.0)
    assert first.probabilities.shape == (n_demos,)
    assert np.array_equal(second.probabilities, first.probabilities[rows])
    assert second.facts == first.facts


def test_equal_demonstrations_get_equal_probabilities() -> None:
    found = decide(pool_of([[0, 1, 2, 3]] * 9 + [[0, 2, 3]] * 2), 2.0).probabilities
    assert len(set(found[:9])) == len(set(found[9:])) == 1


def test_labels_that_can_be_exchanged_are_numbered_in_either_way() -> None:
    first = canonical(pool_of([[0, 1, 2], [1, 0, 2], [0, 1, 2], [1, 0, 2]]))
    second = canonical(pool_of([[1, 0, 2], [0, 1, 2], [1, 0, 2], [0, 1, 2]]))
    assert first.pool == second.pool
    assert len(set(first.kinds.tolist())) == 1


def test_the_same_seed_draws_the_same_pool() -> None:
    first, second = (draw_pool(np.random.default_rng(5)) for _ in range(2))
    assert first.observed.steps == second.observed.steps
    assert np.array_equal(first.incorrect, second.incorrect)
    other = draw_pool(np.random.default_rng(6))
    assert first.observed.steps != other.observed.steps


@pytest.mark.parametrize("seed", range(12))
def test_drawn_pools_tell_the_truth(seed: int) -> None:
    clean = draw_pool(np.random.default_rng(seed), n_demos=6, clean=True)
    assert not clean.incorrect.any()
    assert clean.facts[FACTS.index("clean")]
    other = draw_pool(np.random.default_rng(seed), n_demos=6, clean=False)
    assert other.facts[FACTS.index("clean")] == (not other.incorrect.any())
    assert len(other.observed.steps) == len(other.incorrect) == 6


def test_evidence_that_is_absent_is_masked() -> None:
    pool = pool_of([[0, 1, 2]] * 5)
    known = tuple(np.full(3, 0.8) for _ in range(5))
    for field, kind in (("reliability", "reliability"), ("ineffective", "effects")):
        absent, present = describe(pool), describe(replace(pool, **{field: known}))
        columns = [k for k, name in enumerate(absent.names) if name.startswith(kind)]
        mask = absent.names.index(f"{kind}.absent")
        others = [k for k in columns if k != mask]
        assert (absent.rows[:, mask] == 1).all()
        assert (absent.rows[:, others] == 0).all()
        assert (present.rows[:, mask] == 0).all()
        assert (present.rows[:, others] > 0).all()


def test_descriptions_know_neither_names_nor_duplicates_of_them() -> None:
    names = describe(pool_of([[0, 1, 2]] * 4)).names
    assert len(set(names)) == len(names) == shipped_model().networks[0].shape.columns


def test_a_missing_step_is_found_and_a_clean_pool_is_silent() -> None:
    usual = [0, 1, 2, 3, 4, 5, 6]
    clean = decide(pool_of([usual] * 12), 2.0)
    assert not clean.flagged.any()
    assert clean.words[0].startswith("clean: ")
    one = decide(pool_of([*[usual] * 10, [0, 1, 2, 4, 5, 6]]), 2.0)
    assert np.flatnonzero(one.flagged).tolist() == [10]
    assert one.words[0].startswith("contaminated: ")


def test_a_large_minority_that_lacks_a_step_is_no_basis() -> None:
    usual = [0, 1, 2, 3, 4, 5, 6]
    found = decide(pool_of([usual] * 6 + [[0, 1, 2, 4, 5, 6]] * 8), 2.0)
    assert any(words.startswith("no majority: ") for words in found.words)
    assert any("the majority may be wrong" in words for words in found.words)


def test_the_cost_of_a_miss_sets_the_cut() -> None:
    p = np.array([0.1, 0.3, 0.4, 0.9])
    assert PoolDecision(p, QUIET, 2.0, "").flagged.tolist() == [False, False, True, True]
    assert PoolDecision(p, QUIET, 1.0, "").flagged.tolist() == [False, False, False, True]
    assert PoolDecision(p, QUIET, 9.0, "").cut == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("p", "facts", "words"),
    [
        (0.0, {"clean": 0.9}, ["clean"]),
        (0.2, {"clean": 0.1}, ["unsure"]),
        (0.9, {}, ["contaminated", "no majority"]),
        (0.9, {"noisy": 0.9}, ["contaminated", "no majority"]),
        (0.2, {"noisy": 0.9}, ["too noisy to judge"]),
        (0.9, {"majority incorrect": 0.3}, ["contaminated", "no majority"]),
        (0.0, {"clean": 0.9, "several ways": 0.9}, ["clean", "several ways of doing it"]),
    ],
)
def test_what_is_said_about_pools(p: float, facts: dict[str, float], words: list[str]) -> None:
    found = PoolDecision(np.full(4, p), QUIET | facts, 2.0, "").words
    assert [text.split(":")[0] for text in found] == words


def test_the_shipped_model_is_whole_and_small() -> None:
    description = CHECKPOINT.describe(SHIPPED)
    weights = CHECKPOINT.weights(SHIPPED, description)
    assert len(weights) < 2_000_000
    assert shipped_model().sha256 == description["weights_sha256"]
    assert list(shipped_model().facts) == list(FACTS)
    held_back = shipped_model().card["held back"]
    assert held_back["ece"] <= 0.03
    assert held_back["brier"] < held_back["brier of the base rate"]


def test_a_damaged_model_is_refused(tmp_path) -> None:
    folder = tmp_path / "fitted"
    shutil.copytree(SHIPPED, folder)
    path = CHECKPOINT.weights_path(folder)
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    with pytest.raises(CheckpointError, match=r"is damaged: .*; fit it again\.$"):
        load_model(folder)


def test_weights_are_probabilities_of_being_correct() -> None:
    usual = [0, 1, 2, 3, 4, 5, 6]
    known = evidence([*[usual] * 10, [0, 1, 2, 4, 5, 6]])
    found = by_norm(known, JudgingConfig(decision="learned"))
    assert found.decision is not None
    assert np.array_equal(found.weights, 1 - found.decision.probabilities)
    assert np.array_equal(found.grouping.flagged, found.decision.flagged)
    assert found.grouping.threshold == pytest.approx(2 / 3)
    assert found.grouping.names == ("kept", "steps left out")


@pytest.mark.parametrize(
    "setting",
    [
        {"groups": "3"},
        {"groups": "1"},
        {"threshold": 0.4},
        {"tolerance": 0.2},
        {"score": "equation3"},
    ],
)
def test_other_settings_leave_the_decision_to_clusters(setting) -> None:
    config = JudgingConfig(decision="learned", **setting)
    assert not config.learns
    assert JudgingConfig(decision="learned").learns
    known = replace(evidence([[0, 1, 2]] * 4), states=[np.eye(8)[:3]] * 4)
    assert (
        JUDGES["norm" if config.score == "auto" else config.score](known, config).decision is None
    )


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"decision": "votes"}, "Unknown decision 'votes'; choose auto, learned or clusters."),
        ({"cost": 0.0}, "cost is 0.0; choose a number above 0."),
        ({"cost": float("inf")}, "cost is inf; choose a number above 0."),
    ],
)
def test_settings_out_of_range_are_refused(setting, message) -> None:
    with pytest.raises(ConfigError) as caught:
        JudgingConfig(**setting)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("setting", "learns"),
    [
        ({}, True),
        ({"score": "norm"}, True),
        ({"decision": "clusters"}, False),
        ({"score": "combined"}, False),
        ({"score": "moments"}, False),
        ({"score": "equation3"}, False),
        ({"groups": "2"}, False),
        ({"threshold": "kmeans"}, False),
        ({"tolerance": 0.1}, False),
    ],
)
def test_the_norm_alone_uses_the_learned_decision(setting, learns) -> None:
    assert JudgingConfig(**setting).learns == learns


def test_a_column_says_whether_segments_are_told() -> None:
    pool = pool_of([[0, 1, 2]] * 4)
    for told in (False, True):
        found = describe(replace(pool, told=told))
        assert (found.rows[:, found.names.index("told")] == told).all()
        assert canonical(replace(pool, told=told)).pool.told == told
        assert replace(pool, told=told).chosen([1, 0, 2]).told == told


def columns_of(orders: list[list[int]]) -> dict[str, list[float]]:
    found = describe(pool_of(orders))
    return {name: values.tolist() for name, values in zip(found.names, found.rows.T, strict=True)}


def test_groups_that_do_the_same_are_counted() -> None:
    found = columns_of([[0, 1, 2, 3]] * 5 + [[0, 2, 1, 3]] * 3 + [[0, 1, 3]] * 2)
    assert found["lists: own"] == pytest.approx([0.5] * 5 + [0.3] * 3 + [0.2] * 2)
    assert found["lists: larger"] == [0] * 5 + [1] * 3 + [2] * 2
    assert found["lists: lead"] == pytest.approx([0] * 5 + [-0.2] * 3 + [-0.3] * 2)
    whole = {"largest": 0.5, "second": 0.3, "third": 0.2, "others": 0.0, "number": 0.3}
    for what, expected in whole.items():
        assert found[f"lists: {what}"] == pytest.approx([expected] * 10)
    assert found["steps: own"] == pytest.approx([0.8] * 8 + [0.2] * 2)
    assert found["steps: largest"] == pytest.approx([0.8] * 10)
    assert found["steps: third"] == [0] * 10


def test_those_whose_order_is_kept_are_counted() -> None:
    found = columns_of([[0, 1, 2, 3]] * 5 + [[0, 2, 1, 3]] * 3 + [[0, 1, 3]] * 2)
    assert found["kept"] == pytest.approx([0.7] * 5 + [0.5] * 3 + [1.0] * 2)
    for what, expected in (("most", 1.0), ("median", 0.7), ("least", 0.5)):
        assert found[f"kept: {what}"] == pytest.approx([expected] * 10)


def test_evidence_is_read_whole() -> None:
    known = replace(
        evidence([[0, 1], [1, 0]]),
        told=True,
        reliability=[np.ones(2), np.zeros(2)],
        ineffective=[np.zeros(2), np.ones(2)],
    )
    pool = observed(known)
    assert pool.told
    assert not observed(replace(known, told=False)).told
    assert [demo.labels for demo in pool.steps] == [(0, 1), (1, 0)]
    assert [demo.lengths for demo in pool.steps] == [(10, 10), (10, 10)]
    assert pool.reliability is not None
    assert pool.ineffective is not None
    assert pool.reliability[1].tolist() == [0, 0]
    assert pool.ineffective[1].tolist() == [1, 1]
