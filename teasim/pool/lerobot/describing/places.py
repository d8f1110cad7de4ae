"""Paths that metadata spell out: filled in with numbers, and kept inside the data set."""

import re
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from string import Formatter

from teasim.common.errors import PoolError

NUMBER_FORMAT = re.compile(r"(?:0?[1-9])?d?")
"""How a template may pad a number, e.g. 03d; a width of several digits is refused."""
FOLDERS = ("data", "videos", "images", "meta")
"""Folders of a data set; its owner may have made them links to another disk."""


def filled(template: str, values: dict[str, int | str]) -> str:
    """Return a template of info.json with its names replaced by `values`.

    Raises:
        PoolError: The template asks for something else, or in a form that is none of LeRobot's.
    """
    try:
        parts = list(Formatter().parse(template))
        for _, name, form, conversion in parts:
            known = name is None or (name in values and conversion is None)
            if not known or not NUMBER_FORMAT.fullmatch(form or ""):
                raise ValueError(name)
        return template.format(**values)
    except (KeyError, IndexError, ValueError, TypeError, AttributeError) as error:
        raise PoolError(f"The path '{template}' of info.json is not readable.") from error


def inside(root: Path, relative: str, homes: Sequence[Path]) -> Path:
    """Return the path `relative` to `root`, which must not lead out of the data set.

    Links are followed where they lead into one of `homes`, see `homes_of`.

    Raises:
        PoolError: The path is absolute, has a part '..', or a link leads elsewhere.
    """
    parts = PurePosixPath(relative).parts
    plain = bool(parts) and not relative.startswith("/") and ".." not in parts
    if not plain or "\0" in relative:
        raise PoolError(f"The path '{relative}' of the metadata leads out of '{root}'.")
    path = root / relative
    try:
        real = path.resolve()
    except (OSError, RuntimeError) as error:  # a circle of links, or a name too long
        raise PoolError(f"The path '{relative}' of the metadata is not readable.") from error
    if not any(real.is_relative_to(home) for home in homes):
        raise PoolError(f"The path '{path}' is a link that leads out of the data set.")
    return path


def homes_of(root: Path) -> tuple[Path, ...]:
    """Return the folders the files of the data set in `root` may lie in.

    Beside `root` these are what its owner made links of, of `FOLDERS`, and the folder `blobs` in
    which the cache of the Hugging Face Hub keeps the content of files.

    Raises:
        PoolError: A link leads to itself.
    """
    try:
        homes = [root.resolve(), *((root / name).resolve() for name in FOLDERS)]
    except (OSError, RuntimeError) as error:
        raise PoolError(f"The links in '{root}' are not readable.") from error
    if homes[0].parent.name == "snapshots":
        homes.append(homes[0].parent.parent / "blobs")
    return tuple(homes)
