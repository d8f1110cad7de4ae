"""A source whose sub-tasks are those of a table, in place of logged ones."""

from collections.abc import Mapping, Sequence
from typing import Any

from teasim.common.errors import PoolError
from teasim.pool.segments_table import SegmentRow, spans_by_demonstration
from teasim.pool.source import Demonstration, Source
from teasim.pool.types import Span
from teasim.pool.views.part import Part


class SegmentedDemonstration:
    """A demonstration with other sub-task spans; all else is as it was."""

    def __init__(self, demo: Demonstration, spans: tuple[Span, ...]) -> None:
        """Keep both."""
        self._demo, self._spans = demo, spans

    def spans(self) -> tuple[Span, ...]:
        """Return the spans of the table."""
        return self._spans

    def __getattr__(self, name: str) -> Any:
        """Answer like the demonstration."""
        if name.startswith("_"):  # asked for while it is unpickled
            raise AttributeError(name)
        return getattr(self._demo, name)


class Segmented(Part):
    """A source with the sub-tasks of a table."""

    def __init__(
        self, whole: Source, rows: Sequence[SegmentRow], names: Mapping[str, str] | None = None
    ) -> None:
        """Give every demonstration the spans of the table, and none where it knows none.

        Args:
            whole: the source.
            rows: the table.
            names: new names of sub-tasks by their names in the table; others keep theirs.

        Raises:
            PoolError: the table belongs to another source.
        """
        named = names or {}
        found = spans_by_demonstration(rows, whole.episodes)
        if not any(found):
            raise PoolError(
                f"The table of segments knows no demonstration of '{whole.root}'; filter it again."
            )
        spans = [
            tuple(Span(named.get(s.subtask, s.subtask), s.start, s.stop) for s in own or ())
            for own in found
        ]
        episodes = [
            SegmentedDemonstration(demo, own)
            for demo, own in zip(whole.episodes, spans, strict=True)
        ]
        super().__init__(whole, episodes)
        self.subtasks = tuple(dict.fromkeys(named.get(r.subtask, r.subtask) for r in rows))
