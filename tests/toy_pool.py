"""Small pools whose pictures a network can tell apart: one colour and path per sub-task."""

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from teasim.constants import STATE_NAMES, SUBTASKS
from teasim.pool import EpisodeRecord, EpisodeWriter, MistakeSpan, Pool, PoolHeader, Span
from teasim.pool import finalize_pool as finalize

SEQ_1 = (
    "turn_on_oven",
    "add_tea_bag",
    "add_sugar",
    "add_milk",
    "turn_off_oven",
    "add_water",
    "stir",
)
SEQ_2 = (
    "turn_on_oven",
    "add_sugar",
    "add_milk",
    "add_tea_bag",
    "turn_off_oven",
    "add_water",
    "stir",
)
FPS = 10
PIXEL_NOISE = 5.0
READY = np.linspace(-0.5, 0.5, len(STATE_NAMES))
LABEL_COLUMNS = ("teasim/correct", "teasim/sequence", "teasim/mistakes")

COLOURS = np.array(
    [
        (200, 60, 50),
        (50, 90, 200),
        (230, 220, 190),
        (240, 170, 60),
        (60, 160, 70),
        (150, 70, 180),
        (70, 180, 190),
        (120, 120, 60),
        (220, 120, 170),
    ],
    dtype=np.float64,
)


def make_toy_pool(
    path: Path | str,
    sequences: Sequence[Sequence[str]],
    *,
    size: int = 64,
    frames_per_subtask: int = 12,
    cameras: Sequence[str] = ("left", "cup"),
    seed: int = 0,
    correct: Sequence[bool] | None = None,
    embodiment: str = "yumi",
) -> Pool:
    """Write a pool with one demonstration per sequence of sub-task names, by the real writer.

    Args:
        path: New or empty folder.
        sequences: Sub-task names per demonstration; the tea-making seven, or any others.
        size: Height and width of the frames in pixels.
        frames_per_subtask: Length of each sub-task in frames (10 per second).
        cameras: Camera names.
        seed: Seed of noise, tint and motion.
        correct: Label per demonstration; by default only Seq_1 is correct.
        embodiment: yumi, or person for a pool without joint log.
    """
    root = Path(path)
    header = toy_header(
        sequences, size=size, cameras=cameras, embodiment=embodiment, config={"seed": seed}
    )
    for index, sequence in enumerate(sequences):
        label = None if correct is None else correct[index]
        write_toy_episode(
            root, index, header, sequence, frames_per_subtask=frames_per_subtask, correct=label
        )
    return finalize(root, header, len(sequences))


def toy_header(
    sequences: Sequence[Sequence[str]] = (SUBTASKS,),
    *,
    size: int = 64,
    cameras: Sequence[str] = ("left", "cup"),
    embodiment: str = "yumi",
    config: dict[str, Any] | None = None,
) -> PoolHeader:
    """The header of a toy pool of these sequences."""
    used = dict.fromkeys(name for sequence in sequences for name in sequence)
    subtasks = SUBTASKS if set(used) <= set(SUBTASKS) else tuple(used)
    robot = embodiment == "yumi"
    return PoolHeader(
        fps=FPS,
        cameras=tuple(cameras),
        height=size,
        width=size,
        subtasks=subtasks,
        state_names=STATE_NAMES if robot else None,
        environment_state_names=tuple(f"{name}_done" for name in subtasks) if robot else None,
        robot_type="abb_yumi" if robot else None,
        config={"seed": 0} if config is None else config,
    )


def write_toy_episode(
    root: Path,
    index: int,
    header: PoolHeader,
    sequence: Sequence[str],
    *,
    frames_per_subtask: int = 12,
    correct: bool | None = None,
) -> None:
    """Write one demonstration; its frames depend on header, index and sequence alone."""
    rng = np.random.default_rng([int(header.config["seed"]), index])
    record = _record(header, index, sequence, frames_per_subtask, correct)
    tint = rng.uniform(0.9, 1.1, 3)
    goals = np.random.default_rng(7).normal(0.0, 0.4, (len(header.subtasks), len(READY)))
    done = np.zeros(len(header.subtasks), dtype=np.float32)
    with EpisodeWriter(root, index, header) as writer:
        for step, name in enumerate(sequence):
            subtask = header.subtasks.index(name)
            for frame in range(frames_per_subtask):
                progress = frame / frames_per_subtask
                last = step == len(sequence) - 1 and frame == frames_per_subtask - 1
                done[subtask] = max(done[subtask], np.float32(frame == frames_per_subtask - 1))
                writer.add_frame(
                    images={
                        camera: _picture(rng, header, subtask, progress, i, tint)
                        for i, camera in enumerate(header.cameras)
                    },
                    subtask_index=subtask,
                    reward=float(last and record.correct),
                    success=last and record.correct,
                    **_logs(rng, header, goals[subtask], progress, done),
                )
        writer.finish(record)


