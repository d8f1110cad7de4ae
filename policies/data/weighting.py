"""Weights of demonstrations: read from a table, and applied to the rows a learner is given.

Every learner obeys: weight 0 equals the demonstration removed, weight 2 equals it twice.
"""

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Protocol, Self, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray

from policies.data.samples import DecisionSamples
from teasim.common.errors import ConfigError
from teasim.pool import Pool
from teasim.pool.weight_table import WeightRow, match_rows, read_weight_table

USES = ("discard", "weight", "ignore")
"""How a weight table is used: `discard` leaves out flagged demonstrations, `weight` takes each at
its weight, `ignore` takes all."""


def demo_weights(pool: Pool, table: Path | None, use: str) -> NDArray[np.float64]:
    """Weight of every demonstration of `pool`, (D,); ones without a table.

    Rows are matched by `demo_id`, so a table still fits a pool whose episodes were renumbered.

    Raises:
        ConfigError: `use` is unknown or needs a table, the table belongs to another pool, or it
            leaves no demonstration.
        PoolError: the table cannot be read.
    """
    if use not in USES:
        raise ConfigError(f"Unknown use '{use}' of weights; choose {', '.join(USES)}.")
    if table is None and use != "ignore":
        raise ConfigError(f"Use '{use}' needs a weight table; give one with --weights.")
    if table is None:
        return np.ones(len(pool.episodes))
    rows = matched_rows(pool, table)
    weights = np.array([_weight(row, use) for row in rows])
    if not weights.any():
        raise ConfigError(
            f"With use '{use}' the weight table '{table}' leaves no demonstration to learn from; "
            f"choose another use ({', '.join(USES)})."
        )
    return weights


def likely_experts(pool: Pool, table: Path) -> tuple[int, ...]:
    """Places in `pool` of the quarter of its demonstrations (at least one) of largest weight.

    Ties are broken by the smaller loss; flagged demonstrations come last.

    Raises:
        ConfigError: the table belongs to another pool.
        PoolError: the table cannot be read.
    """
    rows = matched_rows(pool, table)
    order = sorted(range(len(rows)), key=lambda place: _rank(rows[place]))
    return tuple(sorted(order[: max(1, len(rows) // 4)]))


def _rank(row: WeightRow) -> tuple[bool, float, float]:
    return row.flagged, -row.weight, row.loss


def matched_rows(pool: Pool, table: Path) -> list[WeightRow]:
    """Return the rows of `table` in the order of the demonstrations of `pool`.

    Raises:
        ConfigError: the table belongs to another pool, or lacks a demonstration.
        PoolError: the table cannot be read.
    """
    rows = match_rows(read_weight_table(table), [episode.demo_id for episode in pool.episodes])
    missing = [e for e, row in zip(pool.episodes, rows, strict=True) if row is None]
    if len(missing) == len(pool.episodes):
        raise ConfigError(
            f"The weight table '{table}' is for another pool: "
            f"it has no demonstration of '{pool.root}'."
        )
    if missing:
        raise ConfigError(
            f"The weight table '{table}' lacks {len(missing)} of the {len(pool.episodes)} "
            f"demonstrations of '{pool.root}', the first is episode {missing[0].index}."
        )
    return [row for row in rows if row is not None]


def _weight(row: WeightRow, use: str) -> float:
    if use == "discard":
        return 0.0 if row.flagged else 1.0
    return float(row.weight) if use == "weight" else 1.0


class Samples(Protocol):
    """Rows that a learner is given, each from a demonstration."""

    @property
    def demos(self) -> NDArray[np.int64]:
        """Position in the pool of each row's demonstration, (n,)."""

    def take(self, rows: NDArray[np.bool_]) -> Self:
        """Return the rows where `rows` (n,) is true."""


AnySamples = TypeVar("AnySamples", bound=Samples)


def weigh(
    samples: AnySamples, weights: NDArray[np.float64]
) -> tuple[AnySamples, NDArray[np.float64]]:
    """Return the rows of positive weight, and each row's share of the total weight, (n,), sum 1.

    Args:
        samples: decisions or control steps of a pool of D demonstrations.
        weights: weight per demonstration, (D,), not negative.

    Raises:
        ConfigError: a weight is missing, negative or not finite, or none is positive.
    """
    if len(samples.demos) and samples.demos.max() >= len(weights):
        raise ConfigError(
            f"{len(weights)} weights do not cover demonstration {samples.demos.max()} of the pool."
        )
    if not np.isfinite(weights).all() or (weights < 0).any():
        raise ConfigError("A demonstration weight is negative or not a number.")
    each = weights[samples.demos]
    if not each.any():
        raise ConfigError("Every demonstration has weight 0, so there is nothing to learn from.")
    counts = each > 0
    return samples.take(counts), each[counts] / each.sum()


def distinct(
    samples: DecisionSamples, shares: NDArray[np.float64], marked: tuple[int, ...] = ()
) -> tuple[DecisionSamples, NDArray[np.float64], NDArray[np.bool_]]:
    """Return the demonstrations in an order that depends on their content alone, equal ones merged.

    What is drawn from the result does not depend on the order of the pool, nor on whether a
    demonstration occurs twice or has twice the weight.

    Args:
        samples: n decisions.
        shares: share of the total weight of each, (n,).
        marked: demonstrations that are not merged with others.

    Returns:
        The decisions (m, ...), whose demonstrations are numbered 0, 1, ..., their shares (m,), and
        whether their demonstration is among `marked`, (m,).
    """
    found: dict[tuple[bytes, bool], list[NDArray[np.int64]]] = {}
    for demo in np.unique(samples.demos):
        rows = np.flatnonzero(samples.demos == demo)
        key = hashlib.sha256()
        for part in (samples.maps, samples.low_dim, samples.labels):
            key.update(part[rows].tobytes())
        found.setdefault((key.digest(), int(demo) in marked), []).append(rows)
    order = sorted(found)
    rows = np.concatenate([found[key][0] for key in order])
    sums = np.concatenate([np.sum([shares[same] for same in found[key]], axis=0) for key in order])
    lengths = [len(found[key][0]) for key in order]
    numbered = replace(samples.take(rows), demos=np.repeat(np.arange(len(order)), lengths))
    return numbered, sums, np.repeat([mark for _, mark in order], lengths)


def weighted_loss(losses: torch.Tensor, shares: torch.Tensor) -> torch.Tensor:
    """Mean of `losses` (n,) under `shares` (n,) that sum to 1, as `weigh` returns them."""
    return (losses * shares).sum()
