"""The terms of the reward of one decision."""

import itertools

import numpy as np
import pytest

from teasim.common.errors import ConfigError
from teasim.constants import SUBTASKS
from teasim.envs.decisions import DecisionWeights, decision_terms
from teasim.task.recipes import SEQ_1, SEQ_2, has_effect
from teasim.task.scoring import judge

SHARE = 1 / len(SUBTASKS)


def terms_of(steps, spilled=()):
    """The terms of every step of a sequence, as if each that can have an effect had it."""
    found, done, spills = [], (), {"water": 0.0}
    verdict = judge(done, oven_on=False, spilled=spills)
    for number, name in enumerate(steps):
        after = (*done, name) if has_effect(name, done) else done
        spills = {"water": spills["water"] + 9.0 * (number in spilled)}
        now = judge(
            after, oven_on=after.count(SEQ_1[0]) > after.count("turn_off_oven"), spilled=spills
        )
        found.append(decision_terms(name, done, after, (verdict, now)))
        done, verdict = after, now
    return found


def total(steps, **weights):
    return sum(DecisionWeights.of(weights).total(terms) for terms in terms_of(steps))


def test_by_default_only_the_goal_counts():
    assert [DecisionWeights().total(t) for t in terms_of(SEQ_1)] == [0.0] * 6 + [1.0]


@pytest.mark.parametrize("term", ["subtasks", "reference"])
def test_seq_1_earns_every_share(term):
    assert total(SEQ_1, success=0, **{term: 1}) == pytest.approx(1)


def test_seq_2_completes_as_much_but_follows_the_reference_less():
    assert total(SEQ_2, success=0, subtasks=1) == pytest.approx(1)
    assert total(SEQ_2, success=0, reference=1) < 1
    assert total(SEQ_2, success=0, violations=1) == 0


def test_nothing_is_earned_twice():
    """However long an episode is, the shares of `subtasks` and `reference` sum to 1 at most."""
    random = np.random.default_rng(0)
    for _ in range(100):
        steps = random.choice(SUBTASKS, 30)
        assert total(steps, success=0, subtasks=1) <= 1 + 1e-9
        assert total(steps, success=0, reference=1) <= 1 + 1e-9


def test_an_action_that_completes_nothing_new_costs_a_share():
    assert terms_of(["stir"])[0]["idle"] == -SHARE
    assert terms_of(["turn_on_oven", "turn_on_oven"])[1]["idle"] == -SHARE
    assert terms_of(["turn_on_oven", "turn_off_oven", "turn_on_oven"])[2]["idle"] == -SHARE
    assert all(terms["idle"] == 0 for terms in terms_of(SEQ_1))


def test_a_violation_costs_a_share_once():
    before, after = terms_of(["add_water", "turn_on_oven"])
    assert (before["violations"], after["violations"]) == (-SHARE, 0)
    assert terms_of(SEQ_1, spilled=(5,))[5]["violations"] == -SHARE


def test_with_all_terms_no_episode_of_seven_beats_seq_1():
    weights = {"subtasks": 1, "reference": 1, "idle": 1, "violations": 1}
    best = total(SEQ_1, **weights)
    assert best == pytest.approx(3)
    others = [
        total(order, **weights)
        for order in itertools.islice(itertools.permutations(SUBTASKS), 0, None, 97)
    ]
    assert max(others) < best


def test_a_weight_that_does_not_exist_is_named(make):
    with pytest.raises(ConfigError) as error:
        make("TeaMakingEvents", reward_weights={"speed": 1.0})
    assert str(error.value) == (
        "Unknown reward term 'speed'; choose success, subtasks, reference, idle, violations."
    )