def strip_ground_truth(path: Path | str) -> Pool:
    """Take `correct`, `sequence` and `mistakes` out of a pool's tables and manifest."""
    root = Path(path)
    for file in (root / "meta" / "episodes").rglob("*.parquet"):
        table = pq.read_table(file)
        kept = [name for name in table.column_names if name not in LABEL_COLUMNS]
        pq.write_table(table.select(kept), file)
    manifest_path = root / "teasim" / "manifest.json"
    manifest = json.loads(manifest_path.read_text())
    for entry in manifest["episodes"]:
        for name in ("correct", "sequence", "mistakes"):
            entry.pop(name, None)
    manifest_path.write_text(json.dumps(manifest))
    return Pool.open(root)


def strip_labels(path: Path | str) -> Pool:
    """Take every label out of a pool: all that is known to be correct, and all sub-tasks."""
    root = Path(path)
    shutil.rmtree(root / "teasim")
    (root / "meta" / "subtasks.parquet").unlink()
    (root / "meta" / "temporal_proportions_sparse.json").unlink()
    info = json.loads((root / "meta" / "info.json").read_text())
    info["features"] = {n: f for n, f in info["features"].items() if not _is_label(n)}
    (root / "meta" / "info.json").write_text(json.dumps(info))
    for folder in ("meta/episodes", "data"):
        for file in (root / folder).rglob("*.parquet"):
            rewrite_table(
                file,
                lambda table: table.select([n for n in table.column_names if not _is_label(n)]),
            )
    return Pool.open(root)


def _unlabelled(table: pa.Table) -> pa.Table:
    return table.select([name for name in table.column_names if not _is_label(name)])


def _is_label(column: str) -> bool:
    kept = ("teasim/", "sparse_", "subtask_index", "next.")
    return column.startswith(kept) and column != "teasim/demo_id"


def rewrite_table(path: Path, change: Callable[[pa.Table], pa.Table]) -> None:
    """Replace a parquet file by a changed one."""
    table = change(pq.read_table(path))
    path.unlink()
    pq.write_table(table, path)


def copy_pool(pool: Pool, target: Path) -> Path:
    """A copy that a test may damage."""
    shutil.copytree(pool.root, target)
    return target


def _record(
    header: PoolHeader,
    index: int,
    sequence: Sequence[str],
    frames: int,
    correct: bool | None,
) -> EpisodeRecord:
    spans = [Span(name, i * frames, (i + 1) * frames) for i, name in enumerate(sequence)]
    known: dict[tuple[str, ...], str] = {SEQ_1: "seq_1", SEQ_2: "seq_2"}
    label = known.get(tuple(sequence), "seq_3")
    return EpisodeRecord(
        sequence=label,
        correct=label == "seq_1" if correct is None else correct,
        mistakes=_skips(sequence, frames) if header.subtasks == SUBTASKS else (),
        spans=tuple(spans),
        participant=f"p{index % 3 + 1}",
        embodiment="person" if header.state_names is None else "yumi",
        seed=index,
    )


def _skips(sequence: Sequence[str], frames: int) -> tuple[MistakeSpan, ...]:
    """The tea-making sub-tasks that were left out, where they should have begun."""
    skips = []
    for position, name in enumerate(SEQ_1):
        if name not in sequence:
            before = [i for i, other in enumerate(sequence) if other in SEQ_1[:position]]
            start = (max(before) + 1 if before else 0) * frames
            skips.append(MistakeSpan("skip", name, start, start))
    return tuple(sorted(skips, key=lambda skip: skip.start))


def _logs(
    rng: np.random.Generator,
    header: PoolHeader,
    goal: np.ndarray,
    progress: float,
    done: np.ndarray,
) -> dict[str, np.ndarray]:
    """Joints leave the rest pose, reach the goal half-way, and come back to rest."""
    if header.state_names is None:
        return {}
    target = READY + goal * np.sin(np.pi * progress)
    return {
        "state": (target + rng.normal(0, 0.002, len(READY))).astype(np.float32),
        "action": (target + rng.normal(0, 0.002, len(READY))).astype(np.float32),
        "environment_state": done,
    }


def _picture(
    rng: np.random.Generator,
    header: PoolHeader,
    subtask: int,
    progress: float,
    camera: int,
    tint: np.ndarray,
) -> np.ndarray:
    """A grey table, a square of the sub-task's colour, and a blob on the sub-task's own path."""
    size = header.height
    rows, columns = np.mgrid[0:size, 0:size] / size
    image = np.full((size, size, 3), 110.0 + 25.0 * camera)
    colour = COLOURS[subtask % len(COLOURS)] * tint
    angle = 2 * np.pi * subtask / len(header.subtasks) + camera
    centre = 0.5 + 0.3 * np.array([np.sin(angle), np.cos(angle)])
    square = np.maximum(abs(rows - centre[0]), abs(columns - centre[1])) < 0.18
    image[square] = colour
    swing = angle + np.pi * np.sin(np.pi * progress)
    blob = 0.5 + 0.25 * np.array([np.cos(swing), np.sin(swing)])
    image[(rows - blob[0]) ** 2 + (columns - blob[1]) ** 2 < 0.01] = 255.0 - colour
    image += rng.normal(0.0, PIXEL_NOISE, image.shape)
    return image.clip(0, 255).astype(np.uint8)
