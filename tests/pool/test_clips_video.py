"""Every frame of every codec and layout is the one asked for: it carries its own number."""

import contextlib
import pickle
import subprocess
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from imageio_ffmpeg import get_ffmpeg_exe

from teasim.common.errors import PoolError
from teasim.pool import VideoClip
from teasim.pool.clips import check_decodable, probe
from teasim.pool.clips.order import MAX_SIDE
from tests import barcode

N = 30
NTSC = Fraction(30000, 1001)
ONE_THREAD = {"preset": "12", "svtav1-params": "lp=1"}
QUIET = "log-level=none:"
B_FRAMES = {"g": "12", "bf": "3"}

LAYOUTS: dict[str, dict[str, Any]] = {
    "h264.mp4": {},
    "h264_b_frames.mp4": {"options": B_FRAMES},
    "h264_long_gop.mp4": {"options": {"g": "250", "bf": "2"}},
    "h264_open_gop.mp4": {
        "options": {"x264-params": "bframes=3:keyint=8:open-gop=1:scenecut=0"},
    },
    "h264_intra_refresh.mp4": {
        "options": {"x264-params": "intra-refresh=1:keyint=10:bframes=0"},
    },
    "h264_no_edit_list.mp4": {"options": B_FRAMES, "container_options": {"use_editlist": "0"}},
    "h264_fragmented.mp4": {
        "options": B_FRAMES,
        "container_options": {"movflags": "frag_keyframe+empty_moov"},
    },
    "h264_yuv444.mp4": {"pix_fmt": "yuv444p"},
    "h264_yuv422.mp4": {"pix_fmt": "yuv422p"},
    "h264_10_bit.mp4": {"pix_fmt": "yuv420p10le"},
    "h264_rgb.mp4": {"codec": "libx264rgb", "pix_fmt": "rgb24"},
    "h264.mkv": {"options": B_FRAMES},
    "h264.ts": {"options": B_FRAMES},
    "h264.avi": {"options": {"bf": "0", "g": "10"}},
    "h264_b_frames.avi": {"options": B_FRAMES},
    "late.mp4": {"options": B_FRAMES, "stamps": range(5, 5 + N)},
    "late.mkv": {"stamps": range(5, 5 + N)},
    "ntsc.mp4": {"rate": NTSC, "options": B_FRAMES},
    "ntsc.mkv": {"rate": NTSC},
    "turned.mp4": {"rotation": 90},
    "turned_back.mp4": {"rotation": -90},
    "upside_down.mov": {"rotation": 180},
    "hevc.mp4": {
        "codec": "libx265",
        "options": {"x265-params": QUIET + "keyint=8:bframes=3:open-gop=1"},
    },
    "hevc_10_bit.mp4": {
        "codec": "libx265",
        "pix_fmt": "yuv420p10le",
        "options": {"x265-params": QUIET + "keyint=8"},
    },
    "hevc_gray10.mp4": {
        "codec": "libx265",
        "pix_fmt": "gray10le",
        "options": {"x265-params": QUIET},
    },
    "hevc_gray12.mp4": {
        "codec": "libx265",
        "pix_fmt": "gray12le",
        "options": {"x265-params": QUIET},
    },
    "av1.mp4": {
        "codec": "libsvtav1",
        "options": {"g": "2", "preset": "12", "svtav1-params": "lp=1"},
    },
    "av1_long_gop.mp4": {
        "codec": "libsvtav1",
        "options": {"g": "100", "preset": "12", "svtav1-params": "lp=1"},
    },
    "vp9.webm": {"codec": "libvpx-vp9", "options": {"g": "10", "deadline": "realtime"}},
    "vp9_hidden_frames.mp4": {
        "codec": "libvpx-vp9",
        "options": {"g": "10", "auto-alt-ref": "1", "lag-in-frames": "16"},
    },
    "mpeg4.mp4": {"codec": "mpeg4", "options": {"g": "10", "bf": "2"}},
    "mpeg4.avi": {"codec": "mpeg4", "options": {"g": "10", "bf": "2"}},
    "mjpeg.avi": {"codec": "mjpeg", "pix_fmt": "yuvj420p"},
    "mjpeg.mov": {"codec": "mjpeg", "pix_fmt": "yuvj422p"},
    "ffv1.mkv": {"codec": "ffv1"},
    "ffv1_rgb.mkv": {"codec": "ffv1", "pix_fmt": "bgr0"},
    "raw.avi": {"codec": "rawvideo", "pix_fmt": "bgr24"},
}


