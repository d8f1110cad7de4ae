"""Units of work whose results are stored by the hash of all that decides them.

A unit that is killed leaves no result and is done again; one that has a result is never done twice.
What a unit needs is part of its hash, so a result can never belong to other input.
"""

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from teasim.common import parallel
from teasim.common.files import write_json
from teasim.common.workers import IN_PROCESS, Workers

FORMAT = 2
"""Number of the form of stored results and of the methods; a change makes all earlier ones count as
absent."""
RECORDED = ("teasim", "mujoco", "torch", "numpy", "scipy", "scikit-learn")
"""Packages whose versions stand in every result."""


@dataclass(frozen=True)
class Unit:
    """A piece of work."""

    kind: str
    """Name of the work in the registry of its experiment."""
    spec: Mapping[str, Any]
    """All that decides the result beside what it needs; JSON-able, with every seed."""
    needs: Mapping[str, "Unit"] = field(default_factory=dict)
    """Units that have to be done before, by the name under which the work asks for them."""
    seconds: float = 0.0
    """Estimated time of one idle core [s]; it decides nothing."""
    wide: bool = False
    """Whether the unit spreads over the workers by itself."""

    @property
    def key(self) -> str:
        """Hash of the kind, the spec and the needs, 16 hexadecimal digits."""
        keys = {name: unit.key for name, unit in self.needs.items()}
        told = json.dumps([FORMAT, self.kind, self.spec, keys], sort_keys=True)
        return hashlib.sha256(told.encode()).hexdigest()[:16]

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.kind}-{self.key}"


Result = dict[str, Any]
"""What a unit found, JSON-able."""
Work = Callable[[Unit, "Store", Workers], Result]
"""Does a unit; it may keep files in `Store.folder_of(unit)`."""


@dataclass(frozen=True)
class Store:
    """A folder of results."""

    root: Path
    """The folder."""
    command: str = ""
    """Command line that results are made by, recorded with them."""

    def path(self, unit: Unit) -> Path:
        """Return the file of a result."""
        return self.root / "units" / f"{unit.name}.json"

    def folder_of(self, unit: Unit) -> Path:
        """Return where a unit may keep files of its own."""
        return self.root / "files" / unit.name

    def has(self, unit: Unit) -> bool:
        """Tell whether the unit is done; a damaged file counts as absent."""
        try:
            json.loads(self.path(unit).read_text())
        except (OSError, ValueError):
            return False
        return True

    def read(self, unit: Unit) -> Result:
        """Return the result of a unit that is done."""
        found: Result = json.loads(self.path(unit).read_text())["result"]
        return found

    def write(self, unit: Unit, result: Result, seconds: float) -> None:
        """Keep a result with the command, spec, seeds and versions that made it."""
        record = {
            "kind": unit.kind,
            "spec": unit.spec,
            "needs": {name: needed.name for name, needed in unit.needs.items()},
            "command": self.command,
            "versions": versions(),
            "seconds": round(seconds, 3),
            "result": result,
        }
        write_json(self.path(unit), record)


def versions() -> dict[str, str]:
    """Return the versions of the packages that results depend on."""
    return {name: version(name) for name in RECORDED}


def missing(units: Iterable[Unit], store: Store) -> list[Unit]:
    """Return the units that have no result, and what they need that has none, in order."""
    found: dict[str, Unit] = {}

    def add(unit: Unit) -> None:
        if unit.key in found or store.has(unit):
            return
        for needed in unit.needs.values():
            add(needed)
        found[unit.key] = unit

    for unit in units:
        add(unit)
    return list(found.values())


def do_units(
    units: Iterable[Unit], store: Store, works: Mapping[str, Work], *, workers: Workers
) -> None:
    """Do all units that have no result; what is ready at the same time runs in parallel.

    Raises:
        TeasimError: the work of a unit failed, in its own sentence; results so far are kept.
    """
    left = missing(units, store)
    while left:
        waiting = {unit.key for unit in left}
        ready = [u for u in left if not waiting & {n.key for n in u.needs.values()}]
        for unit in ready:
            if unit.wide:
                do_one(unit, store=store, works=works, workers=workers)
        narrow = [unit for unit in ready if not unit.wide]
        one = partial(do_one, store=store, works=works, workers=IN_PROCESS)
        parallel.run(one, narrow, workers=workers, description=_kinds(narrow))
        left = [unit for unit in left if unit.key not in {u.key for u in ready}]


def do_one(unit: Unit, *, store: Store, works: Mapping[str, Work], workers: Workers) -> None:
    """Do a unit and keep its result."""
    began = time.perf_counter()
    result = works[unit.kind](unit, store, workers)
    store.write(unit, result, time.perf_counter() - began)


def _kinds(units: Sequence[Unit]) -> str:
    return ", ".join(dict.fromkeys(unit.kind for unit in units))
