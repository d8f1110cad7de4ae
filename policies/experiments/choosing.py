"""From a way to choose demonstrations to a weight table, whoever makes it.

Every choice ends in a file, `filters/POOL--NAME.csv` of the output folder, so that all are used and
scored alike, and none is made twice.
"""

import shlex
import subprocess
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from filtering.demo_filter import DemoFilter
from policies.data.weighting import demo_weights, matched_rows
from policies.experiments.detection import Judged, told_how_many
from policies.experiments.variants import CHOSEN, LABELS, LENGTH, RANDOM, FilterVariant
from teasim.common.errors import ConfigError
from teasim.common.workers import Workers
from teasim.pool import Pool
from teasim.pool.weight_table import WeightRow, read_weight_table, write_weight_table


@dataclass(frozen=True)
class Chooser:
    """A pool, and the filters of an ablation that may be run on it."""

    pool: Pool
    """The pool."""
    name: str
    """Its name in the results."""
    filters: Mapping[str, FilterVariant]
    """All filters by name."""
    out: Path
    """Output folder of the ablation."""
    home: Path
    """Folder that the files of weight tables are relative to."""
    workers: Workers
    """Where the work runs."""

    def weights(self, variant: FilterVariant) -> NDArray[np.float64]:
        """Return the weight of every demonstration, (D,).

        Raises:
            ConfigError: nothing is left to learn from, the pool lacks labels that are needed, or a
                table or command of somebody else does not serve.
        """
        table = self.table(variant)
        use = "discard" if variant.use in CHOSEN else variant.use
        return demo_weights(self.pool, table, use)

    def judged(self, variant: FilterVariant) -> Judged | None:
        """Return what a filter says beside the labels; None where either is missing."""
        table = self.table(variant)
        labels = incorrect(self.pool)
        if table is None or labels is None:
            return None
        rows = matched_rows(self.pool, table)
        told = [row.p_incorrect for row in rows]
        known = tuple(p for p in told if p is not None)
        return Judged(
            tuple(episode.demo_id for episode in self.pool.episodes),
            tuple(map(bool, labels)),
            tuple(row.flagged for row in rows),
            tuple(row.loss for row in rows),
            known if len(known) == len(told) else None,
        )

    def table(self, variant: FilterVariant) -> Path | None:
        """Return the file of the weight table, made if it is missing; None with the use ignore."""
        if variant.use == "ignore":
            return None
        path = self.out / "filters" / f"{self.name}--{variant.name}.csv"
        if not path.is_file():
            path.parent.mkdir(exist_ok=True, parents=True)
            write_weight_table(path, _maker(variant)(self, variant))
        return path

    def flags_of(self, variant: FilterVariant) -> NDArray[np.bool_]:
        """Return which demonstrations a filter flags, (D,); none with the use ignore."""
        table = self.table(variant)
        if table is None:
            return np.zeros(len(self.pool.episodes), dtype=bool)
        return np.array([row.flagged for row in matched_rows(self.pool, table)])

    def labels(self) -> NDArray[np.bool_]:
        """Return which demonstrations are labelled incorrect, (D,).

        Raises:
            ConfigError: the pool does not say.
        """
        return labels_of(self.pool)


def labels_of(pool: Pool) -> NDArray[np.bool_]:
    """Return which demonstrations of a pool are labelled incorrect, (D,).

    Raises:
        ConfigError: the pool does not say.
    """
    labels = incorrect(pool)
    if labels is None:
        raise ConfigError(
            f"'{pool.root}' does not say which demonstrations are correct; "
            "leave out what needs labels, such as a filter with use 'labels'."
        )
    return labels


def incorrect(pool: Pool) -> NDArray[np.bool_] | None:
    """Return which demonstrations of a pool are labelled incorrect, (D,); None without labels."""
    records = [episode.record for episode in pool.episodes]
    if any(record is None for record in records):
        return None
    return np.array([record is not None and not record.correct for record in records])


