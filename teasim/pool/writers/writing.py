"""Writing a data set so that it is complete or not there, and so that it can be continued.

Next to the destination stands a hidden folder with one folder per finished demonstration. When all
are finished the data set is assembled in it and renamed. Whatever stops the work, the same command
continues it, and the result is the same to the byte.
"""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from teasim.common import parallel
from teasim.common.errors import ConfigError, TeasimError
from teasim.common.files import check_new_folder, sync, write_text
from teasim.common.lock import locked
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool.source import Source
from teasim.pool.writers.content import Content, Item
from teasim.pool.writers.writer import Writer

PLAN, ASSEMBLED = "plan", "assembled"
"""Files of the hidden folder: what is being written; that all of it is there."""


def write(
    writer: Writer, source: Source, content: Content, dest: Path, *, workers: Workers = IN_PROCESS
) -> tuple[str, ...]:
    """Write `content` of `source` to `dest`; an unfinished one of the same content is continued.

    Args:
        writer: the format.
        source: where the content is from; it is not modified.
        content: what is written.
        dest: a path where nothing is, or an empty folder.
        workers: where the work runs; the result does not depend on it.

    Returns:
        Sentences on what came out otherwise than one may expect.

    Raises:
        ConfigError: the format cannot hold the content, or `dest` is in use.
        PoolError: the source is damaged.
        TeasimError: `dest` cannot be written, e.g. because the disk is full.
    """
    writer.require(content, dest)
    _check_place(source.root, dest)
    with _refusal(dest, len(content.items)):
        dest.parent.mkdir(parents=True, exist_ok=True)
        with locked(dest):
            notes = _write(writer, content, dest, content.fingerprint(source), workers)
    return notes


def staging_of(dest: Path) -> Path:
    """Return the hidden folder in which `dest` is prepared."""
    return dest.with_name(f".{dest.name}.incomplete")


def kept(dest: Path) -> int:
    """Return how many demonstrations of an unfinished data set are finished."""
    return sum(path.name.isdecimal() for path in staging_of(dest).glob("*"))


def _write(
    writer: Writer, content: Content, dest: Path, plan: str, workers: Workers
) -> tuple[str, ...]:
    staging = staging_of(dest)
    told = f"{writer.name} {plan}\n"
    if (staging / ASSEMBLED).exists() and dest.exists() and _plan_of(staging) == told:
        told_before = (staging / ASSEMBLED).read_text(encoding="utf-8").splitlines()
        shutil.rmtree(staging)
        return tuple(told_before)
    check_new_folder(dest)
    _claim(staging, told)
    stage = partial(_stage, writer, content.common(), staging)
    parallel.run(stage, content.items, workers=workers, description="demonstrations")
    whole = staging / f"whole{dest.suffix if writer.suffixes else ''}"
    _remove(whole)
    folders = [_folder(staging, item) for item in content.items]
    notes = tuple(writer.assemble(content, folders, whole))
    for path in (*whole.rglob("*"), whole):
        sync(path)
    write_text(staging / ASSEMBLED, "".join(note + "\n" for note in notes))
    if dest.is_dir():
        dest.rmdir()
    whole.rename(dest)
    sync(dest.parent)
    shutil.rmtree(staging)
    return notes


def _stage(writer: Writer, common: Content, staging: Path, item: Item) -> None:
    """Write one demonstration unless it is finished already."""
    target = _folder(staging, item)
    if target.is_dir():
        return
    building = target.with_name(f"{target.name}.{os.getpid()}.tmp")
    shutil.rmtree(building, ignore_errors=True)
    building.mkdir()
    try:
        writer.stage(common, item, building)
        for path in building.rglob("*"):
            sync(path)
        if not target.is_dir():
            building.rename(target)
            sync(staging)
    finally:
        shutil.rmtree(building, ignore_errors=True)


def _folder(staging: Path, item: Item) -> Path:
    return staging / f"{item.number:06d}"


def _check_place(source: Path, dest: Path) -> None:
    if dest.resolve().is_relative_to(source.resolve()):
        raise ConfigError(
            f"'{dest}' lies in the source '{source}', which is never modified; choose another "
            "place."
        )


def _claim(staging: Path, told: str) -> None:
    """Make the hidden folder, or continue the one that is there, without unfinished parts."""
    if staging.exists() and _plan_of(staging) not in (told, None):
        raise ConfigError(
            f"'{staging}' holds an unfinished data set of other content; remove it, or choose "
            "another destination."
        )
    staging.mkdir(exist_ok=True)
    for path in staging.glob("*.tmp"):
        _remove(path)
    write_text(staging / PLAN, told)


def _plan_of(staging: Path) -> str | None:
    try:
        return (staging / PLAN).read_text(encoding="utf-8")
    except FileNotFoundError:
        return None


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


@contextmanager
def _refusal(dest: Path, n_items: int) -> Iterator[None]:
    """Turn what the disk refuses into one sentence that says what is kept."""
    try:
        yield
    except OSError as error:
        done = kept(dest)
        reason = error.strerror or str(error)
        state = (
            f"; {done} of {n_items} demonstrations are kept in '{staging_of(dest)}', and the same "
            "command continues"
        )
        raise TeasimError(
            f"'{dest}' cannot be written: {reason}{state if done else ''}."
        ) from error
