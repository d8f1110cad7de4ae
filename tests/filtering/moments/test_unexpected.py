from collections.abc import Sequence

import numpy as np
import pytest

from filtering.judging.moments import Timeline, judge_moments, reason
from filtering.moments.counterparts import find_counterparts
from filtering.moments.decision import KINDS, UNEXPECTED, Observed, all_exceedances, exceedances
from filtering.moments.effects.changes import states_of
from filtering.moments.effects.unexpected import Unexpected, unexpected_in
from filtering.moments.score import score_moments
from filtering.moments.suitable import comparable
from filtering.moments.vectors import Video, moment_blocks
from tests.filtering.moments.toy_videos import LENGTH, STEPS, toy_video, usual_videos

EXTRA = [0, 1, 5, 2, 3, 4]


def elsewhere(video: Video, columns: int) -> Video:
    """Return a video whose things lie elsewhere, but not its whole picture."""
    return Video(video.looks, np.roll(video.cells, columns, axis=2))


def lacking_of(videos: list[Video], d: int, actors: Sequence[int] | None = None) -> Unexpected:
    found = find_counterparts(moment_blocks(videos).vectors())
    states = {number: states_of(video) for number, video in enumerate(videos)}
    return unexpected_in(found, states, d, states[d], np.array(actors or [0] * len(videos)))


def test_what_nobody_else_changes_is_found_at_its_place():
    found = lacking_of([*usual_videos(7), toy_video(EXTRA, 50)], 7)
    assert found.value > 0.7
    assert found.own.video == 7
    # The extra step is the third of six.
    assert found.own.start < 3 * LENGTH
    assert found.own.stop > 2 * LENGTH
    assert found.other.video != 7


@pytest.mark.parametrize("order", [range(STEPS), [0, 3, 1, 2, 4], [0, 1, 3, 4]])
def test_what_others_change_too_is_not_lacking_in_them(order):
    assert lacking_of([*usual_videos(7), toy_video(order, 50)], 7).value < 0.2


def test_an_extra_step_without_effect_changes_nothing():
    works = [True, True, False, True, True, True]
    assert lacking_of([*usual_videos(7), toy_video(EXTRA, 50, works=works)], 7).value < 0.2


def test_what_a_share_of_the_others_does_is_one_way_to_do_the_task():
    videos = [*usual_videos(8), *(toy_video(EXTRA, seed) for seed in range(50, 54))]
    assert lacking_of(videos, 8).value < 0.2
    assert lacking_of(videos[:9], 8).value > 0.7


def test_only_those_with_the_same_actor_are_asked():
    videos = [*usual_videos(7), *(toy_video(EXTRA, seed) for seed in range(50, 53))]
    assert lacking_of(videos, 7, [0] * 7 + [1] * 3).value < 0.2
    assert lacking_of(videos[:9], 7, [0] * 7 + [1] * 2).value == 0.0


def test_a_video_in_which_nothing_changes_lacks_nothing():
    still = toy_video(range(STEPS), 50, works=[False] * STEPS)
    found = lacking_of([*usual_videos(7), still], 7)
    assert found.value == 0.0
    assert (found.own.start, found.own.stop) == (0, len(still))


@pytest.mark.parametrize(("times", "counts"), [(1, True), (4, False)])
def test_a_hand_that_comes_back_to_rest_is_no_unexpected_change(times, counts):
    videos = usual_videos(8, tempo=4.0)
    cells = videos[7].cells.copy()
    for start in range(25, 25 + 50 * times, 50):
        cells[start : start + 25, 12:16, :12] = (220, 180, 150)
    value = lacking_of([*videos[:7], Video(videos[7].looks, cells)], 7).value
    assert value > 0.7 if counts else value < 0.3


def test_nobody_is_accused_where_things_lie_elsewhere_in_every_video():
    videos = [elsewhere(video, 3 * d) for d, video in enumerate(usual_videos(8))]
    assert not score_moments({"front": videos}).flagged.any()


def test_unexpected_changes_count_as_far_as_moments_are_extra():
    values = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 1.0])
    moved = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.2])
    nothing = {kind: np.zeros(6) for kind in KINDS}
    seen = Observed({**nothing, "unexpected": values, "extra": moved}, 0.0, np.ones(6))
    found = all_exceedances(seen, np.ones(6, dtype=np.bool_))
    assert found["unexpected"][:5].tolist() == [0.0] * 5
    assert found["unexpected"][5] == pytest.approx(UNEXPECTED * found["extra"][5])
    assert found["extra"][5] < exceedances("unexpected", seen, np.ones(6, dtype=np.bool_))[5]


def test_the_reason_says_when_the_picture_changes():
    videos = [*usual_videos(7), toy_video(EXTRA, 50)]
    timeline = Timeline([6 * len(video) for video in videos], [f"v{d}" for d in range(8)], 30.0)
    score = score_moments({"front": videos})
    assert score.exceeded["unexpected"].argmax() == 7
    found = next(one for one in score.findings[7] if one.kind == "unexpected")
    assert found.exceedance > 1
    said = reason(found, [len(video) for video in videos], timeline)
    assert said.startswith("What changes in the picture at ")
    assert said.endswith(" changes in few other videos.")
    judged, _ = judge_moments(comparable({"front": videos}), timeline)
    assert judged.grouping.names[judged.grouping.groups[7]] == "extra steps"
    assert all(one.expected is None for one in judged.findings[7])