def by_filter(chooser: Chooser, variant: FilterVariant) -> Sequence[WeightRow]:
    """Run our filter."""
    return DemoFilter(variant.config).fit(chooser.pool, workers=chooser.workers).table()


def by_labels(chooser: Chooser, variant: FilterVariant) -> Sequence[WeightRow]:
    """Flag what is labelled incorrect."""
    del variant
    wrong = chooser.labels()
    return _rows(chooser.pool, wrong, wrong.astype(np.float64), "Labelled incorrect.")


def by_length(chooser: Chooser, variant: FilterVariant) -> Sequence[WeightRow]:
    """Flag the shortest demonstrations."""
    longest = max(episode.length for episode in chooser.pool.episodes)
    losses = np.array([float(longest - episode.length) for episode in chooser.pool.episodes])
    flagged = told_how_many(losses, _count(chooser, variant))
    return _rows(chooser.pool, flagged, losses, "One of the shortest.")


def by_chance(chooser: Chooser, variant: FilterVariant) -> Sequence[WeightRow]:
    """Flag demonstrations at random; pools of the same size get different draws."""
    rng = np.random.default_rng([variant.seed, *chooser.name.encode()])
    losses = rng.random(len(chooser.pool.episodes))
    flagged = told_how_many(losses, _count(chooser, variant))
    return _rows(chooser.pool, flagged, losses, "Drawn at random.")


def from_table(chooser: Chooser, variant: FilterVariant) -> Sequence[WeightRow]:
    """Read somebody else's weight table."""
    return read_weight_table(chooser.home / variant.table.replace("{pool}", chooser.name))


def from_command(chooser: Chooser, variant: FilterVariant) -> Sequence[WeightRow]:
    """Run somebody else's command, which writes a weight table.

    Raises:
        ConfigError: it cannot be run, fails, or writes no table.
        PoolError: what it writes is no weight table.
    """
    written = chooser.out / "filters" / f".{chooser.name}--{variant.name}.written.csv"
    written.unlink(missing_ok=True)
    places = {"{pool}": str(chooser.pool.root.resolve()), "{table}": str(written.resolve())}
    words = shlex.split(variant.command)
    for place, value in places.items():
        words = [word.replace(place, value) for word in words]
    what = f"The command '{words[0]}' of the filter '{variant.name}'"
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=chooser.home)
    except OSError as error:
        raise ConfigError(f"{what} cannot be run: {error.strerror}.") from error
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise ConfigError(f"{what} failed with code {done.returncode}: {last}")
    if not written.is_file():
        raise ConfigError(f"{what} wrote no table to {{table}}.")
    rows = read_weight_table(written)
    written.unlink()
    return rows


Maker = Callable[[Chooser, FilterVariant], Sequence[WeightRow]]
"""Makes the rows of a weight table."""
BY_USE: Mapping[str, Maker] = MappingProxyType(
    {LABELS: by_labels, RANDOM: by_chance, LENGTH: by_length}
)
"""Makers of the uses that need no filter."""


def _maker(variant: FilterVariant) -> Maker:
    if variant.table:
        return from_table
    return from_command if variant.command else BY_USE.get(variant.use, by_filter)


def _count(chooser: Chooser, variant: FilterVariant) -> int:
    """Return how many demonstrations are flagged."""
    if variant.like:
        return int(chooser.flags_of(chooser.filters[variant.like]).sum())
    return int(chooser.labels().sum())


def _rows(
    pool: Pool, flagged: NDArray[np.bool_], losses: NDArray[np.float64], reason: str
) -> list[WeightRow]:
    return [
        WeightRow(
            demo_id=episode.demo_id,
            episode_index=episode.index,
            weight=float(not flag),
            loss=float(loss),
            flagged=bool(flag),
            group=int(flag),
            reason=reason if flag else "",
        )
        for episode, flag, loss in zip(pool.episodes, flagged, losses, strict=True)
    ]
