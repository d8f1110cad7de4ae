import numpy as np

from filtering.explain import Finding, explain, find_strange_steps
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


def test_an_omission_is_found_where_the_step_was_most_expected() -> None:
    names = ("a", "b", "c")
    spans = (Span("a", 0, 10), Span("c", 10, 20))
    rows = transitions([np.ones((2, 1))], [[0, 2]], 3)
    log_p = np.log([[0.9, 0.03, 0.03, 0.04], [0.04, 0.9, 0.03, 0.03], [0.03, 0.03, 0.04, 0.9]])
    step = log_p.max(axis=1) - log_p[np.arange(3), rows.nexts]
    score = Score(step, log_p, np.array([[0.0, 2.5, 0.0]]), np.array([6.0]))
    [[finding]] = find_strange_steps(rows, score, [spans], names)
    assert (finding.expected, finding.seen, finding.missing) == ("b", "c", True)
    assert finding.frame == 10
    assert finding.after == spans[0]
