import contextlib
import shutil
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from teasim.common.errors import PoolError
from teasim.pool import Pool
from teasim.pool.integrity import check_pool
from tests import barcode
from tests.toy_pool import copy_pool, make_toy_pool, rewrite_table

EPISODES = "meta/episodes/chunk-000/file-000.parquet"
DATA = "data/chunk-000/file-001.parquet"
VIDEO = "videos/observation.images.left/chunk-000/file-001.mp4"
MANIFEST = "teasim/manifest.json"


def with_column(table: pa.Table, name: str, values: list[object]) -> pa.Table:
    position = table.column_names.index(name)
    return table.set_column(position, name, pa.array(values, table.schema.field(name).type))


def changed(name: str, change: Callable[[list[Any]], None]) -> Callable[[pa.Table], pa.Table]:
    def rewrite(table: pa.Table) -> pa.Table:
        values = table[name].to_pylist()
        change(values)
        return with_column(table, name, values)

    return rewrite


def set_value(name: str, place: int, value: object) -> Callable[[pa.Table], pa.Table]:
    return changed(name, lambda values: values.__setitem__(place, value))


def test_sound_pools_have_no_problem(toy_pool: Pool, foreign_pool: Pool) -> None:
    assert check_pool(toy_pool.root) == []
    assert check_pool(foreign_pool.root) == []


@pytest.mark.parametrize(
    ("file", "change", "message"),
    [
        (
            DATA,
            lambda table: table.slice(0, 30),
            "has 30 rows of demonstration 1, which has 42 frames.",
        ),
        (DATA, set_value("frame_index", 3, 4), "'frame_index' does not count the frames from 0 in"),
        (DATA, set_value("index", 3, 4), "'index' does not count the frames from 42 in the log "),
        (
            DATA,
            set_value("episode_index", 3, 0),
            "has 41 rows of demonstration 1, which has 42 frames.",
        ),
        (
            DATA,
            set_value("timestamp", 3, 9.0),
            "The timestamps of demonstration 1 do not ascend in the log ",
        ),
        (DATA, set_value("subtask_index", 3, 9), "There is a sub-task number without a name in "),
        (
            DATA,
            lambda table: table.drop_columns(["action"]),
            "has no column 'action'; it has observation.state,",
        ),
        (
            EPISODES,
            set_value("length", 1, 41),
            "file-001.parquet' has 42 rows of demonstration 1, which has 41 frames.",
        ),
        (
            EPISODES,
            set_value("length", 1, 41),
            "The log of demonstration 1 is shorter than its video '",
        ),
        (
            EPISODES,
            set_value("dataset_from_index", 1, 50),
            "Demonstration 1 covers the frames 50 to 84 of the pool but has 42 frames.",
        ),
        (
            EPISODES,
            set_value("episode_index", 1, 7),
            "has 0 rows of demonstration 7, which has 42 frames.",
        ),
        (
            EPISODES,
            set_value("teasim/demo_id", 1, "v2-" + "0" * 16),
            "Demonstration 1 is not the one that was written as v2-0000000000000000.",
        ),
        (
            EPISODES,
            set_value("videos/observation.images.left/from_timestamp", 1, -1.0),
            "is damaged: 'videos/observation.images.left/from_timestamp' is -1.0.",
        ),
    ],
)
@pytest.mark.parametrize("with_manifest", [True, False])
def test_contradictions_are_told_in_one_sentence(
    toy_pool: Pool,
    tmp_path: Path,
    file: str,
    change: Callable[[pa.Table], pa.Table],
    message: str,
    with_manifest: bool,
) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    rewrite_table(root / file, change)
    if not with_manifest:
        (root / MANIFEST).unlink()
    problems = check_pool(root)
    assert [problem for problem in problems if message in problem], problems
    assert all(problem.endswith(".") and "\n" not in problem for problem in problems)
    if with_manifest and file == DATA:
        assert f"The file '{root / DATA}' is damaged: its check sum is not the one" in problems[0]


def test_the_log_shorter_than_its_video_is_told_for_foreign_sets_too(
    foreign_pool: Pool, tmp_path: Path
) -> None:
    root = copy_pool(foreign_pool, tmp_path / "copy")
    last = len(foreign_pool.episodes) - 1
    rewrite_table(root / EPISODES, changed("length", lambda v: v.__setitem__(last, v[last] - 5)))
    rewrite_table(
        root / EPISODES, changed("dataset_to_index", lambda v: v.__setitem__(last, v[last] - 5))
    )
    problems = check_pool(root)
    assert any(f"log of demonstration {last} is shorter than its video" in p for p in problems)


