import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from filtering.vision import frame_features as module
from filtering.vision import frames
from filtering.vision.backbone import FRAME_FEATURES, describe_frames
from filtering.vision.frame_features import (
    FrameSource,
    frame_features,
    moment_of_frames,
    sample_count,
    sampled_frames,
)
from teasim.common.errors import ConfigError, PoolError
from teasim.common.workers import IN_PROCESS
from teasim.pool import Pool


@pytest.mark.parametrize(
    ("length", "fps", "rate", "count"),
    [
        (100, 10, 5.0, 50),
        (100, 10, 10.0, 100),
        (100, 10, 30.0, 100),
        (300, 30, 5.0, 50),
        (1, 30, 5.0, 1),
    ],
)
def test_moments_per_second(length, fps, rate, count):
    assert sample_count(length, fps, rate) == count


def test_no_more_moments_than_frames():
    assert FrameSource(("left",), 5.0).rate_in(10.0) == 5.0
    assert FrameSource(("left",), 30.0).rate_in(10.0) == 10.0


def test_at_half_the_rate_every_second_frame_is_looked_at():
    assert sampled_frames(8, 4).tolist() == [1, 3, 5, 7]
    assert moment_of_frames(8, 4).tolist() == [0, 0, 1, 1, 2, 2, 3, 3]


@given(st.integers(1, 60).flatmap(lambda n: st.tuples(st.just(n), st.integers(1, n))))
def test_every_moment_has_frames_in_a_row_and_its_own_among_them(sizes):
    length, count = sizes
    of_frame = moment_of_frames(length, count)
    assert len(of_frame) == length
    assert set(np.diff(of_frame)) <= {0, 1}
    assert of_frame[sampled_frames(length, count)].tolist() == list(range(count))


def test_features_of_all_cameras_stand_side_by_side(toy_pool: Pool):
    episode = toy_pool.episodes[1]
    (found,) = frame_features(
        [episode], toy_pool.fps, FrameSource(("cup", "left"), 5.0), workers=IN_PROCESS
    )
    moments = np.arange(1, episode.length, 2)
    for place, camera in enumerate(("cup", "left")):
        expected = describe_frames(episode.clip(camera).frames(moments))
        part = found[:, place * FRAME_FEATURES : (place + 1) * FRAME_FEATURES]
        np.testing.assert_array_equal(part, expected)


def test_the_progress_names_the_camera(toy_pool: Pool, monkeypatch, tmp_path):
    monkeypatch.setenv("TEASIM_CACHE", str(tmp_path))
    told: list[str] = []

    def run(function, items, *, workers, description):
        told.append(f"{description}: {len(items)}")
        return [function(item) for item in items]

    monkeypatch.setattr(module.parallel, "run", run)
    source = FrameSource(("cup", "left"), 1.0)
    frame_features(toy_pool.episodes[:2], toy_pool.fps, source, workers=IN_PROCESS)
    assert told == ["looking at cup: 2", "looking at left: 2"]


def test_frames_are_shrunk_one_by_one(toy_pool: Pool, monkeypatch):
    clip = toy_pool.episodes[0].clip("left")
    monkeypatch.setattr(frames, "LARGEST_SIDE", 20)
    wanted = np.arange(0, clip.length, 5)
    found = list(frames.fitted_frames(clip, wanted))
    assert {image.shape for image in found} == {(1, 20, 20, 3)}
    assert np.array_equal(np.concatenate(found), frames.fit_size(clip.frames(wanted)))


def test_features_are_looked_up_and_depend_on_no_chunk(toy_pool: Pool, monkeypatch, tmp_path):
    episodes, source = toy_pool.episodes[:2], FrameSource(("left",), 4.0)
    monkeypatch.setenv("TEASIM_CACHE", str(tmp_path))
    whole = frame_features(episodes, toy_pool.fps, source, workers=IN_PROCESS)
    with monkeypatch.context() as patch:
        patch.setattr(module, "describe_clip", None)  # nothing is read again
        again = frame_features(episodes, toy_pool.fps, source, workers=IN_PROCESS)
    monkeypatch.setenv("TEASIM_CACHE", str(tmp_path / "empty"))
    monkeypatch.setattr(module, "CHUNK", 8)
    pieces = frame_features(episodes, toy_pool.fps, source, workers=IN_PROCESS)
    for first, second, third in zip(whole, again, pieces, strict=True):
        np.testing.assert_array_equal(first, second)
        np.testing.assert_array_equal(first, third)


def test_a_source_without_pictures_is_refused(toy_pool: Pool):
    with pytest.raises(
        ConfigError, match=r"^No camera was named; choose one or more of the pool's"
    ):
        FrameSource(())
    with pytest.raises(ConfigError, match=r"^rate is 0.0; choose moments per second above 0\.$"):
        FrameSource(("left",), 0.0)
    with pytest.raises(PoolError, match=r"^The pool has no camera 'roof'; it has left, cup\.$"):
        frame_features(toy_pool.episodes, toy_pool.fps, FrameSource(("roof",)), workers=IN_PROCESS)
