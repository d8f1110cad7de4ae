"""Some demonstrations of a source as a source of their own."""

from collections.abc import Sequence
from typing import Any

from teasim.pool.source import Demonstration, Source


class Part:
    """A source with some demonstrations of another one; all else is as in the whole.

    The whole has to be sound: call `soundness.require_sound` on it first.
    """

    def __init__(self, whole: Source, episodes: Sequence[Demonstration]) -> None:
        """Keep both.

        Args:
            whole: the source.
            episodes: some of its demonstrations.
        """
        self._whole, self.episodes = whole, list(episodes)

    @property
    def has_predictions(self) -> bool:
        """Whether the whole stores predicted spans of every demonstration."""
        return self._whole.has_predictions

    def problems(self) -> list[str]:
        """Return none: the whole is sound."""
        return []

    def __getattr__(self, name: str) -> Any:
        """Answer like the whole."""
        if name.startswith("_"):  # asked for while it is unpickled
            raise AttributeError(name)
        return getattr(self._whole, name)
