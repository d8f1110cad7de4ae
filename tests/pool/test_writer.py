import hashlib
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from teasim.common.errors import PoolError
from teasim.common.parallel import run
from teasim.common.workers import Workers
from teasim.pool import (
    EpisodeRecord,
    EpisodeWriter,
    MistakeSpan,
    Pool,
    PoolHeader,
    Span,
    episode_is_done,
    finalize_pool,
)
from tests.toy_pool import make_toy_pool, toy_header, write_toy_episode

SEQUENCES = (("stir",), ("add_milk", "stir"))
HEADER = toy_header(size=16, cameras=("left",))
IMAGES = {"left": np.zeros((16, 16, 3), dtype=np.uint8)}
STATE = np.zeros(16, dtype=np.float32)
WORLD = np.zeros(7, dtype=np.float32)
FRAME = {"images": IMAGES, "state": STATE, "action": STATE, "environment_state": WORLD}


def record(*spans: Span, mistakes: tuple[MistakeSpan, ...] = ()) -> EpisodeRecord:
    return EpisodeRecord("seq_1", True, mistakes, spans, "p1", "yumi", 0)


def digests(root: Path) -> dict[str, str]:
    """Check sum of every file below a folder."""
    return {
        path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(root.rglob("*"))
        if path.is_file()
    }


def write_one(root: Path, header: PoolHeader, index: int) -> None:
    write_toy_episode(root, index, header, SEQUENCES[index], frames_per_subtask=3)


