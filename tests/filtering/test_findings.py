"""Every flag has its reason: what is found is what raised the loss, at its place in the video."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from filtering.judging.equation3.score import Score
from filtering.judging.equation3.sequence import transitions
from filtering.judging.equation3.surprises import find_surprises
from filtering.judging.evidence import Evidence
from filtering.judging.explain import Finding
from filtering.judging.norm.cut import SMALLEST_CUT
from filtering.judging.norm.departures import find_departures
from filtering.judging.norm.norm_score import score_steps
from filtering.judging.places import Places, usual_order
from teasim.pool import Span

NAMES = ("a", "b", "c", "d")
ABCD = [0, 1, 2, 3]


def spans_of(labels: list[int]) -> tuple[Span, ...]:
    return tuple(Span(NAMES[label], 10 * n, 10 * n + 10) for n, label in enumerate(labels))


def findings(
    labels: list[int], omitted: dict[int, float], expected: dict[int, int]
) -> list[Finding]:
    """Findings of the last demonstration, after three of a, b, c, d; `expected` is row -> label."""
    demos = [ABCD, ABCD, ABCD, labels]
    rows = transitions([np.ones((len(d), 1)) for d in demos], demos, len(NAMES))
    p = np.full((len(rows.nexts), 5), 0.02)
    p[np.arange(len(p)), rows.nexts] = 0.2
    first = int(np.flatnonzero(rows.demos == 3)[0])
    for row in range(len(p)):
        p[row, expected.get(row - first, rows.nexts[row])] = 0.9
    log_p = np.log(p)
    step = log_p.max(axis=1) - log_p[np.arange(len(p)), rows.nexts]
    omission = np.zeros((4, len(NAMES)))
    for label, surprise in omitted.items():
        omission[3, label] = surprise
    score = Score(step, log_p, omission, np.array([0.0, 0.0, 0.0, 5.0]))
    places = Places([spans_of(demo) for demo in demos], NAMES)
    found = find_surprises(rows, score, demos, places)
    assert found[:3] == ((), (), ())
    return list(found[3])


def test_an_omission_is_joined_to_the_strange_step_at_its_place() -> None:
    [finding] = findings([0, 2, 3], {1: 2.5}, {1: 1})
    assert (finding.expected, finding.seen, finding.missing) == ("b", "c", True)
    assert (finding.frame, finding.after) == (10, Span("a", 0, 10))
    assert finding.surprise == pytest.approx(2.5 + np.log(0.9 / 0.2))


def test_two_omissions_in_a_row_are_both_put_where_they_belong() -> None:
    first, second = findings([0, 3], {1: 2.5, 2: 2.5}, {1: 1})
    assert (first.expected, first.frame) == ("b", 10)
    assert (second.expected, second.seen, second.frame) == ("c", "d", 10)


def test_an_omitted_last_step_is_put_at_the_end() -> None:
    [finding] = findings([0, 1, 2], {3: 2.5}, {3: 3})
    assert (finding.expected, finding.seen, finding.frame) == ("d", None, 30)


def test_another_order_is_no_omission() -> None:
    [finding] = findings([0, 2, 1, 3], {}, {1: 1})
    assert (finding.expected, finding.seen, finding.missing) == ("b", "c", False)


def test_one_displaced_step_makes_later_ones_strange_so_the_first_of_the_grave_leads() -> None:
    first, *others = findings([0, 2, 1, 3], {}, {1: 1, 3: 0})
    assert (first.expected, first.frame) == ("b", 10)
    assert [other.expected for other in others] == ["a"]


def test_usual_order_is_what_most_demonstrations_do() -> None:
    demos = [ABCD, ABCD, ABCD, [1, 0, 1]]
    order = usual_order(demos, np.ones(4), 4)
    assert order[0, 1] == pytest.approx(3.5 / 5)
    assert order[0, 1] + order[1, 0] == pytest.approx(1.0)
    assert order[2, 3] == pytest.approx(3.5 / 4)


USUAL = tuple(range(7))
LETTERS = ("a", "b", "c", "d", "e", "f", "g")


def departures(demos: list[tuple[int, ...]]) -> list[tuple[Finding, ...]]:
    """Findings of the default score, ten frames per step."""
    segments = tuple(
        tuple(Span(LETTERS[label], 10 * n, 10 * n + 10) for n, label in enumerate(demo))
        for demo in demos
    )
    evidence = Evidence(LETTERS, segments, [])
    found = find_departures(score_steps(evidence.counts), evidence.labels, evidence.places)
    return list(found)


@pytest.mark.parametrize(
    ("mistaken", "expected", "seen", "frame", "missing"),
    [
        ((0, 1, 2, 4, 5, 6), "d", "e", 30, True),  # left out
        ((1, 2, 3, 4, 5, 6), "a", "b", 0, True),  # the first one left out
        ((0, 1, 2, 3, 4, 5), "g", None, 60, True),  # the last one left out
        ((0, 1, 5, 2, 3, 4, 6), "c", "f", 20, False),  # too early
        ((0, 2, 3, 4, 1, 5, 6), "b", "c", 10, False),  # too late
        ((0, 1, 2, 2, 3, 4, 5, 6), "d", "c", 30, False),  # once more
    ],
)
def test_the_default_score_names_what_is_wrong_and_where(
    mistaken: tuple[int, ...], expected: str, seen: str | None, frame: int, missing: bool
) -> None:
    found = departures([USUAL] * 8 + [mistaken])
    worst = found[-1][0]
    assert (worst.expected, worst.seen, worst.frame, worst.missing) == (
        expected,
        seen,
        frame,
        missing,
    )


def test_what_came_too_late_is_told_with_its_place() -> None:
    worst = departures([USUAL] * 8 + [(0, 2, 3, 4, 1, 5, 6)])[-1][0]
    assert worst.came == Span("b", 40, 50)


def test_of_equal_omissions_the_first_is_named_and_the_other_follows() -> None:
    first, second = departures([USUAL] * 8 + [(0, 2, 4, 5, 6)])[-1]
    assert (first.expected, second.expected) == ("b", "d")
    assert first.missing
    assert second.missing


def test_whoever_leaves_out_what_many_leave_out_is_told_that() -> None:
    """Six of sixteen lack two steps: each omission alone is nearly usual, together they are not."""
    found = departures([USUAL] * 10 + [(0, 2, 4, 5, 6)] * 6)
    for findings_of_one in found[10:]:
        assert {item.expected for item in findings_of_one if item.missing} == {"b", "d"}


POOLS = st.lists(
    st.one_of(
        st.lists(st.integers(0, 6), min_size=1, max_size=9).map(tuple),
        st.permutations(USUAL).map(tuple),
        st.just(USUAL),
    ),
    min_size=3,
    max_size=9,
)


@given(pool=POOLS)
@settings(max_examples=30, deadline=None)
def test_every_flagged_demonstration_gets_reasons_from_the_block_that_flagged_it(
    pool: list[tuple[int, ...]],
) -> None:
    segments = tuple(
        tuple(Span(LETTERS[label], n, n + 1) for n, label in enumerate(demo)) for demo in pool
    )
    evidence = Evidence(LETTERS, segments, [])
    score = score_steps(evidence.counts)
    found = find_departures(score, evidence.labels, evidence.places)
    for demo, loss in enumerate(score.losses):
        told = sum(item.surprise for item in found[demo])
        assert told <= loss + 1e-9
        if loss <= SMALLEST_CUT:
            continue
        assert found[demo]
        omitted = score.omitted[demo].max()
        if omitted > 0.5 * loss:  # then nothing else can be worse
            assert found[demo][0].missing
        if score.precedence[demo] > 0.9 * loss:
            assert not found[demo][0].missing
