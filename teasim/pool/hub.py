"""Data sets of the Hugging Face Hub by their name: where their local copies are.

Nothing is fetched. LeRobot keeps its copies in $HF_LEROBOT_HOME/ORGANISATION/NAME, the Hub's own
client in $HF_HUB_CACHE/datasets--ORGANISATION--NAME/snapshots/REVISION.
"""

import os
import re
from pathlib import Path

REPOSITORY = re.compile(r"[A-Za-z0-9][\w\-.]*/[A-Za-z0-9][\w\-.]*")
"""A name on the Hub: organisation and data set."""


def located(path: Path | str) -> Path:
    """Return `path` if something is there, or where the local copy of that name is, or `path`."""
    place = Path(path)
    return place if place.exists() else copy_of(str(path)) or place


def copy_of(name: str) -> Path | None:
    """Return where the local copy of a data set is; None if there is none."""
    if not is_repository(name):
        return None
    return next((copy for copy in _copies(name) if copy.is_dir()), None)


def is_repository(path: Path | str) -> bool:
    """Whether `path` has the form of a name on the Hub."""
    return REPOSITORY.fullmatch(str(path)) is not None and ".." not in str(path)


def missing(path: Path) -> str:
    """Return what is said when there is nothing at `path`."""
    told = f"There is nothing at '{path}'; name a folder with demonstrations."
    if not is_repository(path):
        return told
    return (
        f"There is nothing at '{path}', and no data set of that name in the local cache of the "
        f"Hugging Face Hub; fetch it with: hf download {path} --repo-type dataset "
        f"--local-dir {path.name}"
    )


def _copies(name: str) -> list[Path]:
    """Where a copy may be, the most likely first."""
    home = _folder("HF_HOME", Path("~/.cache/huggingface"))
    lerobot = _folder("HF_LEROBOT_HOME", home / "lerobot")
    hub = _folder("HF_HUB_CACHE", home / "hub")
    folder = "datasets--" + name.replace("/", "--")
    return [
        lerobot / name,
        home / "lerobot" / name,
        *(copy for root in (hub, lerobot / "hub") for copy in _snapshots(root / folder)),
    ]


def _folder(variable: str, otherwise: Path) -> Path:
    return Path(os.environ.get(variable) or otherwise).expanduser()


def _snapshots(folder: Path) -> list[Path]:
    """Copies of the revisions, that of the branch main first, then the newest."""
    try:
        copies = sorted((folder / "snapshots").iterdir(), key=lambda p: -p.stat().st_mtime_ns)
    except OSError:
        return []
    try:
        main = (folder / "refs" / "main").read_text(encoding="utf-8").strip()
    except (OSError, ValueError):
        main = ""
    return sorted(copies, key=lambda copy: copy.name != main)
