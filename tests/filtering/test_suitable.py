"""Videos that show nothing to judge are refused in one sentence by all that judges videos alone."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from filtering import DemoFilter, FilterConfig
from filtering.moments.counterparts import ROUND_TRIP, Counterparts, Match
from filtering.moments.suitable import (
    FEWEST_MOMENTS,
    UnsuitableError,
    comparable,
    sees_motion,
    shared_structure,
)
from filtering.moments.vectors import Video
from teasim.common.errors import ConfigError
from teasim.pool.clips.encoder import VideoWriter
from teasim.pool.readers.registry import open_source
from tests.filtering.moments.toy_videos import STEPS, toy_video, usual_videos

SIDE, LENGTH = 48, 30
"""Side of the pictures [pixels] and frames of a video, at 5 frames/s: all of them are looked at."""
Show = Callable[[np.random.Generator, int], np.ndarray]


def black(_: np.random.Generator, __: int) -> np.ndarray:
    return np.zeros((SIDE, SIDE, 3), np.uint8)


def noise(rng: np.random.Generator, _: int) -> np.ndarray:
    return rng.integers(0, 256, (SIDE, SIDE, 3)).astype(np.uint8)


def task(rng: np.random.Generator, frame: int) -> np.ndarray:
    """A square on its way, ever brighter."""
    image = rng.integers(58, 63, (SIDE, SIDE, 3)).astype(np.uint8)
    at = 4 + frame
    image[10 + 15 * (frame // 10) :][:8, at : at + 8] = 100 + 5 * frame
    return image


def films(folder: Path, show: Show, count: int = 4) -> None:
    folder.mkdir(parents=True)
    for number in range(count):
        rng = np.random.default_rng(number)
        writer = VideoWriter(folder / f"{number}.mp4", height=SIDE, width=SIDE, fps=5.0)
        for frame in range(LENGTH):
            writer.add(show(rng, frame))
        writer.close()


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Describe frames by their own pixels in place of a network."""

    def pixels(frames: np.ndarray) -> np.ndarray:
        return frames[:, 2::6, 2::6].reshape(len(frames), -1).astype(np.float32)

    monkeypatch.setattr("filtering.vision.backbone.describe_frames", pixels)


WAYS = (
    FilterConfig(),
    FilterConfig(score="norm"),
    FilterConfig(score="moments"),
    FilterConfig(score="equation3", segmenter="clustering"),
)


@pytest.mark.parametrize(
    ("show", "message"),
    [
        (black, "Nothing happens in the pictures of video; name a camera that sees the task."),
        (
            noise,
            "These videos do not show one task: most of their moments have no counterpart in the "
            "other videos; filter the videos of one task at a time.",
        ),
    ],
)
def test_videos_that_show_nothing_are_refused(tmp_path, show, message) -> None:
    films(tmp_path / "films", show)
    pool = open_source(tmp_path / "films")
    for config in WAYS:
        with pytest.raises(UnsuitableError) as refused:
            DemoFilter(config).fit(pool)
        assert str(refused.value) == message


def test_two_videos_are_refused(tmp_path: Path) -> None:
    films(tmp_path / "films", task, count=2)
    with pytest.raises(ConfigError, match=r"has 2 demonstrations; a filter needs 3 or more\.$"):
        DemoFilter().fit(open_source(tmp_path / "films"))


def test_who_looks_or_acts_otherwise_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for told in ("looks", "actors"):
        monkeypatch.setattr(
            f"filtering.judging.moments.told_of_{told}",
            lambda _, names, told=told: (f"{told} of {', '.join(names)}.",),
        )
    films(tmp_path / "films", task)
    pool = open_source(tmp_path / "films")
    found = DemoFilter(FilterConfig(score="moments")).fit(pool)
    for told in ("looks", "actors"):
        assert f"{told} of {', '.join(episode.name for episode in pool.episodes)}." in found.words_