@pytest.mark.parametrize("file", [DATA, VIDEO])
def test_a_missing_file_is_told(toy_pool: Pool, tmp_path: Path, file: str) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    (root / file).unlink()
    assert f"The file '{root / file}' is missing." in check_pool(root)


@pytest.mark.parametrize("with_manifest", [True, False])
def test_a_video_cut_short_is_told(toy_pool: Pool, tmp_path: Path, with_manifest: bool) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    other = make_toy_pool(
        tmp_path / "short", [("stir",)], size=48, frames_per_subtask=6, cameras=("left",)
    )
    shutil.copy(other.episodes[0].clip("left").path, root / VIDEO)
    if not with_manifest:
        (root / MANIFEST).unlink()
    assert (
        f"The video '{root / VIDEO}' is shorter than the log: it has 6 frames but demonstration 1 "
        f"ends at frame 42."
    ) in check_pool(root)


def test_a_camera_of_half_the_rate_is_as_long_as_its_log(toy_pool: Pool, tmp_path: Path) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    (root / MANIFEST).unlink()
    barcode.write(root / VIDEO, range(21), rate=Fraction(toy_pool.fps) / 2)
    assert not [problem for problem in check_pool(root) if "shorter" in problem]
    barcode.write(root / VIDEO, range(20), rate=Fraction(toy_pool.fps) / 2)
    assert (
        f"The video '{root / VIDEO}' is shorter than the log: it has 40 frames but demonstration 1 "
        f"ends at frame 42."
    ) in check_pool(root)


def test_identities_made_from_packets_are_left_alone(toy_pool: Pool, tmp_path: Path) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    rewrite_table(root / EPISODES, set_value("teasim/demo_id", 1, "0123456789abcdef"))
    assert check_pool(root) == []
    assert Pool.open(root).episodes[1].demo_id == "0123456789abcdef"


FILES = (
    DATA,
    VIDEO,
    EPISODES,
    MANIFEST,
    "meta/info.json",
    "meta/subtasks.parquet",
    "meta/tasks.parquet",
)


@st.composite
def damages(draw: st.DrawFn) -> Callable[[bytes], bytes]:
    """Cut the end off, or overwrite a few bytes somewhere."""
    share = draw(st.floats(0, 1, exclude_max=True))
    if draw(st.booleans()):
        return lambda content: content[: int(share * len(content))]
    flips = draw(st.binary(min_size=1, max_size=4).filter(any))

    def flip(content: bytes) -> bytes:
        start = int(share * (len(content) - len(flips)))
        part = bytes(a ^ b for a, b in zip(content[start:], flips, strict=False))
        return content[:start] + part + content[start + len(part) :]

    return flip


@pytest.fixture(scope="module")
def small_pool(tmp_path_factory: pytest.TempPathFactory) -> Pool:
    root = tmp_path_factory.mktemp("fuzz") / "pool"
    sequences = [("stir",), ("add_milk", "stir")]
    return make_toy_pool(root, sequences, size=16, frames_per_subtask=4, cameras=("left",))


def read_everything(root: Path) -> None:
    """All that a filter or a learner reads."""
    for episode in Pool.open(root).episodes:
        episode.spans()
        assert episode.record is None or episode.record.sequence
        for name in ("observation.state", "action", "next.success", "subtask_index"):
            assert len(episode.column(name)) == episode.length
        frames = episode.clip("left").frames(np.arange(episode.length))
        assert frames.shape[0] == episode.length


@settings(
    max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(file=st.sampled_from(FILES), damage=damages(), with_manifest=st.booleans())
def test_no_damage_gives_anything_but_a_sentence(
    small_pool: Pool,
    tmp_path_factory: pytest.TempPathFactory,
    file: str,
    damage: Callable[[bytes], bytes],
    with_manifest: bool,
) -> None:
    root = copy_pool(small_pool, tmp_path_factory.mktemp("damaged") / "pool")
    content = (root / file).read_bytes()
    (root / file).write_bytes(damage(content))
    if not with_manifest and file != MANIFEST:
        (root / MANIFEST).unlink()
    problems = check_pool(root)
    assert all(problem.endswith(".") and "\n" not in problem for problem in problems)
    with contextlib.suppress(PoolError):
        read_everything(root)
    if with_manifest and file in (DATA, VIDEO):
        assert problems
