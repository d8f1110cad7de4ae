"""Paths that metadata spell out: filled in with numbers, and kept inside the data set."""

import re
from functools import lru_cache
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


def inside(root: Path, relative: str) -> Path:
    """Return the path `relative` to `root`, which must not lead out of the data set.

    Links are followed where they stay inside, where the owner made a link of one of `FOLDERS`, and
    in the cache of the Hugging Face Hub, which keeps the content of files in a folder `blobs`.

    Raises:
        PoolError: The path is absolute, has a part '..', or a link leads elsewhere.
    """
    parts = PurePosixPath(relative).parts
    plain = bool(parts) and not relative.startswith("/") and ".." not in parts
    if not plain or "\0" in relative:
        raise PoolError(f"The path '{relative}' of the metadata leads out of '{root}'.")
    path = root / relative
    try:
        real, homes = path.resolve(), _homes(root)
    except (OSError, RuntimeError) as error:  # a circle of links, or a name too long
        raise PoolError(f"The path '{relative}' of the metadata is not readable.") from error
    if not any(real.is_relative_to(home) for home in homes):
        raise PoolError(f"The path '{path}' is a link that leads out of the data set.")
    return path


@lru_cache(maxsize=64)
def _homes(root: Path) -> list[Path]:
    """Folders the files of a data set may lie in."""
    homes = [root.resolve(), *((root / name).resolve() for name in FOLDERS)]
    if root.resolve().parent.name == "snapshots":
        homes.append(root.resolve().parent.parent / "blobs")
    return homes
