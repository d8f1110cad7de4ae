"""Every mistake of the registry spoils the plan and says how."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.common.errors import ConfigError
from teasim.constants import SUBTASKS
from teasim.task.mistakes import (
    MISSING_THE_CUP,
    MISTAKES,
    Plan,
    PlannedMistake,
    mistake,
    skip,
    spoil,
)
from teasim.task.recipes import (
    CRITICAL,
    POURED,
    PRECEDENCE,
    SEQ_1,
    SEQ_2,
    is_legal,
    recognisable,
)
from teasim.task.scoring import judge

SEEDS = range(20)


def rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize("name", MISTAKES)
@pytest.mark.parametrize("steps", [SEQ_1, SEQ_2])
def test_a_mistake_spoils_the_plan_and_its_label_says_where(name, steps):
    for seed in SEEDS:
        plan = mistake(name)(Plan(steps), rng(seed), None)
        (label,) = plan.mistakes
        assert label.name == name
        assert label.subtask in steps
        assert 0 <= label.position <= len(plan.steps)
        assert not is_legal(plan.steps) or plan.outcome != plan.steps
        assert plan.outcome == recognisable(plan.outcome)


def changed(name: str, steps: tuple[str, ...], plan: Plan) -> bool:
    """Whether the plan is what its one mistake says."""
    (label,) = plan.mistakes
    rest = list(plan.steps)
    if name == "skip":
        return [*rest[: label.position], label.subtask, *rest[label.position :]] == list(steps)
    if name in ("ineffective", "abandoned"):
        return plan.steps == steps and plan.manner(label.position) == name
    done = rest.pop(label.position)
    if name == "repeat":
        return tuple(rest) == steps and done == label.subtask and done in rest[: label.position]
    if name == "wrong_object":
        both = {done, label.subtask}
        kept = [s for k, s in enumerate(steps) if k != label.position]
        return rest == kept and len(both) == 2 and both <= set(POURED)
    waiting = [before for before in PRECEDENCE[done] if before in rest[label.position :]]
    return rest == [s for s in steps if s != done] and done == label.subtask and bool(waiting)


@pytest.mark.parametrize("name", MISTAKES)
@pytest.mark.parametrize("subtask", SUBTASKS)
def test_a_mistake_changes_what_it_says_and_nothing_else(name, subtask):
    refused = {
        "repeat": {"add_tea_bag"},
        "wrong_object": set(SUBTASKS) - set(POURED),
        "wrong_order": {"turn_on_oven"},
    }.get(name, set())
    for seed in SEEDS:
        if subtask in refused:
            with pytest.raises(ConfigError) as error:
                mistake(name)(Plan(SEQ_1), rng(seed), subtask)
            start = f"The mistake '{name}' cannot be made at '{subtask}' in this plan; choose "
            assert str(error.value).startswith(start)
            continue
        plan = mistake(name)(Plan(SEQ_1), rng(seed), subtask)
        assert [label.subtask for label in plan.mistakes] == [subtask]
        assert changed(name, SEQ_1, plan)
        drawn = mistake(name)(Plan(SEQ_1), rng(seed), None)
        assert changed(name, SEQ_1, drawn)


@given(
    names=st.lists(st.sampled_from(sorted(MISTAKES)), min_size=2, max_size=4),
    seed=st.integers(0, 99),
)
def test_mistakes_compose_and_every_label_stays_with_its_step(names, seed):
    try:
        plan = spoil(Plan(SEQ_1), "+".join(names), rng(seed))
    except ConfigError:
        return  # too many for one demonstration, which the next test is about
    assert sorted(m.name for m in plan.mistakes) == sorted(names)
    places = [m.position for m in plan.mistakes if m.name != "skip"]
    assert len(places) == len(set(places))
    for label in plan.mistakes:
        if label.name in ("skip", "wrong_object"):
            assert label.position <= len(plan.steps)
        else:
            assert plan.steps[label.position] == label.subtask
    assert plan.outcome == recognisable(plan.outcome)
    assert set(plan.spilled) <= set(MISSING_THE_CUP) - set(plan.outcome)


@pytest.mark.parametrize("subtask", SUBTASKS)
@pytest.mark.parametrize("name", ["ineffective", "abandoned"])
def test_what_is_done_in_vain_has_no_outcome(name, subtask):
    plan = mistake(name)(Plan(SEQ_1), rng(0), subtask)
    assert subtask not in plan.outcome
    missed = (subtask,) if name == "ineffective" and subtask in MISSING_THE_CUP else ()
    assert plan.spilled == missed


@pytest.mark.parametrize("name", MISTAKES)
def test_a_seed_gives_one_mistake_and_leaves_the_plan_alone(name):
    plan = Plan(SEQ_1)
    assert mistake(name)(plan, rng(0), None) == mistake(name)(plan, rng(0), None)
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
        one = spoil(Plan(SEQ_1), f"skip@{first}+skip@{second}", rng(0))
        other = spoil(Plan(SEQ_1), f"skip@{second}+skip@{first}", rng(0))
        assert one.steps == other.steps
        assert set(one.mistakes) == set(other.mistakes)


def test_a_fourth_skip_is_refused():
    plan = Plan(tuple(step for step in SEQ_1 if step not in CRITICAL))
    with pytest.raises(ConfigError) as error:
        skip(plan, rng(0))
    assert str(error.value) == (
        "The mistake 'skip' finds no step left to change in a plan of turn_on_oven, add_sugar, "
        "add_milk, stir; ask for fewer mistakes in one demonstration."
    )


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
    with pytest.raises(ConfigError, match="'skip' cannot be made at 'add_milk' in this plan"):
        mistake("skip")(without_milk, rng(0), "add_milk")


@pytest.mark.parametrize("seed", SEEDS)
def test_a_step_without_effect_has_a_label_whatever_the_cause(seed):
    plan = spoil(Plan(SEQ_1), "wrong_object@add_sugar", rng(seed))
    taken = plan.steps[2]
    later = plan.steps.index(taken, 3)
    assert plan.labels == (
        PlannedMistake("wrong_object", "add_sugar", 2),
        PlannedMistake("ineffective", taken, later),
    )
    assert Plan(SEQ_1).labels == ()


def test_what_a_skipped_step_makes_pointless_is_labelled():
    plan = spoil(Plan(SEQ_1), "skip@turn_on_oven", rng(0))
    assert plan.labels[1:] == (PlannedMistake("ineffective", "turn_off_oven", 3),)


@given(
    names=st.lists(st.sampled_from(sorted(MISTAKES)), min_size=1, max_size=3),
    seed=st.integers(0, 99),
)
def test_every_step_is_an_event_or_labelled(names, seed):
    try:
        plan = spoil(Plan(SEQ_1), "+".join(names), rng(seed))
    except ConfigError:
        return
    labelled = {label.position for label in plan.labels if label.name != "skip"}
    assert len(plan.steps) - len(plan.outcome) <= len(labelled)
    assert plan.labels[: len(plan.mistakes)] == plan.mistakes
