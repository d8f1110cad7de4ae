import numpy as np
import pytest

from filtering.explain import Finding, explain, find_strange_steps, usual_order
from filtering.sequence import transitions
from filtering.weights.score import Score
from teasim.pool import Span

OFF_LEFT_OUT = Finding("turn_off_oven", "add_water", Span("add_milk", 382, 451), 451, True, 6.0)


def test_sentence_names_step_and_time_span() -> None:
    assert explain([OFF_LEFT_OUT], 10) == (
        "After add_milk (38.2-45.1 s) 'turn_off_oven' was expected, 'add_water' was seen at "
        "45.1 s; 'turn_off_oven' is missing from the whole video."
    )


def test_sentence_for_another_order_does_not_call_it_missing() -> None:
    finding = Finding("add_tea_bag", "add_sugar", Span("turn_on_oven", 0, 50), 50, False, 3.0)
    assert explain([finding], 10) == (
        "After turn_on_oven (0.0-5.0 s) 'add_tea_bag' was expected, 'add_sugar' was seen at 5.0 s."
    )


def test_sentences_at_both_ends_of_the_video() -> None:
    first = Finding("turn_on_oven", "add_milk", None, 0, True, 3.0)
    assert explain([first], 10) == (
        "At the start of the video 'turn_on_oven' was expected, 'add_milk' was seen at 0.0 s; "
        "'turn_on_oven' is missing from the whole video."
    )
    last = Finding("stir", None, Span("add_water", 100, 150), 150, True, 3.0)
    assert explain([last], 10) == (
        "After add_water (10.0-15.0 s) 'stir' was expected, but the video ends at 15.0 s; "
        "'stir' is missing from the whole video."
    )
    late = Finding(None, "turn_off_oven", Span("stir", 100, 150), 150, False, 3.0)
    assert explain([late], 10) == (
        "After stir (10.0-15.0 s) the end of the video was expected, 'turn_off_oven' was seen at "
        "15.0 s."
    )


def test_the_first_of_the_grave_findings_is_named_and_other_omissions_are_added() -> None:
    later = Finding("stir", None, Span("add_water", 600, 700), 700, True, 7.0)
    assert explain([later, OFF_LEFT_OUT], 10) == (
        "After add_milk (38.2-45.1 s) 'turn_off_oven' was expected, 'add_water' was seen at "
        "45.1 s; 'turn_off_oven' is missing from the whole video; also missing: 'stir' (expected "
        "at 70.0 s)."
    )


def test_without_a_finding_it_says_so() -> None:
    assert explain([], 10).startswith("No single step stands out")


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
    segments = [spans_of(demo) for demo in demos]
    found = find_strange_steps(rows, score, segments, NAMES)
    assert found[:3] == [(), (), ()]
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


def test_usual_order_is_what_most_demonstrations_do() -> None:
    demos = [ABCD, ABCD, ABCD, [1, 0, 1]]
    rows = transitions([np.ones((len(d), 1)) for d in demos], demos, 4)
    order = usual_order(rows, np.ones(4))
    assert order[0, 1] == pytest.approx(3.5 / 5)
    assert order[0, 1] + order[1, 0] == pytest.approx(1.0)
    assert order[2, 3] == pytest.approx(3.5 / 4)
