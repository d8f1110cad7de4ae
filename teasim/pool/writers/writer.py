"""What a writer is made of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from teasim.common.errors import ConfigError
from teasim.pool.writers.content import Content, Item


@dataclass(frozen=True)
class Writer:
    """One format: how a demonstration is prepared, and how all of them become one data set."""

    name: str
    """What the format is called on the command line."""
    reader: str
    """Name of the reader that opens what is written."""
    stage: Callable[[Content, Item, Path], None]
    """Writes one demonstration into an empty folder; what it writes depends on its arguments
    alone. The content comes without its demonstrations."""
    assemble: Callable[[Content, Sequence[Path], Path], Sequence[str]]
    """Makes one data set of the folders of all demonstrations, at a path where nothing is yet.
    Returns sentences on what came out otherwise than one may expect."""
    check: Callable[[Content], None] | None = None
    """Raises ConfigError if the format cannot hold the content."""
    suffixes: tuple[str, ...] = ()
    """Endings of the file that it writes; empty when it writes a folder."""
    pictures: bool = True
    """Whether the format needs pictures."""
    labels: bool = False
    """Whether the format needs sub-task labels."""
    logs: tuple[str, ...] = ()
    """Logs that the format needs."""

    def require(self, content: Content, dest: Path) -> None:
        """Refuse content that the format cannot hold, or a destination that does not fit.

        Raises:
            ConfigError: something is missing.
        """
        if self.suffixes and dest.suffix not in self.suffixes:
            raise ConfigError(
                f"'{dest}' must end in {' or '.join(self.suffixes)}: {self.name} is one file."
            )
        if self.pictures and not content.cameras:
            raise ConfigError(f"'{content.root}' has no pictures, which {self.name} needs.")
        for log in self.logs:
            if log not in content.logs:
                known = ", ".join(content.logs) or "none"
                raise ConfigError(
                    f"'{content.root}' has no log '{log}', which {self.name} needs; its logs: "
                    f"{known}."
                )
        if self.labels and not content.subtasks:
            raise ConfigError(
                f"'{content.root}' has no sub-task labels, which {self.name} needs; find some with "
                "teasim filter and add --segments FILE."
            )
        if self.check is not None:
            self.check(content)
