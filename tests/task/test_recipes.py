"""Which orders make tea, over all 5040 of them."""

from itertools import permutations

import pytest

from teasim.common.errors import ConfigError
from teasim.constants import SUBTASKS
from teasim.task.recipes import (
    CRITICAL,
    PRECEDENCE,
    SEQ_1,
    SEQ_2,
    allowed_next,
    is_legal,
    next_correct,
    recognisable,
)
from teasim.task.scoring import judge
from teasim.task.subtasks import find_subtask

ORDERS = tuple(permutations(SUBTASKS))
LEGAL = tuple(order for order in ORDERS if is_legal(order))
NOTHING_SPILLED = {"water": 0.0, "milk": 0.0, "sugar": 0.0}


def oven_on(done) -> bool:
    return "turn_on_oven" in done and "turn_off_oven" not in done


def test_the_precedence_speaks_of_the_seven_and_has_no_circle():
    assert set(PRECEDENCE) == set(SUBTASKS)
    assert {name for before in PRECEDENCE.values() for name in before} <= set(SUBTASKS)
    assert set(CRITICAL) <= set(SUBTASKS)
    assert LEGAL


def test_the_papers_sequences_are_legal():
    assert is_legal(SEQ_1)
    assert is_legal(SEQ_2)
    assert SEQ_1 != SEQ_2


def test_legal_orders_are_counted_by_hand():
    # On comes first, stirring last; between them bag, sugar and milk come at any time, and water
    # after off: 5! orders of which half have off before water.
    assert len(LEGAL) == 60


@pytest.mark.parametrize(
    "order", [(), SEQ_1[:-1], (*SEQ_1, "stir"), SEQ_1[::-1], ("nothing", *SEQ_1[1:])]
)
def test_other_orders_are_not_legal(order):
    assert not is_legal(order)


def test_every_legal_order_can_be_walked_and_ends_in_success():
    for order in LEGAL:
        for k, name in enumerate(order):
            done = order[:k]
            assert name in allowed_next(done)
            assert not judge(done, oven_on=oven_on(done), spilled=NOTHING_SPILLED).success
        verdict = judge(order, oven_on=False, spilled=NOTHING_SPILLED)
        assert (verdict.success, verdict.violations, verdict.unsafe) == (True, (), False)
        assert allowed_next(order) == ()


def test_what_is_allowed_next_is_what_some_legal_order_does_next():
    for order in LEGAL:
        for k in range(len(SUBTASKS)):
            does = {other[k] for other in LEGAL if set(other[:k]) == set(order[:k])}
            assert set(allowed_next(order[:k])) == does


def test_every_other_order_breaks_the_precedence_and_says_where():
    for order in ORDERS[::7]:
        violations = judge(order, oven_on=False, spilled=NOTHING_SPILLED).violations
        assert (violations == ()) == is_legal(order)
        for word in violations:
            name, _, before = word.partition("_before_")
            assert order.index(name) < order.index(before)
            assert before in PRECEDENCE[name]


def test_next_correct_walks_along_seq_1():
    for k, name in enumerate(SEQ_1):
        assert next_correct(SEQ_1[:k]) == name
    assert next_correct(SEQ_1) is None


@pytest.mark.parametrize("order", ORDERS[::97])
def test_whatever_was_done_the_reference_leads_to_success(order):
    done = list(order[: len(order) // 2])
    for _ in range(2 * len(SUBTASKS)):
        following = next_correct(done)
        if following is None:
            break
        assert following in allowed_next(done) or not is_legal_start(done)
        done.append(following)
    assert judge(done, oven_on=False, spilled=NOTHING_SPILLED).success


def is_legal_start(done) -> bool:
    return any(order[: len(done)] == tuple(done) for order in LEGAL)


def test_stirring_too_early_has_to_be_done_again():
    done = ("stir", *SEQ_1[:-1])
    assert next_correct(done) == "stir"
    assert allowed_next(done) == ("stir",)
    assert not judge(done, oven_on=False, spilled=NOTHING_SPILLED).success
    assert judge((*done, "stir"), oven_on=False, spilled=NOTHING_SPILLED).success


def test_an_unknown_sub_task_is_named_with_the_choices():
    assert find_subtask("stir").name == "stir"
    with pytest.raises(ConfigError) as error:
        find_subtask("sing")
    assert str(error.value) == f"Unknown sub-task 'sing'; choose {', '.join(SUBTASKS)}."


def test_physics_recognises_no_turning_off_of_an_oven_that_is_off():
    assert recognisable(SEQ_1) == SEQ_1
    assert recognisable(SEQ_1[1:]) == tuple(s for s in SEQ_1[1:] if s != "turn_off_oven")
    assert recognisable(("turn_on_oven", "stir", "add_milk", "stir")) == (
        "turn_on_oven",
        "add_milk",
        "stir",
    )