def test_another_camera_is_used_where_the_main_one_sees_nothing(tmp_path: Path) -> None:
    films(tmp_path / "films" / "left", black)
    films(tmp_path / "films" / "side", task)
    films(tmp_path / "alone" / "side", task)
    pool = open_source(tmp_path / "films")
    found = DemoFilter(FilterConfig(score="moments")).fit(pool)
    assert found.cameras_ == ("side",)
    assert found.looked_at_ == ("left", "side")
    assert found.words_[0] == (
        "The pictures of left show nothing that the videos have in common; side is used instead."
    )
    named = DemoFilter(FilterConfig(score="moments", cameras=("side",))).fit(pool)
    both = DemoFilter(FilterConfig(score="moments", cameras=("left", "side"))).fit(pool)
    assert both.words_[0] == "Nothing happens in the pictures of left, which is left out."
    for other in (named, both):
        assert np.array_equal(other.weights_, found.weights_)
    with pytest.raises(UnsuitableError, match=r"^Nothing happens in the pictures of left;"):
        DemoFilter(FilterConfig(cameras=("left",))).fit(pool)


def test_a_camera_of_noise_is_left_out_with_a_note() -> None:
    videos, rng = usual_videos(5), np.random.default_rng(0)
    noisy = [
        Video(
            rng.normal(size=v.looks.shape).astype(np.float32),
            rng.integers(0, 256, v.cells.shape).astype(np.uint8),
        )
        for v in videos
    ]
    seen = comparable({"front": videos, "noisy": noisy})
    assert tuple(seen.videos) == tuple(seen.found) == ("front",)
    assert seen.notes == ("The pictures of noisy have little in common, and are left out.",)
    assert seen.structure["front"] > 0.5 > seen.structure["noisy"]


def test_one_cell_is_enough_to_see_with() -> None:
    cells = np.full((20, 36, 48, 3), 90, np.uint8)
    still = Video(np.zeros((20, 4), np.float32), cells)
    cells = cells.copy()
    cells[10:, 5, 5] = 200
    assert not sees_motion([still] * 3)
    assert sees_motion([Video(still.looks, cells)] * 3)


def matched(at: list[np.ndarray]) -> Counterparts:
    """Two videos of which each moment has the counterpart `at`."""
    nothing = [np.zeros(len(a), np.float32) for a in at]
    there, back = (
        Match(zero, a, zero, a, zero > 0, zero > 0) for zero, a in zip(nothing, at, strict=True)
    )
    return Counterparts(
        (len(at[0]), len(at[1])),
        (0, 1),
        ((None, there), (back, None)),
        ((None, back), (there, None)),
    )


@pytest.mark.parametrize("count", [FEWEST_MOMENTS, 30, 200])
def test_structure_is_0_by_chance_and_1_at_best(count: int) -> None:
    alike = np.arange(count)
    assert shared_structure(matched([alike, alike])) == 1.0
    shifted = [matched([alike, (alike + by) % count]) for by in range(count)]
    assert np.mean([shared_structure(one) for one in shifted]) == pytest.approx(0)
    near = np.abs(np.subtract.outer(alike, alike)) <= ROUND_TRIP
    assert shared_structure(shifted[count // 2]) == pytest.approx(-near.mean() / (1 - near.mean()))


def test_short_videos_of_nothing_in_common_are_refused() -> None:
    """Of 12 moments, 6 out of 10 lie near any other by chance."""
    rng = np.random.default_rng(3)
    short = [
        Video(
            rng.normal(size=(12, 24)).astype(np.float32),
            rng.integers(0, 256, (12, 18, 24, 3)).astype(np.uint8),
        )
        for _ in range(6)
    ]
    with pytest.raises(UnsuitableError, match=r"^These videos do not show one task:"):
        comparable({"front": short})


def test_any_order_of_steps_is_still_one_task() -> None:
    rng = np.random.default_rng(0)
    seen = comparable({"front": [toy_video(rng.permutation(STEPS), n) for n in range(6)]})
    assert seen.notes == ()


def test_copies_of_one_video_are_one_task() -> None:
    seen = comparable({"front": usual_videos(1) * 4})
    assert seen.structure["front"] == 1.0