@pytest.fixture(scope="module", params=LAYOUTS)
def video(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A video of N frames in every layout; frame i shows the number i."""
    path = tmp_path_factory.getbasetemp() / "layouts" / request.param
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SVT_LOG", "0")
        return barcode.write(path, range(N), **LAYOUTS[request.param])


def rate_of(video: Path) -> float:
    return float(LAYOUTS[video.name].get("rate", 10))


def read(clip: VideoClip, indices: Iterable[int]) -> list[int]:
    """The numbers shown by the frames `indices`, after turning the pictures back."""
    turns = LAYOUTS.get(clip.path.name, {}).get("rotation", 0) // 90
    return barcode.numbers(np.rot90(image, -turns) for image in clip.frames(list(indices)))


def test_a_file_is_told_from_its_packets(video: Path) -> None:
    info = probe(video)
    turned = LAYOUTS[video.name].get("rotation", 0) % 180 != 0
    assert info.n_frames == check_decodable(video) == N
    assert info.times[0] == 0
    assert info.duration == pytest.approx(N / rate_of(video), rel=2e-3)
    assert info.fps == pytest.approx(rate_of(video), rel=2e-3)
    assert (info.height, info.width) == ((64, 48) if turned else (48, 64))


def test_the_whole_file_is_read_in_order_of_presentation(video: Path) -> None:
    clip = VideoClip.whole(video)
    assert read(clip, range(clip.length)) == list(range(N))


def test_single_frames_are_found_in_any_order(video: Path) -> None:
    clip = VideoClip(video, 0.0, N, rate_of(video))
    whole = clip.frames(range(N))
    for index in (N - 1, 0, 15, 8, 9, 7, 23, 24):
        np.testing.assert_array_equal(clip.frames([index])[0], whole[index])
    assert read(clip, [22, 3, 22]) == [22, 3, 22]


@pytest.mark.parametrize(("first", "length"), [(0, 7), (7, 5), (12, 1), (13, 17)])
def test_episodes_of_one_file_begin_and_end_where_they_should(
    video: Path, first: int, length: int
) -> None:
    clip = VideoClip(video, first / rate_of(video), length, rate_of(video))
    middle = length // 2
    assert read(clip, [0, middle, length - 1]) == [first, first + middle, first + length - 1]


def test_what_lies_behind_the_last_frame_is_told(video: Path) -> None:
    clip = VideoClip(video, 20 / rate_of(video), 11, rate_of(video))
    assert read(clip, [9]) == [29]
    with pytest.raises(PoolError) as caught:
        clip.frames([10])
    assert str(caught.value) == (
        f"The video '{video}' is damaged or too short: frame 10 of the 11 of this demonstration "
        f"cannot be read."
    )


def test_reading_twice_gives_the_same_bits_here_and_in_a_copy(video: Path) -> None:
    clip = VideoClip.whole(video)
    again: VideoClip = pickle.loads(pickle.dumps(clip))
    np.testing.assert_array_equal(again.frames(range(N)), clip.frames(range(N)))
    assert again.digest() == clip.digest() == VideoClip(video, 0.0, N, rate_of(video)).digest()


def test_only_h264_that_browsers_play_is_handed_out(video: Path) -> None:
    info = probe(video)
    plays = info.codec == "h264" and info.pix_fmt == "yuv420p" and video.suffix in (".mp4", ".mov")
    stored = VideoClip(video, 0.0, N, rate_of(video)).mp4()
    assert stored == (video.read_bytes() if plays else None)
    assert VideoClip(video, 0.0, N - 1, rate_of(video)).mp4() is None


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plain") / "plain.mp4"
    return barcode.write(path, range(N), options=B_FRAMES)


def test_frames_before_an_edit_list_are_no_frames(tmp_path: Path) -> None:
    path = barcode.write(tmp_path / "cut.mp4", range(N), stamps=range(-7, N - 7), options=B_FRAMES)
    clip = VideoClip.whole(path)
    assert clip.length == N - 7
    assert read(clip, range(clip.length)) == list(range(7, N))
    assert read(VideoClip(path, 0.4, 3, 10), range(3)) == [11, 12, 13]


def ffmpeg(*arguments: object) -> None:
    subprocess.run(
        [get_ffmpeg_exe(), "-v", "error", "-y", *map(str, arguments)],
        check=True,
        stdin=subprocess.DEVNULL,
    )


def test_identity_survives_new_containers_and_rewritten_packets(
    tmp_path: Path, plain: Path
) -> None:
    copies = [tmp_path / "copy.mkv", tmp_path / "copy.ts", tmp_path / "copy.mp4"]
    for copy in copies:
        ffmpeg("-i", plain, "-c", "copy", copy)  # .ts: start codes instead of lengths
    told = VideoClip.whole(plain).digest()
    assert [VideoClip(copy, 0.0, N, 10).digest() for copy in copies] == [told] * 3


def test_concatenated_parts_keep_their_frames_and_identities(tmp_path: Path) -> None:
    parts = [
        barcode.write(tmp_path / f"{i}.mp4", range(20 * i, 20 * i + 10 + i), options=B_FRAMES)
        for i in range(3)
    ]
    (tmp_path / "list").write_text("".join(f"file '{part}'\n" for part in parts))
    joined = tmp_path / "joined.mp4"
    ffmpeg("-f", "concat", "-safe", "0", "-i", tmp_path / "list", "-c", "copy", joined)
    first = 0
    for i, part in enumerate(parts):
        clip = VideoClip(joined, first / 10, 10 + i, 10)
        assert read(clip, range(10 + i)) == list(range(20 * i, 20 * i + 10 + i))
        assert clip.digest() == VideoClip.whole(part).digest()
        first += 10 + i


def test_other_pictures_have_another_digest(tmp_path: Path, plain: Path) -> None:
    other = barcode.write(tmp_path / "other.mp4", [*range(N - 1), 99], options=B_FRAMES)
    told = VideoClip(plain, 0.0, N, 10).digest()
    assert VideoClip(other, 0.0, N, 10).digest() != told
    assert VideoClip(plain, 0.0, N - 1, 10).digest() != told


def test_a_file_that_changes_is_hashed_again(tmp_path: Path) -> None:
    path = barcode.write(tmp_path / "x.mp4", range(N))
    before = VideoClip(path, 0.0, N, 10).digest()
    barcode.write(path, range(100, 100 + N), options={"crf": "10"})
    assert VideoClip(path, 0.0, N, 10).digest() != before


def test_a_camera_of_half_the_rate_shows_each_frame_twice(tmp_path: Path) -> None:
    path = barcode.write(tmp_path / "slow.mp4", range(N), rate=15, options=B_FRAMES)
    clip = VideoClip(path, 4 / 15, 52, 30)
    assert read(clip, range(52)) == [4 + i // 2 for i in range(52)]
    mkv = barcode.write(tmp_path / "slow.mkv", range(N), rate=15)  # stamps rounded to 1 ms
    assert read(VideoClip(mkv, 0.0, 60, 30), range(60)) == [i // 2 for i in range(60)]


def test_a_camera_of_twice_the_rate_is_matched_by_time(tmp_path: Path) -> None:
    path = barcode.write(tmp_path / "fast.mp4", range(N), rate=60)
    assert read(VideoClip(path, 2 / 60, 14, 30), range(14)) == list(range(2, N, 2))


@pytest.mark.parametrize(("late", "shift"), [(0.037, 0), (-0.037, 0), (0.06, 1)])
def test_a_start_off_the_grid_takes_the_nearest_frames(
    plain: Path, late: float, shift: int
) -> None:
    clip = VideoClip(plain, 1.0 + late, 10, 10)
    assert read(clip, range(10)) == list(range(10 + shift, 20 + shift))


def test_the_last_frame_is_shown_until_it_ends(plain: Path) -> None:
    assert read(VideoClip(plain, 2.06, 10, 10), [9]) == [N - 1]


def test_frames_with_times_of_their_own(tmp_path: Path) -> None:
    stamps = [0, 1, 2, 10, 11, 12, 30, 31]
    path = barcode.write(tmp_path / "uneven.mp4", range(8), stamps=stamps, options=B_FRAMES)
    whole = VideoClip.whole(path)
    assert whole.times == pytest.approx([stamp / 10 for stamp in stamps])
    assert read(whole, range(8)) == list(range(8))
    part = VideoClip(path, 1.0, 3, 10, (0.0, 0.1, 2.0))
    assert read(part, range(3)) == [3, 4, 6]


@pytest.mark.parametrize(
    ("space", "range_"), [(None, None), (6, 1), (5, 1), (1, 1), (1, 2), (6, 2), (9, 1)]
)
def test_colours_follow_the_matrix_and_range_of_the_file(
    tmp_path: Path, space: int | None, range_: int | None
) -> None:
    """Untagged is BT.601 of limited range, as in ffmpeg; 1 is BT.709, 9 is BT.2020."""
    colours = np.array([[220, 30, 40], [30, 200, 60], [50, 40, 210], [200, 180, 30]], np.uint8)
    image = np.repeat(np.repeat(colours.reshape(2, 2, 3), 24, axis=0), 32, axis=1)
    path = tmp_path / "x.mp4"
    scaler = {1: "ITU709", 5: "ITU601", 6: "ITU601", 9: "BT2020"}
    with av.open(str(path), "w") as box:
        stream: Any = box.add_stream("libx264", 10, options={"crf": "1"})
        stream.height, stream.width, stream.pix_fmt = 48, 64, "yuv444p"
        if space is not None:
            stream.codec_context.colorspace = space
            stream.codec_context.color_range = range_
        frame = av.VideoFrame.from_ndarray(image, format="rgb24")
        box.mux(
            stream.encode(
                frame.reformat(
                    format="yuv444p",
                    dst_colorspace=scaler[space or 5],
                    dst_color_range="JPEG" if range_ == 2 else "MPEG",
                )
            )
        )
        box.mux(stream.encode())
    (read_back,) = VideoClip.whole(path).frames([0])
    assert np.abs(read_back[8:16, 8:16].astype(int) - image[8:16, 8:16]).max() <= 6
    assert np.abs(read_back.astype(int) - image).mean() < 3


def test_a_stream_holds_one_frame(tmp_path: Path) -> None:
    """Frames that were not kept are freed while the video goes on."""
    import tracemalloc

    size = (480, 640)
    path = barcode.write(tmp_path / "large.mp4", range(60), size=size)
    clip = VideoClip(path, 0.0, 60, 10)
    tracemalloc.start()
    for image in clip.stream(range(60)):
        assert image.shape == (*size, 3)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 * 480 * 640 * 3


def test_frames_that_are_too_large_are_refused_before_they_are_decoded(tmp_path: Path) -> None:
    path = tmp_path / "wide.mkv"
    with av.open(str(path), "w") as box:
        stream: Any = box.add_stream("ffv1", 10)
        stream.height, stream.width, stream.pix_fmt = 2, MAX_SIDE + 2, "gray"
        frame = av.VideoFrame.from_ndarray(np.zeros((2, MAX_SIDE + 2), np.uint8), format="gray")
        box.mux(stream.encode(frame))
        box.mux(stream.encode())
    with pytest.raises(PoolError, match=rf"^The frames in '.*' are {MAX_SIDE + 2} x 2 pixels; at"):
        VideoClip.whole(path)


def audio_only(path: Path) -> None:
    with av.open(str(path), "w") as box:
        stream: Any = box.add_stream("aac", 44100)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), "fltp", "mono")
        frame.sample_rate = 44100
        box.mux(stream.encode(frame))
        box.mux(stream.encode())


def no_frame(path: Path) -> None:
    with av.open(str(path), "w", container_options={"movflags": "empty_moov"}) as box:
        stream: Any = box.add_stream("libx264", 10)
        stream.height, stream.width, stream.pix_fmt = 48, 64, "yuv420p"
        stream.codec_context.open()
        box.start_encoding()


@pytest.mark.parametrize("make", [audio_only, no_frame])
def test_a_file_without_frames_is_told_in_one_sentence(tmp_path: Path, make: Any) -> None:
    path = tmp_path / "x.mp4"
    make(path)
    with pytest.raises(PoolError) as caught:
        VideoClip.whole(path)
    assert str(caught.value) in (
        f"The file '{path}' holds no video.",
        f"The video '{path}' holds no frame.",
    )


def read_till_it_breaks(path: Path) -> tuple[list[int], str]:
    """The numbers that are read, and what is said at the end."""
    shown = []
    try:
        for image in VideoClip(path, 0.0, N, 10).stream(range(N)):
            shown.append(barcode.number(image))
    except PoolError as error:
        return shown, str(error)
    return shown, ""


@pytest.mark.parametrize("name", ["h264_fragmented.mp4", "av1.mp4", "vp9.webm", "hevc.mp4"])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_truncated_file_gives_right_frames_and_then_one_sentence(
    tmp_path: Path, name: str, share: float
) -> None:
    in_front = {} if name.endswith("webm") else {"movflags": "faststart"}
    layout = {"container_options": in_front} | LAYOUTS[name]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SVT_LOG", "0")
        path = barcode.write(tmp_path / name, range(N), **layout)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    shown, message = read_till_it_breaks(path)
    assert shown == list(range(len(shown)))
    assert message.startswith("The ")
    assert message.endswith(".")
    assert str(path) in message
    assert "\n" not in message
    with pytest.raises(PoolError):
        VideoClip(path, 0.0, N, 10).digest()


def test_an_episode_before_the_damage_is_still_read(tmp_path: Path) -> None:
    path = barcode.write(tmp_path / "x.mkv", range(N), options={"g": "5"})
    content = path.read_bytes()
    path.write_bytes(content[: len(content) * 2 // 3])
    assert read(VideoClip(path, 0.2, 8, 10), range(8)) == list(range(2, 10))


@given(where=st.floats(0, 1, exclude_max=True), noise=st.binary(min_size=1, max_size=30))
@settings(max_examples=60, deadline=None)
def test_no_damage_raises_anything_but_a_sentence(
    plain: Path, tmp_path_factory: pytest.TempPathFactory, where: float, noise: bytes
) -> None:
    path = tmp_path_factory.mktemp("noise") / "x.mp4"
    content = bytearray(plain.read_bytes())
    start = int(where * (len(content) - len(noise)))
    content[start : start + len(noise)] = noise
    path.write_bytes(bytes(content))
    clip = VideoClip(path, 0.0, N, 10)
    for use in (clip.digest, clip.mp4, lambda: clip.frames(range(N)), lambda: probe(path)):
        with contextlib.suppress(PoolError):
            use()
