from dataclasses import replace

from filtering.judging.explain import Finding, explain, gravest
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


def test_the_first_finding_is_named_and_other_omissions_are_added() -> None:
    later = Finding("stir", None, Span("add_water", 600, 700), 700, True, 7.0)
    assert explain([OFF_LEFT_OUT, later], 10) == (
        "After add_milk (38.2-45.1 s) 'turn_off_oven' was expected, 'add_water' was seen at "
        "45.1 s; 'turn_off_oven' is missing from the whole video; also missing: 'stir' (expected "
        "at 70.0 s)."
    )


def test_a_step_that_came_later_is_told_with_its_time() -> None:
    came = Span("add_tea_bag", 120, 180)
    finding = Finding("add_tea_bag", "add_sugar", Span("turn_on_oven", 0, 50), 50, False, 3.0, came)
    assert explain([finding], 10) == (
        "After turn_on_oven (0.0-5.0 s) 'add_tea_bag' was expected, 'add_sugar' was seen at "
        "5.0 s; 'add_tea_bag' came later (12.0-18.0 s)."
    )


def test_without_a_frame_rate_times_are_frames() -> None:
    assert explain([OFF_LEFT_OUT], None) == (
        "After add_milk (frames 382-451) 'turn_off_oven' was expected, 'add_water' was seen at "
        "frame 451; 'turn_off_oven' is missing from the whole video."
    )


def test_gravest_are_those_near_to_the_worst() -> None:
    small, large = replace(OFF_LEFT_OUT, surprise=2.9), replace(OFF_LEFT_OUT, surprise=3.0)
    assert gravest([small, large, OFF_LEFT_OUT]) == [large, OFF_LEFT_OUT]


def test_without_a_finding_it_says_so() -> None:
    assert explain([], 10).startswith("No single step stands out")
