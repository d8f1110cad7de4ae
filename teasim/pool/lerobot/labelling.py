"""How a whole data set labels its sub-tasks, and what they are called."""

from collections.abc import Iterator
from contextlib import suppress
from functools import cached_property
from typing import Self

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import read_column, whole_numbers
from teasim.pool.lerobot.describing.metadata import Metadata
from teasim.pool.lerobot.describing.names import MOST_NAMES, in_order, names_by_number
from teasim.pool.lerobot.labels import annotated_kind, annotated_names, said
from teasim.pool.lerobot.log import rows_of


class Labelling:
    """The form of the sub-task labels of a data set; logs are read when a name is asked for."""

    def __init__(self, meta: Metadata) -> None:
        """Look at the metadata of a data set."""
        self._meta = meta

    def told_to(self, meta: Metadata) -> Self:
        """Return the labelling of a part of the data set, which is called as in the whole of it."""
        copy = type(self)(meta)
        with suppress(PoolError):  # damaged labels are told where they are read
            found = {"kind": self.kind, "is_said": self.is_said, "names": self.names}
            copy.__dict__.update(found)
        return copy

    @cached_property
    def kind(self) -> str | None:
        """Which columns of the episodes table hold spans, sparse or dense; None without any."""
        return annotated_kind(self._meta.episodes.others)

    @cached_property
    def is_said(self) -> bool:
        """Whether sentences of `language_persistent` begin sub-tasks."""
        return bool(self._said_names)

    @property
    def is_numbered(self) -> bool:
        """Whether each frame has the number of its sub-task."""
        return layout.SUBTASK_INDEX in self._meta.features

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the sub-tasks in the order of their numbers; empty without labels.

        From the manifest, else from subtasks.parquet, else from what labels the demonstrations.
        Numbers without a list of names, which other tools drop, become 'subtask NUMBER'.

        Raises:
            PoolError: The labels are damaged.
        """
        if self._meta.manifest.get("subtasks"):
            return self.listed
        used = self._annotated_names or self._said_names
        if self.listed and set(used) <= set(self.listed):
            return self.listed
        if used or not self.is_numbered:
            return used
        return in_order({}, "subtask", self._highest_number() + 1)

    @cached_property
    def listed(self) -> tuple[str, ...]:
        """The list of names in the manifest, else in subtasks.parquet; empty without one.

        Raises:
            PoolError: The list is damaged.
        """
        logged = tuple(map(str, self._meta.manifest.get("subtasks", ())))
        path = self._meta.root / layout.SUBTASKS
        return logged or in_order(names_by_number(path, layout.SUBTASK_INDEX), "subtask")

    @property
    def _annotated_names(self) -> tuple[str, ...]:
        return () if self.kind is None else annotated_names(self._meta.episodes.others, self.kind)

    @cached_property
    def _said_names(self) -> tuple[str, ...]:
        if layout.LANGUAGE not in self._meta.features:
            return ()
        names: dict[str, None] = {}
        for place in range(len(self._meta.episodes)):
            row = self._meta.episodes.row(place)
            path = self._meta.data_path(row)
            rows = rows_of(path, row["episode_index"])
            told = said(rows.select(read_column(path, layout.LANGUAGE))) if len(rows) else ()
            names |= dict.fromkeys(name for _, name in told)
        return tuple(names)

    def _highest_number(self) -> int:
        highest = max((int(n.max(initial=-1)) for n in self._numbers()), default=-1)
        if highest >= MOST_NAMES:
            raise PoolError(f"The log of '{self._meta.root}' has the sub-task number {highest}.")
        return highest

    def _numbers(self) -> Iterator[np.ndarray]:
        rows = map(self._meta.episodes.row, range(len(self._meta.episodes)))
        for path in dict.fromkeys(map(self._meta.data_path, rows)):
            yield whole_numbers(read_column(path, layout.SUBTASK_INDEX), layout.SUBTASK_INDEX)
