"""Pools made by the verb `generate`: policies never import the simulator."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from teasim.common.workers import Workers
from teasim.pool import Pool

COUNTS = ("seq1", "seq2", "seq3", "legal")
"""Options of `teasim generate` that ask for demonstrations; `mistakes` does too."""


def generate_pool(path: Path, options: Mapping[str, Any], workers: Workers) -> Pool:
    """Generate a pool in the folder `path`, or go on with an unfinished one of the same options.

    A finished pool is returned as it is, so the folder should be named by the options.

    Args:
        path: folder of the pool.
        options: names and values of options of `teasim generate`, `_` for `-`; a list is an option
            given several times, except for `mistakes`, whose words follow it.
        workers: where the work runs.

    Raises:
        TeasimError: the verb failed, in its own sentence.
    """
    if (path / "meta" / "info.json").is_file():  # written last
        return Pool.open(path)
    (verb,) = entry_points(group="teasim.verbs", name="generate")
    given = dict(options) | asdict(workers)
    verb.load()([str(path), *(word for item in given.items() for word in _words(*item))])
    return Pool.open(path)


def demo_count(options: Mapping[str, Any]) -> int:
    """Return how many demonstrations these options ask for."""
    # Without a number, `teasim generate` makes ten of Seq_1.
    usual = {"seq1": 10}
    told = sum(int(options.get(name, usual.get(name, 0))) for name in COUNTS)
    return told + sum(
        int(word.partition(":")[2] or 1) for word in map(str, options.get("mistakes", ()))
    )


def _words(name: str, value: Any) -> Iterator[str]:
    """Yield the words of an option on the command line; none for None."""
    option = f"--{name.replace('_', '-')}"
    if value is None:
        return
    if isinstance(value, bool):
        yield option if value else option.replace("--", "--no-", 1)
    elif isinstance(value, list | tuple) and name in ("mistakes", "optional"):
        yield from (option, *map(str, value))
    elif isinstance(value, list | tuple):
        yield from (word for part in value for word in (option, str(part)))
    else:
        yield f"{option}={value}"
