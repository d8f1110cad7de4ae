"""Damage to a data set, drawn at random, and all that a verb reads of one before it works."""

import json
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from hypothesis import strategies as st

from teasim.common.errors import TeasimError
from teasim.pool.readers.registry import check_source, open_source
from teasim.pool.source import Demonstration, Source
from tests.pool.lerobot_sets import Recipe, make_set

LONGEST = 5.0
"""No damage may keep a reader busy longer [s of processor time]."""
ODD: tuple[Any, ...] = (
    *(None, True, -1, 0, 1, 7, 2**31, 2**63, 10**40, 0.5, -0.0, 1e300, float("nan"), float("inf")),
    *("", "x", "../x", "/", "\0", "{0}", "{episode_index:999999999}", "é" * 300, "v3.0", "v2.1"),
    *([], [1], [[]], ["a", 2], {}, {"a": 1}, {"dtype": "video", "shape": [-1]}),
)
"""Values that stand where others should."""

Damage = Callable[[Path], None]


def make_sets(folder: Path) -> list[Path]:
    """Small valid sets of the versions that are read."""
    recipes = [
        Recipe(labels="numbers"),
        Recipe(labels="sparse", shared=False, lengths=(4, 5)),
        Recipe("v2.1"),
        Recipe(kind="image", labels="sentences", lengths=(4, 5)),
    ]
    return [make_set(folder / str(number), recipe) for number, recipe in enumerate(recipes)]


@st.composite
def damages(draw: st.DrawFn) -> Damage:
    """Draw one damage to one file: its bytes, a value in it, or its place."""
    share = draw(st.floats(0, 1, exclude_max=True))
    change = draw(st.sampled_from((_bytes, _value, _value, _value, _place)))(draw)

    def damage(root: Path) -> None:
        files = [path for path in sorted(root.rglob("*")) if path.is_file()]
        change(files[int(share * len(files))])

    return damage


def _bytes(draw: st.DrawFn) -> Damage:
    share, flips = draw(st.floats(0, 1, exclude_max=True)), draw(st.binary(max_size=8))

    def damage(path: Path) -> None:
        content = path.read_bytes()
        start = int(share * len(content))
        end = content[start + len(flips) :] if flips else b""
        path.write_bytes(content[:start] + flips + end)

    return damage


def _place(draw: st.DrawFn) -> Damage:
    kind = draw(st.sampled_from(("gone", "empty", "folder", "loop")))

    def damage(path: Path) -> None:
        path.unlink()
        if kind == "empty":
            path.write_bytes(b"")
        if kind == "folder":
            path.mkdir()
        if kind == "loop":
            path.symlink_to(path)

    return damage


def _value(draw: st.DrawFn) -> Damage:
    share, value = draw(st.floats(0, 1, exclude_max=True)), draw(st.sampled_from(ODD))
    whole = draw(st.booleans())

    def damage(path: Path) -> None:
        if path.suffix == ".parquet":
            table = pq.read_table(path)
            # Not every value fits a column; that one is no damage then.
            with suppress(pa.ArrowException, OverflowError, TypeError, ValueError):
                pq.write_table(_with_value(table, share, value, whole=whole), path)
        elif path.suffix in (".json", ".jsonl"):
            documents = [json.loads(line) for line in path.read_text().splitlines()]
            places = [place for document in documents for place in _places(document)]
            holder, key = places[int(share * len(places))]
            holder[key] = value
            path.write_text("".join(json.dumps(document) + "\n" for document in documents))

    return damage


def _with_value(table: pa.Table, share: float, value: Any, *, whole: bool) -> pa.Table:
    """The table with one value, or a column of them, replaced; or without the column."""
    column = int(share * table.num_columns)
    name = table.column_names[column]
    if value is None and whole:
        return table.drop_columns([name])
    values = [value] * len(table) if whole else table[name].to_pylist()
    values[int(share * 7919) % len(values)] = value
    kind = None if whole else table.schema.field(name).type
    return table.set_column(column, name, pa.array(values, kind))


def _places(document: Any) -> list[tuple[Any, Any]]:
    """Every place of a JSON document: what holds it, and under which key."""
    if isinstance(document, dict):
        keys: list[Any] = list(document)
    else:
        keys = list(range(len(document))) if isinstance(document, list) else []
    inner = [place for key in keys for place in _places(document[key])]
    return [(document, key) for key in keys] + inner


def examine(root: Path) -> None:
    """Read what a verb reads; damage may raise TeasimError and nothing else, and soon."""
    began = time.process_time()
    problems = ["nothing to look at"]
    with suppress(TeasimError):
        problems = check_source(root)
        assert all(text.endswith(".") and "\n" not in text for text in problems), problems
    with suppress(TeasimError):
        _examine_source(open_source(root), sound=not problems)
    assert time.process_time() - began < LONGEST


def _examine_source(source: Source, *, sound: bool) -> None:
    """Read everything; what is called sound can be read."""
    assert not (sound and source.problems())
    assert all(isinstance(note, str) for note in source.notes)
    reads: list[Callable[[], Any]] = [lambda: source.subtasks, source.content_hash]
    for episode in source.episodes:
        reads += [
            episode.spans,
            lambda episode=episode: episode.demo_id,
            lambda episode=episode: episode.record,
            lambda episode=episode: episode.task,
            *(lambda c=c, episode=episode: _first_frames(episode, c) for c in source.cameras),
        ]
    refusals = [told for told in map(_refusal, reads) if told is not None]
    assert all(refusals)
    assert not (sound and refusals), refusals


def _refusal(read: Callable[[], Any]) -> str | None:
    try:
        read()
    except TeasimError as error:
        return str(error)
    return None


def _first_frames(episode: Demonstration, camera: str) -> None:
    frames = episode.clip(camera).frames(np.arange(min(2, episode.length)))
    assert frames.dtype == np.uint8
    assert (frames.ndim, frames.shape[-1]) == (4, 3)


def attempt(origin: Path, damage: Damage, folder: Path) -> None:
    """Examine a damaged copy of `origin`, which is made in `folder`."""
    copy = folder / "copy"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(origin, copy)
    damage(copy)
    examine(copy)
