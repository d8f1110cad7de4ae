"""What counts as tea, as unsafe, and as spilled."""

import pytest

from teasim.constants import SUBTASKS
from teasim.task.recipes import SEQ_1
from teasim.task.scoring import SPILL_TOLERANCE, broken_precedence, judge, spills

CLEAN = {"water": 0.0, "milk": 0.0, "sugar": 0.0}


@pytest.mark.parametrize("missing", SUBTASKS)
def test_nothing_may_be_missing(missing):
    done = [name for name in SEQ_1 if name != missing]
    assert not judge(done, oven_on=False, spilled=CLEAN).success


def test_an_oven_that_is_on_is_unsafe_and_no_success():
    done = (*SEQ_1, "turn_on_oven", "stir")
    verdict = judge(done, oven_on=True, spilled=CLEAN)
    assert (verdict.success, verdict.unsafe) == (False, True)


def test_tea_is_stirred_last():
    done = (*SEQ_1, "add_milk")
    assert not judge(done, oven_on=False, spilled=CLEAN).success


def test_only_more_than_a_few_drops_are_a_spill():
    assert spills({"water": SPILL_TOLERANCE, "milk": SPILL_TOLERANCE + 0.1}) == ("spilled_milk",)
    verdict = judge(SEQ_1, oven_on=False, spilled=CLEAN | {"sugar": 20.0})
    assert (verdict.success, verdict.violations) == (True, ("spilled_sugar",))


def test_the_precedence_is_broken_once_per_thing_not_waited_for():
    assert broken_precedence(("add_water",)) == ("add_water_before_turn_off_oven",)
    assert broken_precedence(("stir",)) == tuple(
        f"stir_before_{name}" for name in ("add_tea_bag", "add_sugar", "add_milk", "add_water")
    )
