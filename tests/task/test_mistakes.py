"""Every mistake of the registry spoils the plan and says how."""

from itertools import pairwise

import numpy as np
import pytest

from teasim.constants import SUBTASKS
from teasim.errors import ConfigError
from teasim.task.mistakes import MISTAKES, Plan, mistake, skip, without
from teasim.task.recipes import CRITICAL, SEQ_1, SEQ_2, is_legal
from teasim.task.scoring import judge

SEEDS = range(20)


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("name", MISTAKES)
@pytest.mark.parametrize("steps", [SEQ_1, SEQ_2])
def test_a_mistake_spoils_the_plan_and_its_label_says_where(name, steps):
    for seed in SEEDS:
        plan = mistake(name)(Plan(steps), rng(seed))
        assert not is_legal(plan.steps)
        (label,) = plan.mistakes
        assert label.name == name
        assert label.subtask in steps
        assert 0 <= label.position <= len(plan.steps)


@pytest.mark.parametrize("name", MISTAKES)
def test_a_seed_gives_one_mistake_and_leaves_the_plan_alone(name):
    plan = Plan(SEQ_1)
    assert mistake(name)(plan, rng(0)) == mistake(name)(plan, rng(0))
    assert plan == Plan(SEQ_1)


def test_every_critical_sub_task_gets_skipped():
    skipped = {skip(Plan(SEQ_1), rng(seed)).mistakes[0].subtask for seed in SEEDS}
    assert skipped == set(CRITICAL)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_skips_name_what_is_missing_and_what_it_was_due_before(count):
    for seed in SEEDS:
        plan, random = Plan(SEQ_1), rng(seed)
        for _ in range(count):
            plan = skip(plan, random)
        missing = {label.subtask for label in plan.mistakes}
        assert missing == set(SEQ_1) - set(plan.steps)
        assert len(missing) == count
        oven_on = "turn_off_oven" in missing
        assert not judge(plan.steps, oven_on=oven_on, spilled={}).success
        for label in plan.mistakes:
            before = [step for step in SEQ_1 if step in plan.steps][: label.position]
            assert plan.steps[: label.position] == tuple(before)
            later = SEQ_1[SEQ_1.index(label.subtask) + 1 :]
            assert plan.steps[label.position] in later


def test_the_order_of_two_omissions_does_not_matter():
    for first, second in pairwise(CRITICAL):
        one = without(without(Plan(SEQ_1), first), second)
        other = without(without(Plan(SEQ_1), second), first)
        assert one.steps == other.steps
        assert set(one.mistakes) == set(other.mistakes)


def test_a_fourth_skip_is_refused():
    plan = Plan(tuple(step for step in SEQ_1 if step not in CRITICAL))
    with pytest.raises(ConfigError, match="Nothing is left to skip in a plan without") as error:
        skip(plan, rng(0))
    assert all(name in str(error.value) for name in CRITICAL)


def test_an_unknown_mistake_is_named_with_the_choices():
    with pytest.raises(ConfigError) as error:
        mistake("sneeze")
    assert str(error.value) == f"Unknown mistake 'sneeze'; choose {', '.join(MISTAKES)}."


@pytest.mark.parametrize("subtask", SUBTASKS)
def test_any_sub_task_can_be_skipped_by_name(subtask):
    plan = mistake("skip")(Plan(SEQ_1), rng(0), subtask)
    assert set(SEQ_1) - set(plan.steps) == {subtask}
    assert [m.subtask for m in plan.mistakes] == [subtask]


def test_skipping_what_does_not_exist_is_refused_by_name():
    with pytest.raises(ConfigError, match="Unknown sub-task 'sneeze'; choose turn_on_oven"):
        mistake("skip")(Plan(SEQ_1), rng(0), "sneeze")
    without_milk = Plan(tuple(name for name in SEQ_1 if name != "add_milk"))
    with pytest.raises(ConfigError, match="'add_milk' cannot be skipped in a plan"):
        mistake("skip")(without_milk, rng(0), "add_milk")
