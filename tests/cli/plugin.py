"""A package of somebody else's, installed into a folder, that adds verbs to `teasim`."""

import sys
from pathlib import Path

import pytest

MODULE = "somebody_elses_verbs"

SOURCE = '''
"""Verbs that go right and wrong in every way the dispatcher knows."""

import sys

from teasim.common.cli import resumable
from teasim.common.errors import Interrupted, PoolError


def echo(arguments):
    """Print the arguments, in brackets.

    The dispatcher does not show this line.
    """
    print(arguments)


def seven(arguments):
    """Return 7."""
    return 7


def bad_pool(arguments):
    """Complain about a pool."""
    raise PoolError("kitchen: no meta/info.json;\\n   name the folder of a pool.")


def bug(arguments):
    """Meet a bug."""
    return [][0]


def missing_file(arguments):
    """Open a file that is not there."""
    open("no/such/file.csv")


def interrupted(arguments):
    """Be interrupted from the keyboard."""
    raise KeyboardInterrupt


@resumable
def interrupted_halfway(arguments):
    """Be interrupted when half of the work is kept."""
    raise KeyboardInterrupt


def interrupted_with_words(arguments):
    """Be interrupted and know what is kept."""
    raise Interrupted("Interrupted; 3 of 7 runs are kept in 'out'.")


def leave(arguments):
    """Leave as an argument parser does."""
    sys.exit(int(arguments[0]) if arguments else None)


def leave_with_words(arguments):
    """Leave with a sentence."""
    sys.exit("these words")
'''

VERBS = {
    "echo": "echo",
    "seven": "seven",
    "bad-pool": "bad_pool",
    "bug": "bug",
    "missing-file": "missing_file",
    "interrupted": "interrupted",
    "halfway": "interrupted_halfway",
    "stop-with-words": "interrupted_with_words",
    "leave": "leave",
    "leave-with-words": "leave_with_words",
}


def install(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Put the package into `folder`, as a package manager would, and `folder` on the path."""
    (folder / f"{MODULE}.py").write_text(SOURCE)
    metadata = folder / f"{MODULE}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {MODULE}\nVersion: 1.0\n")
    points = [f"{verb} = {MODULE}:{function}" for verb, function in VERBS.items()]
    points.append("broken = a_module_that_is_not_there:verb")
    (metadata / "entry_points.txt").write_text("\n".join(["[teasim.verbs]", *points]))
    patch.syspath_prepend(str(folder))
    patch.delitem(sys.modules, MODULE, raising=False)
