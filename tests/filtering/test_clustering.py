"""The segmenter that needs no labels: from a pool to named segments, or a clear word."""

import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.segmentation.segmenter import SEGMENTERS, segmenter_named
from filtering.segmentation.segments import Segmentation
from filtering.segmentation.unlabelled import clustering as module
from filtering.segmentation.unlabelled.clustering import AVERAGES, subtask_count
from teasim.common.errors import ConfigError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Episode, Pool
from tests.filtering.test_discovery import made_up
from tests.toy_pool import make_toy_pool

ORDERS = [(0, 1, 2), (1, 0, 2), (0, 2), (0, 1, 2)]


@dataclass(frozen=True)
class Demo:
    """A demonstration that is known by its features alone."""

    demo_id: str
    length: int
    features: np.ndarray


@dataclass(frozen=True)
class Demos:
    episodes: tuple[Demo, ...]
    root: Path = Path("pool")
    fps: float = 10.0
    cameras: tuple[str, ...] = ("front", "side")


@pytest.fixture(autouse=True)
def stored_features(monkeypatch: pytest.MonkeyPatch) -> None:
    """Demos bring their features with them."""
    real = module.frame_features

    def of_demos(episodes, fps, source, *, workers):
        if isinstance(episodes[0], Episode):
            return real(episodes, fps, source, workers=workers)
        return [np.tile(demo.features, (1, len(source.cameras))) for demo in episodes]

    monkeypatch.setattr(module, "frame_features", of_demos)


def demos(videos: list[np.ndarray], frames: int = 2) -> Demos:
    """A pool of videos (n, F) whose cameras have `frames` frames per moment."""
    padded = [np.pad(video, ((0, 0), (0, 864 - video.shape[1]))) for video in videos]
    return Demos(
        tuple(
            Demo(f"demo {n}", frames * len(video), video.astype(np.float32))
            for n, video in enumerate(padded)
        )
    )


@pytest.fixture(scope="module")
def pool() -> Demos:
    return demos(made_up(ORDERS)[0])


def segment(pool: Demos, subtasks: str = "auto", cameras: tuple[str, ...] = ()) -> Segmentation:
    return segmenter_named("clustering", subtasks, cameras)(pool)  # type: ignore[arg-type]


def test_steps_are_named_and_fill_every_frame(pool: Demos):
    found = segment(pool, "3")
    assert found.subtasks == ("step 1", "step 2", "step 3")
    assert len(found.spans) == len(found.posteriors or ()) == len(ORDERS)
    for demo, spans, posteriors in zip(
        pool.episodes, found.spans, found.posteriors or (), strict=True
    ):
        assert posteriors.shape == (demo.length, 3)
        assert posteriors.dtype == np.float32
        assert (spans[0].start, spans[-1].stop) == (0, demo.length)
        assert all(a.stop == b.start for a, b in pairwise(spans))
    assert [len(spans) for spans in found.spans] == [len(order) for order in ORDERS]
    assert 0.9 < (found.confidence() or 0.0) <= 1.0


def test_the_order_of_the_demonstrations_changes_no_bit(pool: Demos):
    order = [2, 0, 3, 1]
    found = segment(pool, "3")
    permuted = segment(Demos(tuple(pool.episodes[number] for number in order)), "3")
    assert permuted.spans == tuple(found.spans[number] for number in order)
    assert found.posteriors is not None
    assert permuted.posteriors is not None
    for place, number in enumerate(order):
        np.testing.assert_array_equal(permuted.posteriors[place], found.posteriors[number])


def test_only_the_averages_of_the_named_cameras_are_compared(pool: Demos):
    episodes = pool.episodes[:2]
    one, two = (
        module.looks(episodes, 10.0, module.FrameSource(cameras), workers=IN_PROCESS)  # type: ignore[arg-type]
        for cameras in (("front",), ("front", "side"))
    )
    assert one[0].shape == (len(episodes[0].features), AVERAGES)
    assert two[0].shape == (len(episodes[0].features), 2 * AVERAGES)


def test_pictures_that_never_change_are_one_step():
    found = segment(demos([np.ones((length, 4)) for length in (40, 50, 60)]))
    assert found.subtasks == ("step 1",)
    assert [len(spans) for spans in found.spans] == [1, 1, 1]


def test_videos_of_one_frame_are_one_segment():
    rng = np.random.default_rng(0)
    found = segment(demos([rng.normal(size=(1, 4)) for _ in range(3)], frames=1))
    assert [(spans[0].start, spans[0].stop) for spans in found.spans] == [(0, 1)] * 3


@pytest.mark.parametrize(("text", "count"), [("auto", None), ("1", 1), ("12", 12)])
def test_the_number_of_subtasks_is_read(text, count):
    assert subtask_count(text) == count


@pytest.mark.parametrize("text", ["", "0", "-1", "some", "7.0", "²"])
def test_other_numbers_are_refused(text):
    with pytest.raises(ConfigError) as caught:
        FilterConfig(segmenter="clustering", subtasks=text)
    assert str(caught.value) == f"subtasks is '{text}'; choose auto or a number from 1."


def test_only_clustering_takes_a_number():
    for name in SEGMENTERS.keys() - {"clustering"}:
        with pytest.raises(ConfigError) as caught:
            FilterConfig(segmenter=name, subtasks="7")
        assert str(caught.value) == (
            f"The segmenter '{name}' takes no number of sub-tasks; only 'clustering' does."
        )


@pytest.mark.parametrize(
    ("lengths", "subtasks", "message"),
    [
        (
            (9,),
            "auto",
            "The pool 'pool' has 1 demonstrations; the segmenter 'clustering' needs two or more.",
        ),
        (
            (3, 5),
            "6",
            "6 sub-tasks were asked for, but the longest video of the pool 'pool' gives only 5 "
            "frames to compare; choose fewer.",
        ),
    ],
)
def test_too_few_videos_or_moments_are_refused(lengths, subtasks, message):
    with pytest.raises(ConfigError, match=f"^{re.escape(message)}$"):
        segment(demos([np.zeros((length, 4)) for length in lengths]), subtasks)


def test_a_filter_without_labels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    full = ("cut", "fry", "serve")
    pool = make_toy_pool(
        tmp_path / "cook", [full] * 3, frames_per_subtask=8, cameras=("main",), size=48
    )
    # Labels may be looked at to find out whether a source is damaged, never to judge it.
    monkeypatch.setattr("filtering.demo_filter.require_sound", lambda _: None)
    monkeypatch.setattr(Episode, "spans", lambda _: pytest.fail("labels were read"))
    config = FilterConfig(segmenter="clustering", subtasks="3", frames_per_segment=4)
    found = DemoFilter(config).fit(Pool.open(pool.root))
    assert set(found.segments_.subtasks) <= {"step 1", "step 2", "step 3"}
    assert len(found.weights_) == 3
    again = DemoFilter(config).fit(Pool.open(pool.root), workers=Workers(2))
    assert again.segments_.spans == found.segments_.spans
    assert again.table() == found.table()
