"""Some demonstrations of a pool as a source of their own."""

from collections.abc import Sequence
from typing import Any

from teasim.pool.source import Demonstration, Source


class Part:
    """A source with some demonstrations of another one, which is taken to be sound."""

    def __init__(self, whole: Source, episodes: Sequence[Demonstration]) -> None:
        """Keep both."""
        self._whole, self.episodes = whole, list(episodes)

    def problems(self) -> list[str]:
        """Return none: the whole was checked when it was opened."""
        return []

    def __getattr__(self, name: str) -> Any:
        """Answer like the whole."""
        return getattr(self._whole, name)
