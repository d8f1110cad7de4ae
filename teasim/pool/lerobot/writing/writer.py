"""Writing one demonstration: frames in, a complete folder out, or nothing at all."""

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa

from teasim.common.errors import PoolError
from teasim.pool.clips import VideoClip, VideoWriter
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.identity import demo_id
from teasim.pool.lerobot.writing.staging import (
    StagedEpisode,
    claim_folder,
    save_staged,
    staged_folder,
)
from teasim.pool.lerobot.writing.statistics import FRAME_STRIDE, ImageHistogram
from teasim.pool.types import NO_SUBTASK, EpisodeRecord, PoolHeader, index_from_spans


class EpisodeWriter:
    """Writes demonstration `index` of a pool; several writers may run in several processes.

    It works in a folder of its own below ROOT/.incomplete/ and renames it when `finish` is
    called, so a crash leaves nothing half done. Left without `finish`, it discards everything.
    """

    def __init__(self, root: Path | str, index: int, header: PoolHeader) -> None:
        """Claim `root` for a pool with this header.

        Raises:
            PoolError: `root` is in use by something else (see `claim_folder`).
        """
        self._root = Path(root)
        self._index = index
        self._header = header
        claim_folder(self._root, header)
        target = staged_folder(self._root, index)
        self._folder = target.with_name(f"{target.name}.{os.getpid()}.tmp")
        self._columns: dict[str, list[Any]] = {name: [] for name in _logged_columns(header)}
        self._histograms = {camera: ImageHistogram() for camera in header.cameras}
        self._videos: dict[str, VideoWriter] = {}
        self._length = 0
        self._finished = False

    def __enter__(self) -> Self:
        """Open the videos."""
        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True)
        for camera in self._header.cameras:
            self._videos[camera] = VideoWriter(
                self._folder / f"{camera}.mp4",
                height=self._header.height,
                width=self._header.width,
                fps=self._header.fps,
            )
        return self

    def __exit__(self, *error: object) -> None:
        """Discard the demonstration unless it was finished."""
        if not self._finished:
            for video in self._videos.values():
                video.abort()
            shutil.rmtree(self._folder, ignore_errors=True)

    def add_frame(
        self,
        *,
        images: Mapping[str, np.ndarray],
        state: np.ndarray | None = None,
        action: np.ndarray | None = None,
        environment_state: np.ndarray | None = None,
        subtask_index: int = NO_SUBTASK,
        reward: float = 0.0,
        success: bool = False,
    ) -> None:
        """Append one frame.

        Args:
            images: (H, W, 3) uint8 RGB per camera of the header.
            state: (S,) measured joint positions in rad, openings in m; None without a joint log.
            action: (S,) joint targets in rad, openings in m; None without a joint log.
            environment_state: (E,) as the header names it, else None.
            subtask_index: Which sub-task of the header this frame belongs to, -1 for none.
            reward: Reward earned by this frame.
            success: Whether the goal is reached at this frame.

        Raises:
            PoolError: A camera is missing or unknown, a shape is not the header's, or a number is
                not finite.
        """
        if self._finished:
            raise PoolError(f"Demonstration {self._index} is finished; no frame can be added.")
        pictures = self._checked_images(images)
        logged = self._checked_logs(
            {
                layout.STATE: state,
                layout.ACTION: action,
                layout.ENVIRONMENT_STATE: environment_state,
            }
        )
        row = logged | {
            layout.SUBTASK_INDEX: int(subtask_index),
            "next.reward": float(reward),
            "next.success": bool(success),
        }
        for name, value in row.items():
            self._columns[name].append(value)
        for camera, image in pictures.items():
            self._videos[camera].add(image)
            if self._length % FRAME_STRIDE == 0:
                self._histograms[camera].add(image)
        self._length += 1

    def finish(self, record: EpisodeRecord) -> None:
        """Make the demonstration part of the pool.

        Raises:
            PoolError: It has no frame, or `record.spans` disagree with the frames' sub-tasks.
        """
        if self._finished:
            raise PoolError(f"Demonstration {self._index} was finished already.")
        if not self._length:
            raise PoolError(f"Demonstration {self._index} has no frame.")
        self._check_record(record)
        for video in self._videos.values():
            video.close()
        fps = float(self._header.fps)
        pictures = {}
        for first in sorted(self._header.cameras)[:1]:
            clip = VideoClip(self._folder / f"{first}.mp4", 0.0, self._length, fps)
            pictures[layout.CAMERA_PREFIX + first] = clip.digest()
        logs = {name: np.stack(self._columns[name]) for name in _vector_columns(self._header)}
        staged = StagedEpisode(
            folder=self._folder,
            columns=self._table(),
            record=record,
            demo_id=demo_id(pictures, logs),
            histograms=self._histograms,
        )
        save_staged(staged, staged_folder(self._root, self._index))
        self._finished = True

    def _checked_images(self, images: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
        if set(images) != set(self._header.cameras):
            raise PoolError(
                f"Frame {self._length} has pictures of {', '.join(sorted(images)) or 'no camera'}; "
                f"the pool has the cameras {', '.join(self._header.cameras) or 'none'}."
            )
        shape = (self._header.height, self._header.width, 3)
        for camera, image in images.items():
            if image.shape != shape or image.dtype != np.uint8:
                raise PoolError(
                    f"Frame {self._length} of camera {camera} is {image.dtype} {image.shape}; "
                    f"the pool needs uint8 {shape}."
                )
        return images

    def _checked_logs(self, logs: Mapping[str, np.ndarray | None]) -> dict[str, Any]:
        expected = _vector_columns(self._header)
        checked: dict[str, Any] = {}
        for name, given in logs.items():
            if given is None and name not in expected:
                continue
            size = f"{expected[name]} numbers" if name in expected else "nothing"
            values = np.asarray([] if given is None else given, dtype=np.float32)
            if values.shape != (expected.get(name, -1),):
                raise PoolError(
                    f"Frame {self._length} has {name} of shape {values.shape}; "
                    f"the pool's header asks for {size}."
                )
            if not np.isfinite(values).all():
                raise PoolError(
                    f"Frame {self._length} has {name} with a number that is not finite."
                )
            checked[name] = values.copy()
        return checked

    def _check_record(self, record: EpisodeRecord) -> None:
        column = np.asarray(self._columns[layout.SUBTASK_INDEX])
        told = index_from_spans(record.spans, self._header.subtasks, self._length)
        different = np.flatnonzero(told != column)
        if different.size:
            raise PoolError(
                f"The spans of demonstration {self._index} disagree with subtask_index at "
                f"frame {different[0]}."
            )
        for mistake in record.mistakes:
            if mistake.stop > self._length:
                raise PoolError(
                    f"The mistake {mistake.name} of {mistake.subtask} ends at frame {mistake.stop} "
                    f"but demonstration {self._index} has {self._length} frames."
                )

    def _table(self) -> pa.Table:
        columns = {
            name: _as_arrow(np.asarray(values), name) for name, values in self._columns.items()
        }
        done = np.zeros(self._length, dtype=bool)
        done[-1] = True
        columns["next.done"] = pa.array(done)
        frames = np.arange(self._length)
        columns["timestamp"] = pa.array((frames / self._header.fps).astype(np.float32))
        columns["frame_index"] = pa.array(frames.astype(np.int64))
        return pa.table(columns)


def _vector_columns(header: PoolHeader) -> dict[str, int]:
    """Number of dimensions of each vector the header asks for."""
    features = layout.features_of(header)
    names = (layout.STATE, layout.ACTION, layout.ENVIRONMENT_STATE)
    return {name: features[name]["shape"][0] for name in names if name in features}


def _logged_columns(header: PoolHeader) -> list[str]:
    return [*_vector_columns(header), layout.SUBTASK_INDEX, "next.reward", "next.success"]


def _as_arrow(values: np.ndarray, name: str) -> pa.Array:
    if values.ndim == 2:
        flat = pa.array(values.astype(np.float32).ravel())
        return pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
    if name == "next.reward":
        return pa.array(values.astype(np.float32))
    return pa.array(values)
