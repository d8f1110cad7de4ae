"""Videos nobody would choose: very short, black, of an uneven rate, tiny or of an odd size."""

from pathlib import Path

import av
import numpy as np
import pytest

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.moments.suitable import UnsuitableError
from filtering.segmentation.config import FitConfig
from filtering.segmentation.fit import fit_segmenter
from filtering.segmentation.mstcn.training import MSTCNConfig
from teasim.common.errors import PoolError
from teasim.pool import Pool
from tests import toy_pool
from tests.toy_pool import SEQ_1, make_toy_pool

ONE_OF_FIVE = [SEQ_1, SEQ_1, SEQ_1, SEQ_1, SEQ_1[:5] + SEQ_1[6:]]
QUICK = MSTCNConfig(epochs=2, channels=8, prediction_layers=3, refinement_layers=2)


def flagged(pool: Pool, **settings) -> list[bool]:
    found = DemoFilter(FilterConfig(**{"segmenter": "logged"} | settings)).fit(pool)
    assert np.isfinite(found.losses_).all()
    assert np.isfinite(found.weights_).all()
    return found.flagged_.tolist()


@pytest.mark.parametrize(("frames", "size"), [(1, 32), (2, 66), (9, 34)])
def test_segments_of_few_frames_and_small_pictures(tmp_path, frames, size):
    pool = make_toy_pool(tmp_path / "pool", ONE_OF_FIVE, size=size, frames_per_subtask=frames)
    assert flagged(pool) == [False] * 4 + [True]


def test_a_video_of_one_frame_among_longer_ones(tmp_path):
    pool = make_toy_pool(tmp_path / "pool", [*ONE_OF_FIVE[:4], ("stir",)], frames_per_subtask=1)
    assert pool.episodes[-1].length == 1
    assert flagged(pool) == [False] * 4 + [True]


def test_black_videos_are_judged_by_their_steps(tmp_path, monkeypatch):
    monkeypatch.setattr(
        toy_pool, "_picture", lambda _rng, header, *_: np.zeros((header.height,) * 2 + (3,), "u1")
    )
    pool = make_toy_pool(tmp_path / "pool", ONE_OF_FIVE, frames_per_subtask=3)
    assert flagged(pool) == [False] * 4 + [True]


def test_black_videos_fit_a_segmenter_that_sees_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(
        toy_pool, "_picture", lambda _rng, header, *_: np.zeros((header.height,) * 2 + (3,), "u1")
    )
    pool = make_toy_pool(tmp_path / "pool", ONE_OF_FIVE, frames_per_subtask=3)
    result = fit_segmenter(pool.root, tmp_path / "s", FitConfig(labelled=3, network=QUICK))
    assert np.isfinite(result.loss)
    norm = {"segmenter": str(tmp_path / "s"), "score": "norm"}
    assert flagged(pool, **norm) == [False] * 5  # all look alike
    with pytest.raises(UnsuitableError, match=r"^Nothing happens in the pictures of left;"):
        flagged(pool, segmenter=str(tmp_path / "s"))


def test_videos_whose_times_contradict_the_log_are_refused(tmp_path):
    pool = make_toy_pool(tmp_path / "pool", ONE_OF_FIVE, frames_per_subtask=3)
    (pool.root / "teasim/manifest.json").unlink()  # which has check sums
    for video in pool.root.rglob("*.mp4"):
        slow_down(video)
    with pytest.raises(PoolError, match=r"for the whole check run: teasim inspect"):
        DemoFilter().fit(Pool.open(pool.root))


def slow_down(video: Path) -> None:
    """Write a video anew with the same frames, ever slower."""
    slow = video.with_suffix(".slow.mp4")
    with av.open(str(video)) as source, av.open(str(slow), "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        for number, packet in enumerate(p for p in source.demux(video=0) if p.size):
            step = packet.duration or 1
            packet.pts = packet.dts = step * number * (number + 1) // 2
            packet.stream = stream
            target.mux(packet)
    slow.replace(video)
