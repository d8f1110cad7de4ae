from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teasim.common.errors import PoolError
from teasim.pool import Pool, VideoClip
from teasim.pool.clips import VideoWriter, check_decodable, probe
from tests.toy_pool import COLOURS

N_FRAMES = 25
SIZE = 32
FPS = 10


READERS: tuple[Callable[[Path], object], ...] = (
    probe,
    check_decodable,
    VideoClip.whole,
    lambda path: VideoClip(path, 0, 5, FPS).frames([0]),
    lambda path: VideoClip(path, 0, 5, FPS).digest(),
    lambda path: VideoClip(path, 0, 5, FPS).mp4(),
)


def write_video(path: Path, images: np.ndarray) -> Path:
    writer = VideoWriter(path, height=images.shape[1], width=images.shape[2], fps=FPS)
    for image in images:
        writer.add(image)
    writer.close()
    return path


@pytest.fixture(scope="module")
def images() -> np.ndarray:
    """Every frame of one colour of its own: (N_FRAMES, SIZE, SIZE, 3) uint8."""
    levels = np.linspace(20, 235, N_FRAMES)
    ramp = np.stack([levels, levels[::-1], np.full(N_FRAMES, 90)], axis=1)
    return np.broadcast_to(ramp[:, None, None], (N_FRAMES, SIZE, SIZE, 3)).astype(np.uint8)


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory, images: np.ndarray) -> Path:
    return write_video(tmp_path_factory.mktemp("video") / "ramp.mp4", images)


def test_frames_come_back_in_rgb_and_nearly_unchanged(video: Path, images: np.ndarray) -> None:
    frames = VideoClip.whole(video).frames(range(N_FRAMES))
    assert frames.shape == images.shape
    assert frames.dtype == np.uint8
    assert np.abs(frames.astype(int) - images).max() <= 6


@settings(max_examples=20, deadline=None)
@given(st.integers(0, N_FRAMES - 1), st.data())
def test_any_selection_is_a_selection_of_the_whole(
    video: Path, start: int, data: st.DataObject
) -> None:
    clip = VideoClip(video, start / FPS, N_FRAMES - start, FPS)
    indices = data.draw(st.lists(st.integers(0, clip.length - 1), min_size=1, max_size=8))
    whole = VideoClip.whole(video).frames(range(N_FRAMES))
    np.testing.assert_array_equal(clip.frames(indices), whole[start:][indices])


def test_a_clip_inside_a_foreign_file_starts_at_its_own_frame(foreign_pool: Pool) -> None:
    clips = [episode.clip("cam_top") for episode in foreign_pool.episodes]
    whole = VideoClip.whole(clips[0].path)
    frames = whole.frames(range(whole.length))
    assert len({clip.path for clip in clips}) == 1
    for clip in clips:
        start = round(clip.start * clip.fps)
        part = frames[start : start + clip.length]
        np.testing.assert_array_equal(clip.frames(range(clip.length)), part)


def test_equal_frames_give_equal_bytes(tmp_path: Path, video: Path, images: np.ndarray) -> None:
    again = write_video(tmp_path / "again.mp4", images)
    assert again.read_bytes() == video.read_bytes()


def test_packets_and_decoder_count_alike(video: Path) -> None:
    assert probe(video).n_frames == check_decodable(video) == N_FRAMES


@pytest.mark.parametrize("indices", [[-1], [N_FRAMES], []])
def test_indices_outside_the_clip_are_refused(video: Path, indices: list[int]) -> None:
    with pytest.raises(IndexError):
        VideoClip.whole(video).frames(indices)


def test_a_short_video_is_told_with_its_frame(video: Path) -> None:
    clip = VideoClip(video, 0, N_FRAMES + 5, FPS)
    with pytest.raises(PoolError) as caught:
        clip.frames([0, N_FRAMES + 2])
    assert str(caught.value) == (
        f"The video '{video}' is damaged or too short: frame {N_FRAMES + 2} of the "
        f"{N_FRAMES + 5} of this demonstration cannot be read."
    )


@pytest.mark.parametrize("content", [b"", b"no video at all" * 50])
def test_what_is_no_video_is_told_in_one_sentence(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.mp4"
    path.write_bytes(content)
    for read in READERS:
        with pytest.raises(PoolError, match=r"cannot be opened; it is damaged\.$"):
            read(path)


def test_a_missing_video_is_told_as_missing(tmp_path: Path) -> None:
    path = tmp_path / "x.mp4"
    for read in READERS:
        with pytest.raises(PoolError, match=r"^The video '.*x\.mp4' is missing\.$"):
            read(path)


def fill(writer: VideoWriter) -> None:
    """More frames than a pipe holds."""
    for _ in range(100):
        writer.add(np.full((SIZE, SIZE, 3), COLOURS[0], dtype=np.uint8))


@pytest.mark.parametrize("use", [fill, VideoWriter.close])
def test_an_encoder_that_cannot_write_tells_why(
    tmp_path: Path, use: Callable[[VideoWriter], None]
) -> None:
    writer = VideoWriter(tmp_path / "no folder" / "x.mp4", height=SIZE, width=SIZE, fps=FPS)
    with pytest.raises(PoolError, match=r"^The encoder stopped while writing '.*': .*No such file"):
        use(writer)
    writer.abort()


def test_an_encoder_that_is_killed_tells_its_code(tmp_path: Path) -> None:
    writer = VideoWriter(tmp_path / "x.mp4", height=SIZE, width=SIZE, fps=FPS)
    writer._process.kill()
    writer._process.wait()
    with pytest.raises(PoolError, match=r"x\.mp4': it ended with code -9\.$"):
        fill(writer)
    writer.abort()


def test_a_frame_of_another_shape_is_refused(tmp_path: Path) -> None:
    writer = VideoWriter(tmp_path / "x.mp4", height=SIZE, width=SIZE, fps=FPS)
    for image in (np.zeros((SIZE, SIZE + 1, 3), np.uint8), np.zeros((SIZE, SIZE, 3))):
        with pytest.raises(ValueError, match=r"not uint8 \(32, 32, 3\)\.$"):
            writer.add(image)
    writer.abort()


@pytest.mark.parametrize(("height", "width"), [(47, 63), (48, 63), (47, 64)])
def test_odd_sizes_repeat_the_last_row_and_column(tmp_path: Path, height: int, width: int) -> None:
    image = np.full((height, width, 3), 40, np.uint8)
    image[-8:, -8:] = 200
    path = write_video(tmp_path / "odd.mp4", np.stack([image] * 3))
    frames = VideoClip.whole(path).frames(range(3))
    assert frames.shape == (3, 48, 64, 3)
    assert np.abs(frames[:, :height, :width].astype(int) - image).mean() < 2
    assert (frames[:, -4:, -4:] > 180).all()


@pytest.mark.parametrize("fps", [1, 30, 29.97, 0.5])
def test_the_rate_of_the_file_is_the_one_given(tmp_path: Path, fps: float) -> None:
    writer = VideoWriter(tmp_path / "x.mp4", height=SIZE, width=SIZE, fps=fps)
    fill(writer)
    writer.close()
    assert probe(tmp_path / "x.mp4").fps == pytest.approx(fps, rel=1e-5)
