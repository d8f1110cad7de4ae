"""Data sets made by another hand show the frames that were drawn, or are refused in a sentence.

They come from a folder `shared/inputs` beside the repository, which other checks share; where it
is absent the laws of test_lerobot_sets.py stand alone.
"""

import contextlib
import importlib
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from teasim.pool import Pool
from teasim.pool.integrity import check_pool

ROOT = Path(__file__).parents[2]
FOLDERS = [folder / "shared" / "inputs" for folder in ROOT.parents]
INPUTS = next((folder for folder in FOLDERS if (folder / "make_inputs.py").is_file()), None)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(INPUTS is None, reason="no folder shared/inputs beside the repository"),
]

SETS = [
    "v30_h264",
    "v30_av1",
    "v30_hevc",
    "v30_vp9",
    "v30_one_file_each",
    "v30_image",
    "v30_language",
    "v21_h264",
    "v21_av1",
    "v20_h264",
    "off_grid",
    "fps_2997",
    "fps_15",
    "one_frame",
    "nested_key",
    "key_image",
    "key_slash",
    "key_plain",
    "odd_size",
    "two_episode_files",
    "wrong_total",
    "unicode_task",
    "no_state",
    "time_offset",
    "late_timestamps",
    "b_frames_long_gop",
    "depth_camera",
    "null_state",
    "nan_state",
    "symlinked_videos",
    "names_dict",
    "shape_empty",
    "list_float64",
    "unlogged_task_column",
    "some_labelled",
]
RATES = {"fps_2997": 29.97, "fps_15": 15.0}
STATE_ONLY_NOTES = ("null_state", "nan_state")
NOTED = {"off_grid", "late_timestamps", "wrong_total", "depth_camera", *STATE_ONLY_NOTES}
FAITHFUL = 12.0
"""Largest mean difference of a decoded frame from the drawn one, of 255."""


@pytest.fixture(scope="module")
def scene() -> Iterator[Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(INPUTS))
        yield importlib.import_module("scene")
    sys.modules.pop("scene", None)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all sets."""
    out = tmp_path_factory.mktemp("made")
    av1 = [name for name in SETS if "av1" in name]
    make(out, [*(name for name in SETS if name not in av1), "video_missing"])
    for name in av1:
        make(out, [name])
    return out


def make(out: Path, names: Sequence[str]) -> None:
    """Make sets in a process of their own, again if libsvtav1 4.1 waits for itself for ever."""
    command = [sys.executable, str(INPUTS / "make_inputs.py"), str(out), *names]
    for _ in range(3):
        with contextlib.suppress(subprocess.TimeoutExpired):
            subprocess.run(command, check=True, capture_output=True, timeout=200)
            return
    pytest.fail(f"{names[0]} could not be made in three attempts")


@pytest.mark.parametrize("name", SETS)
def test_the_frames_are_the_ones_that_were_drawn(scene: Any, made: Path, name: str) -> None:
    pool = Pool.open(made / name)
    assert check_pool(pool.root) == []
    assert bool(pool.notes) == (name in NOTED)
    height, width = (95, 127) if name == "odd_size" else (96, 128)
    order = scene.orders(6, {3: 2})
    for episode in (pool.episodes[0], pool.episodes[3]):
        rate = RATES.get(name, 10.0)
        drawn = list(
            scene.episode(episode.index, order[episode.index], rate, height, width, ("top",))
        )
        assert episode.length == (1 if name == "one_frame" else len(drawn))
        places = np.unique(np.linspace(0, episode.length - 1, 25).astype(int))
        seen = episode.clip(pool.cameras[0]).frames(places).astype(float)
        deviations = {
            shift: np.mean(
                [_deviation(i, drawn, p + shift) for p, i in zip(places, seen, strict=True)]
            )
            for shift in (0, -1, 1)
        }
        assert deviations[0] < FAITHFUL
        assert deviations[0] == min(deviations.values())


def _deviation(image: np.ndarray, drawn: list[Any], place: int) -> float:
    """Mean difference of a decoded frame from the drawn one at `place`, or the nearest to it."""
    picture = drawn[min(max(place, 0), len(drawn) - 1)].images["top"]
    return float(np.abs(image - picture).mean())


def test_what_is_damaged_is_refused_in_a_sentence(made: Path) -> None:
    assert check_pool(made / "video_missing") == [
        f"The video '{made}/video_missing/videos/observation.images.top/chunk-000/"
        "file-004.mp4' is missing."
    ]
