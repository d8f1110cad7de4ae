"""What a reader is made of."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

from teasim.common.errors import ConfigError
from teasim.pool.source import Source


@dataclass(frozen=True)
class ReadOptions:
    """What a user may have to say about a source because its format does not."""

    fps: float | None = None
    """Frames per second of a source that does not store it [1/s]; None means not said."""
    mask: str | None = None
    """Read only the demonstrations of this mask of a robomimic file, e.g. train; None means all."""
    background_label: tuple[str, ...] = ()
    """Further labels of frames that belong to no sub-task of an MS-TCN folder, beside background,
    SIL, action_start and action_end."""

    def given(self) -> tuple[str, ...]:
        """Return the names of the fields that differ from their defaults."""
        return tuple(f.name for f in fields(self) if getattr(self, f.name) != f.default)

    def __post_init__(self) -> None:
        """Refuse options out of range.

        Raises:
            ConfigError: `fps` is not above 0.
        """
        if self.fps is not None and not self.fps > 0:
            raise ConfigError(f"fps is {self.fps}; choose a number above 0.")


@dataclass(frozen=True)
class Reader:
    """One format: how it is recognised and how it is opened."""

    name: str
    """What the format is called in messages and help texts."""
    recognises: Callable[[Path], bool]
    """Whether a path holds this format, be it a damaged one; it reads no more than it has to."""
    open: Callable[[Path, ReadOptions], Source]
    """Opens the path; raises PoolError when it is damaged and ConfigError for a wrong option."""
    check: Callable[[Path], list[str]] | None = None
    """Looks for damage in all of it, pictures included, and returns a sentence for each; raises
    PoolError when there is nothing to look at. None: its files have no pictures to decode, and
    what `Source.problems` tells is all."""
    options: tuple[str, ...] = ("fps",)
    """Fields of `ReadOptions` that `open` looks at; any other one that is given is refused."""
    find: Callable[[str], Path | None] | None = None
    """Returns where the data set of a name that is no path is stored; None where there is none."""
