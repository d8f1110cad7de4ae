"""Reading any well-formed LeRobotDataset; what only our pools have is optional."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from copy import copy
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from teasim.pool.hub import located
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.describing.features import dimension_names, is_log
from teasim.pool.lerobot.describing.metadata import Metadata, read_metadata
from teasim.pool.lerobot.episode import Episode
from teasim.pool.lerobot.labelling import Labelling
from teasim.pool.lerobot.soundness import Findings, look_at
from teasim.pool.selection import lerobot_usage


class Pool:
    """A pool of demonstrations on disk; never modified."""

    def __init__(self, meta: Metadata) -> None:
        """Use `Pool.open`."""
        self._meta = meta
        self._labelling = Labelling(meta)
        places = range(len(meta.episodes))
        self.episodes = tuple(Episode(meta, self._labelling, place) for place in places)

    @classmethod
    def open(cls, path: Path | str) -> Self:
        """Open a LeRobotDataset v3.0, v2.1 or v2.0; logs and videos are not read yet.

        Raises:
            PoolError: There is no pool at `path`, it is empty, or its metadata are damaged.
        """
        return cls(read_metadata(located(path)))

    def only(self, places: Sequence[int]) -> Self:
        """Return a pool of the demonstrations at some places of this one; no file is copied.

        It is a pool, which policies can learn from; a part of any source is a `views.part.Part`.
        """
        part = copy(self)
        vars(part).pop("_findings", None)  # they are about all demonstrations
        part.episodes = tuple(self.episodes[place] for place in places)
        return part

    def __repr__(self) -> str:
        """Folder and size."""
        return f"Pool('{self.root}', {len(self.episodes)} demonstrations)"

    @property
    def metadata(self) -> Metadata:
        """What info.json, the manifest and the episodes table say."""
        return self._meta

    @property
    def root(self) -> Path:
        """Folder of the pool."""
        return self._meta.root

    @property
    def fps(self) -> int | float:
        """Frames per second of videos and logs."""
        return self._meta.fps

    @property
    def info(self) -> Mapping[str, Any]:
        """meta/info.json as it is."""
        return self._meta.info

    @property
    def manifest(self) -> Mapping[str, Any]:
        """teasim/manifest.json as it is; empty for a foreign data set."""
        return self._meta.manifest

    @property
    def cameras(self) -> tuple[str, ...]:
        """Short camera names: the key after 'observation.images.'; depth cameras are left out."""
        return tuple(self._meta.cameras)

    @property
    def subtasks(self) -> tuple[str, ...]:
        """Names in the order of subtask_index; empty when the data set labels none.

        Raises:
            PoolError: The labels are damaged.
        """
        return self._labelling.names

    @property
    def state_names(self) -> tuple[str, ...] | None:
        """Names of the dimensions of observation.state; None without a joint log."""
        return self.logs.get(layout.STATE)

    @cached_property
    def logs(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the dimensions of each log of numbers."""
        return {
            name: dimension_names(name, feature)
            for name, feature in self._meta.features.items()
            if is_log(name, feature)
        }

    @property
    def has_predictions(self) -> bool:
        """A data set stores no predictions."""
        return False

    def findings(self) -> Findings:
        """Return what shows without decoding a picture; the logs are read for it once."""
        return self._findings

    @cached_property
    def _findings(self) -> Findings:
        return look_at(self._meta, self.episodes)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what is unusual but harms no demonstration."""
        return tuple(self._findings.notes)

    def problems(self) -> list[str]:
        """Return a sentence for each damage that shows without decoding a picture."""
        return list(dict.fromkeys(problem.text for problem in self._findings.problems))

    def entries(self, indexes: Sequence[int]) -> list[str]:
        """Return the episode indexes as text."""
        return [str(index) for index in indexes]

    def usage(self, indexes: Sequence[int], *, keep: bool) -> list[str]:
        """Return lines for LeRobot, robomimic and Minari."""
        return lerobot_usage(self.root, indexes, keep=keep)

    def content_hash(self) -> str:
        """Hash of all a filter sees: frames, logs, sub-task labels, fps and cameras.

        What says whether a demonstration is correct (sequence, correct, mistakes, success,
        reward) stays out, as do file names. It is computed from the files, not looked up.

        Raises:
            PoolError: A file is missing or damaged.
        """
        content = hashlib.sha256()
        described = [float(self.fps), self.cameras, self.subtasks]
        content.update(json.dumps(described).encode())
        for episode in self.episodes:
            spans = [(span.subtask, span.start, span.stop) for span in episode.spans()]
            pictures = [episode.clip(camera).digest() for camera in self.cameras]
            labelled = [episode.index, episode.length, episode.content_id(), pictures, spans]
            content.update(json.dumps(labelled).encode())
        return content.hexdigest()
