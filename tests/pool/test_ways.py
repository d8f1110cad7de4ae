"""Honest variety is told as what it is: ways, optional steps, a minority, or no majority."""

from itertools import permutations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teasim.pool.ways.ways import difference, find_ways, inversions
from teasim.pool.ways.words import words_about

USUAL = ("on", "bag", "sugar", "milk", "off", "water", "stir")
LEGAL = ("on", "sugar", "milk", "bag", "off", "water", "stir")
WRONG = ("on", "bag", "sugar", "milk", "water", "off", "stir")
NO_MILK = ("on", "bag", "sugar", "off", "water", "stir")
NO_WATER = ("on", "bag", "sugar", "milk", "off", "stir")
STEPS = st.lists(st.sampled_from("abcde"), max_size=6)


@settings(deadline=None)
@given(st.lists(STEPS, min_size=1, max_size=8))
def test_every_demonstration_is_in_one_way_and_in_one_order(demos: list[list[str]]) -> None:
    ways = find_ways(demos)
    for parts in (ways.all, ways.orders):
        assert sorted(row for way in parts for row in way.rows) == list(range(len(demos)))
        sizes = [len(way.rows) for way in parts]
        assert sizes == sorted(sizes, reverse=True)
    assert all(ways.demos[row] == way.steps for way in ways.all for row in way.rows)
    assert find_ways(demos[::-1]).all[0].steps == ways.all[0].steps


@settings(deadline=None)
@given(STEPS, STEPS)
def test_a_difference_is_empty_exactly_if_both_are_equal(one: list[str], other: list[str]) -> None:
    first, second = (find_ways([steps]).demos[0] for steps in (one, other))
    if first == second:
        assert difference(first, second) == []
    elif len(set(first)) == len(first) and len(set(second)) == len(second):
        assert difference(first, second)


@pytest.mark.parametrize("other", list(permutations("abcd")))
def test_inversions_name_pairs_of_which_the_usual_order_has_the_other_first(other) -> None:
    found = inversions("abcd", other)
    assert all(other.index(a) < other.index(b) and a > b for a, b in found)
    assert bool(found) == (other != tuple("abcd"))


def test_a_step_in_two_pieces_is_one_step() -> None:
    assert find_ways([["a", "a", "b"], ["a", "b"]]).all[0].steps == ("a", "b")


@pytest.mark.parametrize(
    ("demos", "words"),
    [
        ([USUAL] * 9, ["One way: all 9 demonstrations do the same steps in the same order."]),
        (
            [USUAL] * 9 + [NO_MILK],
            ["One order: all 10 demonstrations keep it, with 2 sequences."],
        ),
        (
            [USUAL] * 7 + [LEGAL, WRONG],
            ["One order: 7 of 9 demonstrations keep it, the other 2 differ from it in 2 ways."],
        ),
        (
            [USUAL] * 9 + [LEGAL] * 3,
            [
                "One other order: 3 of 12 do milk before bag, unlike the other 9. Only you know "
                'whether that is legal or a mistake: --keep "milk before bag" or --precedence '
                '"bag before milk".'
            ],
        ),
        (
            [USUAL] * 5 + [WRONG] * 7,
            [
                "No majority: 5 of 12 do off before water, unlike the other 7. If only one of two "
                'orders is right, the majority may be wrong; say which: --keep "off before water" '
                'or --precedence "water before off".'
            ],
        ),
        (
            [USUAL, LEGAL, WRONG] * 4,
            [
                "Several ways: of 12 demonstrations no more than 4 keep the same order, of 3 "
                "orders. This is honest variety unless a rule forbids it: --precedence "
                '"a before b".'
            ],
        ),
        (
            [USUAL] * 9 + [NO_MILK] * 3,
            [
                "One order: all 12 demonstrations keep it, with 2 sequences.",
                "Perhaps optional: 3 of 12 leave out milk. Only you know whether that is legal or "
                "a mistake: --optional milk or --critical milk.",
            ],
        ),
        (
            [USUAL] * 4 + [NO_WATER] * 8,
            [
                "One order: all 12 demonstrations keep it, with 2 sequences.",
                "No majority: 8 of 12 leave out water. Unless that is optional, the majority may "
                "be wrong: --optional water or --critical water.",
            ],
        ),
    ],
)
def test_what_the_ways_of_a_pool_may_mean(demos, words: list[str]) -> None:
    assert list(words_about(find_ways(demos))) == words


def test_what_became_of_them_is_told_and_what_is_settled_is_not_asked_again() -> None:
    ways = find_ways([USUAL] * 9 + [NO_MILK] * 3)
    for flagged, told in ([9, 10, 11], "(flagged)"), ([], "(kept)"), ([0, 9], "(1 flagged)"):
        assert f"3 of 12 {told} leave out milk" in words_about(ways, flagged)[1]
    assert len(words_about(ways, [], {"milk"})) == 1
    assert len(words_about(find_ways(ways.demos, optional=["milk"]))) == 1


def test_names_of_found_steps_are_quoted() -> None:
    demos = [["step 1", "step 2"]] * 8 + [["step 1"]] * 4
    assert words_about(find_ways(demos))[1].endswith('--optional "step 2" or --critical "step 2".')
