"""Videos of the page: small, in time with the demonstration, embedded or beside the page."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from filtering.demo_filter import DemoFilter
from filtering.output import FILES, write_filter_output
from filtering.report import videos as module
from filtering.report.videos import LONGER_SIDE, RATE, Wanted, encode, page_films
from teasim.common.errors import ConfigError
from teasim.common.workers import IN_PROCESS
from teasim.pool import Pool
from teasim.pool.clips import VideoClip, VideoWriter, probe


class NoiseClip:
    """Noise that can only be streamed; every frame has its number in the red channel."""

    path = Path("nowhere")

    def __init__(self, length: int, height: int, width: int) -> None:
        self.length, self.shape = length, (height, width, 3)

    def stream(self, indices: np.ndarray) -> Iterator[np.ndarray]:
        for index in indices:
            image = np.random.default_rng(index).integers(0, 255, self.shape, dtype=np.uint8)
            image[:, :, 0] = index
            yield image

    def mp4(self) -> None:
        return None


@pytest.mark.parametrize(
    ("height", "width", "fps", "size", "rate"),
    [
        (480, 640, 30.0, (240, 320), 10.0),
        (500, 100, 25.0, (320, 64), 25 / 3),
        (64, 48, 10.0, (64, 48), 10.0),
        (64, 48, 5.0, (64, 48), 5.0),
    ],
)
def test_videos_are_shrunk_thinned_and_last_as_long(height, width, fps, size, rate, tmp_path):
    encode(NoiseClip(31, height, width), fps, tmp_path / "a.mp4")  # type: ignore[arg-type]
    info = probe(tmp_path / "a.mp4")
    assert (info.height, info.width) == size
    assert max(size) <= LONGER_SIDE
    assert info.fps == pytest.approx(rate, rel=1e-3)
    assert info.fps <= RATE + 1e-6
    step = round(fps / rate)
    assert info.n_frames == len(range(0, 31, step))
    assert (info.codec, info.pix_fmt) == ("h264", "yuv420p")


@pytest.fixture
def stored(tmp_path: Path) -> VideoClip:
    """A stored mp4 of 20 frames at 10 frames/s."""
    writer = VideoWriter(tmp_path / "stored.mp4", height=64, width=64, fps=10)
    for image in NoiseClip(20, 64, 64).stream(np.arange(20)):
        writer.add(image)
    writer.close()
    return VideoClip.whole(tmp_path / "stored.mp4")


def test_a_small_stored_mp4_is_shown_as_it_is_and_a_large_one_is_not(
    stored: VideoClip, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    size = stored.path.stat().st_size
    for limit, same in ((size / 2 + 1, True), (size / 2 - 1, False)):
        monkeypatch.setattr(module, "STORED", limit)  # the video lasts two seconds
        found = page_films({(7, 1): Wanted(stored, ())}, 10.0, tmp_path, "none", workers=IN_PROCESS)
        assert found[7, 1].video == "videos/demo_000007_1.mp4"
        shown = (tmp_path / found[7, 1].video).read_bytes()
        assert (shown == stored.path.read_bytes()) == same
        assert same or len(shown) < size


def test_few_videos_are_embedded_and_leave_no_folder(
    stored: VideoClip, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = {(number, 0): Wanted(stored, (0, 13)) for number in range(2)}

    def films(embed: Any) -> list[str]:
        found = page_films(wanted, 10.0, tmp_path, embed, workers=IN_PROCESS).values()
        assert all(list(film.stills) == [0, 13] for film in found)
        return [address for film in found for address in (film.video, *film.stills.values())]

    def embedded(addresses: list[str]) -> bool:
        inside = {address.startswith("data:") for address in addresses}
        assert inside == {not (tmp_path / "videos").exists()}
        return inside == {True}

    assert embedded(films("auto"))
    assert films("auto")[0].startswith("data:video/mp4;base64,")
    assert films("auto")[1].startswith("data:image/jpeg;base64,")
    assert not embedded(films("none"))
    monkeypatch.setattr(module, "EMBEDDED", 0)
    assert not embedded(films("auto"))
    assert embedded(films("all"))


def test_pictures_show_the_frames_that_were_asked_for(stored: VideoClip, tmp_path: Path) -> None:
    found = page_films(
        {(0, 0): Wanted(stored, (2, 19))}, 10.0, tmp_path, "none", workers=IN_PROCESS
    )
    for frame, address in found[0, 0].stills.items():
        shown = cv2.cvtColor(cv2.imread(str(tmp_path / address)), cv2.COLOR_BGR2RGB)
        assert shown.shape == (64, 64, 3)
        (wanted,) = stored.frames([frame])
        assert abs(shown.astype(float).mean() - wanted.astype(float).mean()) < 3


def test_many_videos_are_linked_and_replaced_with_the_page(
    toy_filter: DemoFilter, toy_pool: Pool, tmp_path: Path
) -> None:
    out = tmp_path / "out"

    def written(**options: Any) -> list[str]:
        write_filter_output(out, toy_pool, toy_filter, **options)
        return addresses(out / "report.html")

    links = written(embed="none")
    assert sorted(path.name for path in out.iterdir()) == sorted([*FILES, "videos"])
    flagged = int(toy_filter.flagged_.sum())
    assert len(toy_pool.episodes) + flagged <= len(links) <= 2 * len(toy_pool.episodes)
    assert all(probe(out / link).n_frames for link in links)
    (out / "videos" / "holiday.mp4").write_bytes(b"precious")
    with pytest.raises(ConfigError, match=r"holds other files \('videos/holiday.mp4'\)"):
        written(overwrite=True)
    assert (out / "videos" / "holiday.mp4").read_bytes() == b"precious"
    (out / "videos" / "holiday.mp4").unlink()
    assert all(link.startswith("data:") for link in written(overwrite=True))
    assert sorted(path.name for path in out.iterdir()) == sorted(FILES)


def addresses(page: Path) -> list[str]:
    """Addresses of the videos of a page."""
    found = re.search(r'id="films">(.*?)</script>', page.read_text())
    assert found is not None
    return list(json.loads(found[1]).values())
