"""The description of a pool that the network reads: columns of each demonstration, and of pairs.

Kinds of evidence that a pool lacks (reliability, effects) are masked: their columns are 0 and a
column says so.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.judging.decision.columns import Departures, departures
from filtering.judging.decision.null import above_null, null_losses
from filtering.judging.decision.observed import Observed
from filtering.judging.decision.segments import other_evidence, repetitions
from filtering.judging.decision.surroundings import Likeness, context, likeness, neighbours, whole
from filtering.judging.norm.mixture import find_populations
from filtering.judging.norm.norm_score import score_populations
from filtering.judging.norm.steps import StepCounts, count_steps
from teasim.common.arrays import Array

FAR = 2.0
"""Largest distance of two demonstrations that the network is shown."""


@dataclass(frozen=True)
class Description:
    """A pool of D demonstrations as numbers."""

    rows: NDArray[np.float32]
    """(D, F) columns of each demonstration."""
    pairs: NDArray[np.float32]
    """(D, D, P) what two demonstrations have in common."""
    names: tuple[str, ...]
    """Names of the F columns."""


def describe(pool: Observed) -> Description:
    """Describe a pool of 3 or more demonstrations in canonical form."""
    n_labels = 1 + max(max(demo.labels) for demo in pool.steps)
    counts = count_steps(pool.steps, n_labels)
    populations = find_populations(counts)
    score = score_populations(counts, populations)
    alike = likeness(counts, pool)
    repeats = repetitions(pool, n_labels)
    trust = score.trust
    trusting = departures(counts, repeats, alike.near, trust)
    plain = departures(counts, repeats, alike.near, np.ones(len(trust)))
    columns = dict(trusting.columns)
    columns |= {f"plain.{name}": values for name, values in plain.columns.items()}
    columns |= neighbours(alike, trust)
    columns |= {
        "systematic": score.systematic,
        "norm": populations.norm,
        "ratio": np.clip(populations.log_ratio, -30, 30),
        "trust": trust,
    }
    columns |= above_null(null_losses(pool, counts, trust), trusting.columns["loss"])
    evidence, parts = other_evidence(pool)
    columns |= evidence
    parts |= trusting.parts | {"score": score.losses}
    parts |= {f"plain.{name}": plain.parts[name] for name in ("loss", "order.z", "omitted")}
    for name, values in parts.items():
        columns |= context(name, values)
    of_pool = whole(counts, alike.near, score, populations)
    of_pool["pool.repeats"] = float(repeats.sum() / sum(len(demo.labels) for demo in pool.steps))
    columns |= {name: np.full(len(trust), value) for name, value in of_pool.items()}
    rows = np.stack(list(columns.values()), axis=1).astype(np.float32)
    return Description(rows, _pairs(alike, trusting, counts), tuple(columns))


def _pairs(alike: Likeness, found: Departures, counts: StepCounts) -> NDArray[np.float32]:
    """Return (D, D, P): distance, equality, and how alike the departures of two are."""
    rare = counts.occurs * np.maximum(0.5 - counts.occurs.mean(axis=0), 0)
    cosines = [_cosines(part) for part in (found.omitted, found.violated, rare)]
    near = np.minimum(alike.near, FAR)
    return np.stack([near, alike.lists, *cosines], axis=2).astype(np.float32)


def _cosines(values: Array) -> Array:
    """Return (D, D): cosine of the departures of two, near 0 where one hardly departs."""
    flat = values.reshape(len(values), -1)
    flat = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 0.3)
    return np.asarray(flat @ flat.T)