def write_frame(writer: EpisodeWriter, **changes: object) -> None:
    writer.add_frame(**(FRAME | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize("backwards", [False, True])
def test_files_do_not_depend_on_workers_or_order(tmp_path: Path, backwards: bool) -> None:
    for index in (1, 0) if backwards else (0, 1):
        write_one(tmp_path / "one", HEADER, index)
    finalize_pool(tmp_path / "one", HEADER, 2)
    run(partial(write_one, tmp_path / "two", HEADER), range(2), workers=Workers(2))
    finalize_pool(tmp_path / "two", HEADER, 2)
    assert digests(tmp_path / "one") == digests(tmp_path / "two")


def test_another_seed_gives_other_demonstrations(tmp_path: Path) -> None:
    pools = [
        make_toy_pool(tmp_path / str(seed), [("stir",)], size=16, frames_per_subtask=3, seed=seed)
        for seed in (0, 1)
    ]
    assert pools[0].episodes[0].demo_id != pools[1].episodes[0].demo_id
    assert pools[0].content_hash() != pools[1].content_hash()


def crash(root: Path) -> None:
    with EpisodeWriter(root, 1, HEADER) as writer:
        write_frame(writer)
        raise ZeroDivisionError


def test_a_crash_leaves_nothing_and_what_is_done_is_kept(tmp_path: Path) -> None:
    root = tmp_path / "pool"
    write_one(root, HEADER, 0)
    before = digests(root)
    with pytest.raises(ZeroDivisionError):
        crash(root)
    assert digests(root) == before
    assert [episode_is_done(root, i, HEADER) for i in range(2)] == [True, False]
    write_one(root, HEADER, 1)
    assert len(finalize_pool(root, HEADER, 2).episodes) == 2


def test_a_resumed_pool_is_the_one_never_interrupted(tmp_path: Path) -> None:
    whole = make_toy_pool(
        tmp_path / "whole", SEQUENCES, size=16, frames_per_subtask=3, cameras=("left",)
    )
    root = tmp_path / "resumed"
    write_one(root, HEADER, 0)
    # A crash between the renames of finalize_pool leaves a folder of an earlier attempt behind.
    (root / "data").mkdir()
    (root / "data" / "old.parquet").touch()
    write_one(root, HEADER, 1)
    finalize_pool(root, HEADER, 2)
    assert digests(root) == digests(whole.root)


def test_without_finish_the_demonstration_is_discarded(tmp_path: Path) -> None:
    with EpisodeWriter(tmp_path, 0, HEADER) as writer:
        write_frame(writer)
    assert not episode_is_done(tmp_path, 0, HEADER)


def test_missing_demonstrations_are_told_by_number(tmp_path: Path) -> None:
    write_one(tmp_path, HEADER, 0)
    with pytest.raises(PoolError) as caught:
        finalize_pool(tmp_path, HEADER, 3)
    assert str(caught.value) == (
        f"The pool '{tmp_path}' cannot be finished: 2 of its 3 demonstrations are missing (1, 2)."
    )
    with pytest.raises(PoolError, match=r"^There is no pool|^The pool '.*' is unfinished, with 1 "):
        Pool.open(tmp_path)


def foreign_folder(root: Path) -> None:
    root.mkdir()
    (root / "thesis.tex").write_text("years of work")


def finished_pool(root: Path) -> None:
    write_one(root, HEADER, 0)
    finalize_pool(root, HEADER, 1)


def other_unfinished_pool(root: Path) -> None:
    write_one(root, replace(HEADER, config={"seed": 5}), 0)


def plain_file(root: Path) -> None:
    root.write_text("years of work")


@pytest.mark.parametrize(
    ("occupy", "message"),
    [
        (foreign_folder, "is not empty and holds no pool; choose one that is new or empty."),
        (finished_pool, "already holds a finished pool; choose another folder or remove it."),
        (
            other_unfinished_pool,
            "holds an unfinished pool made with other settings; use the same settings to finish "
            "it, choose another folder, or remove it.",
        ),
        (plain_file, "is a file; choose a folder that is new or empty."),
    ],
)
def test_a_folder_in_use_is_refused_and_not_harmed(
    tmp_path: Path, occupy: Callable[[Path], None], message: str
) -> None:
    root = tmp_path / "used"
    occupy(root)
    before = digests(tmp_path)
    for attempt in (
        lambda: EpisodeWriter(root, 0, HEADER),
        lambda: episode_is_done(root, 0, HEADER),
        lambda: finalize_pool(root, HEADER, 1),
    ):
        with pytest.raises(PoolError) as caught:
            attempt()
        assert str(caught.value).endswith(message)
        assert f"'{root}'" in str(caught.value)
    assert digests(tmp_path) == before


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"images": {"top": IMAGES["left"]}},
            "Frame 0 has pictures of top; the pool has the cameras left.",
        ),
        (
            {"images": {"left": np.zeros((8, 16, 3), np.uint8)}},
            "Frame 0 of camera left is uint8 (8, 16, 3); the pool needs uint8 (16, 16, 3).",
        ),
        (
            {"images": {"left": np.zeros((16, 16, 3))}},
            "Frame 0 of camera left is float64 (16, 16, 3); the pool needs uint8 (16, 16, 3).",
        ),
        (
            {"state": np.zeros(3)},
            "Frame 0 has observation.state of shape (3,); the pool's header asks for 16 numbers.",
        ),
        (
            {"action": None},
            "Frame 0 has action of shape (0,); the pool's header asks for 16 numbers.",
        ),
        (
            {"environment_state": np.full(7, np.nan)},
            "Frame 0 has observation.environment_state with a number that is not finite.",
        ),
    ],
)
def test_a_frame_that_is_not_the_headers_is_refused(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    with EpisodeWriter(tmp_path, 0, HEADER) as writer:
        with pytest.raises(PoolError) as caught:
            write_frame(writer, **changes)
        assert str(caught.value) == message


def test_a_log_nobody_asked_for_is_refused(tmp_path: Path) -> None:
    header = toy_header(size=16, cameras=("left",), embodiment="person")
    message = r"^Frame 0 has observation\.state of shape \(16,\); .* header asks for nothing\.$"
    with EpisodeWriter(tmp_path, 0, header) as writer, pytest.raises(PoolError, match=message):
        writer.add_frame(images=IMAGES, state=STATE)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        (
            record(Span("stir", 0, 2)),
            "The spans of demonstration 0 disagree with subtask_index at frame 2.",
        ),
        (
            record(Span("fly", 0, 3)),
            "'fly' is no sub-task of this pool; choose turn_on_oven, add_water, add_sugar, "
            "add_milk, add_tea_bag, stir, turn_off_oven.",
        ),
        (
            record(Span("stir", 0, 3), mistakes=(MistakeSpan("skip", "add_milk", 9, 9),)),
            "The mistake skip of add_milk ends at frame 9 but demonstration 0 has 3 frames.",
        ),
    ],
)
def test_a_record_that_contradicts_the_frames_is_refused(
    tmp_path: Path, told: EpisodeRecord, message: str
) -> None:
    with EpisodeWriter(tmp_path, 0, HEADER) as writer:
        for _ in range(3):
            write_frame(writer, subtask_index=HEADER.subtasks.index("stir"))
        with pytest.raises(PoolError) as caught:
            writer.finish(told)
    assert str(caught.value) == message
    assert not episode_is_done(tmp_path, 0, HEADER)


def test_a_demonstration_has_frames_and_ends_once(tmp_path: Path) -> None:
    with EpisodeWriter(tmp_path, 0, HEADER) as writer:
        with pytest.raises(PoolError, match=r"^Demonstration 0 has no frame\.$"):
            writer.finish(record())
        write_frame(writer)
        writer.finish(record())
        with pytest.raises(PoolError, match=r"^Demonstration 0 was finished already\.$"):
            writer.finish(record())
        with pytest.raises(PoolError, match=r"^Demonstration 0 is finished; no frame can be"):
            write_frame(writer)
