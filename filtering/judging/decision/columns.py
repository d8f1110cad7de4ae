"""Columns: how far each demonstration is from the others, in numbers that know no names.

All log-odds leave the demonstration itself out; `trust` (D,) weighs the others.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from filtering.judging.norm.norm_score import (
    PRECEDENCE_NORM,
    PRECEDENCE_WORST,
    SMOOTHING,
    TRANSITION,
)
from filtering.judging.norm.steps import StepCounts
from teasim.common.arrays import Array

DONE = 1.5
"""What a step that is done takes off the log-odds of a part that is left out [nats]; set by hand,
no other value was tried."""


@dataclass(frozen=True)
class Departures:
    """What separates D demonstrations from the others."""

    columns: dict[str, Array]
    """(D,) numbers by name."""
    parts: dict[str, Array]
    """(D,) those that are also compared with the rest of the pool."""
    omitted: Array
    """(D, T) log-odds of the steps left out."""
    violated: Array
    """(D, T, T) log-odds of the pairs out of order."""


def departures(counts: StepCounts, repeats: Array, near: Array, trust: Array) -> Departures:
    """Return how a pool's demonstrations differ from the trusted ones.

    Args:
        counts: counts of D step lists over T labels.
        repeats: (D, T) how often each label occurs beyond the first time.
        near: (D, D) distance of the demonstrations from each other.
        trust: (D,) weight of each, in [0, 1].
    """
    steps, omitted, sums = _steps(counts, trust)
    again, repeated = _repeats(repeats, trust)
    order, violated = _order(counts, trust)
    following, worst = _following(counts.follows, trust)
    others = trust[None] * (1 - np.eye(len(trust))) + 1e-9
    away = (others * near).sum(axis=1) / others.sum(axis=1)
    norm, strongest = order["order.norm"], violated.max(axis=(1, 2))
    precedence = PRECEDENCE_NORM * norm + PRECEDENCE_WORST * strongest
    loss = sums["omitted"] + precedence + TRANSITION * worst
    columns = steps | again | order | following | {"away": away, "loss": loss}
    parts = sums | {
        "repeated": repeated,
        "precedence": precedence,
        "order.1": order["order.1"],
        "order.2": order["order.2"],
        "order.z": order["order.z"],
        "following": worst,
        "away": away,
        "loss": loss,
    }
    return Departures(columns, parts, omitted, violated)


def log_odds(share: Array, known: Array | float, trust: Array) -> tuple[Array, Array, Array]:
    """Return the log-odds of `share` (D, ...) among the others, and the weights for and against."""
    weight = trust.reshape(-1, *[1] * (share.ndim - 1))
    yes, no = weight * share * known, weight * (1 - share) * known
    yes, no = yes.sum(axis=0) - yes, no.sum(axis=0) - no
    return np.log((yes + SMOOTHING) / (no + SMOOTHING)), yes, no


def largest(values: Array, count: int) -> Array:
    """Return the `count` largest of each row of (D, n) in falling order, 0 where there are none."""
    padded = np.pad(values, ((0, 0), (0, max(0, count - values.shape[1]))))
    return np.asarray(-np.sort(-padded, axis=1)[:, :count])


def largest_part(omitted: Array, counts: StepCounts) -> Array:
    """Return (D,): the log-odds of the most surprising part of the task that is left out.

    A segmenter loses steps here and there; who leaves out a part of a task leaves out neighbours. A
    part is a run of steps in their usual order, from which those that are done are taken off.

    Args:
        omitted: (D, T) log-odds of the steps left out.
        counts: counts of the pool.
    """
    occurs = counts.occurs
    known = counts.both.sum(axis=(0, 1))
    place = counts.before.sum(axis=(0, 1)) / np.maximum(known, 1)
    usual = np.flatnonzero(occurs.mean(axis=0) >= 0.5)
    run = most = np.zeros(len(occurs))
    for step in usual[np.argsort(place[usual], kind="stable")]:
        run = np.maximum(run + omitted[:, step] - DONE * occurs[:, step], 0.0)
        most = np.maximum(most, run)
    return most


def _steps(counts: StepCounts, trust: Array) -> tuple[dict[str, Array], Array, dict[str, Array]]:
    """Describe omitted and rare steps."""
    occurs = counts.occurs
    rows = np.arange(len(occurs))
    z, yes, no = log_odds(occurs, 1.0, trust)
    omitted, rare = (1 - occurs) * np.maximum(z, 0), occurs * np.maximum(-z, 0)
    first, odd = omitted.argmax(axis=1), rare.argmax(axis=1)
    some, any_rare = omitted[rows, first] > 0, rare[rows, odd] > 0
    p = expit(z)
    surprise = -np.where(occurs > 0, np.log(p), np.log1p(-p))
    usual = -(p * np.log(p) + (1 - p) * np.log1p(-p))
    variance = (p * (1 - p) * z**2).sum(axis=1) + 0.3
    columns = {f"omitted.{k}": v for k, v in enumerate(largest(omitted, 4).T)}
    columns |= {f"rare.{k}": v for k, v in enumerate(largest(rare, 3).T)}
    columns |= {
        "omitted.sum": omitted.sum(axis=1),
        "omitted.part": largest_part(omitted, counts),
        "omitted.sure": ((1 - occurs) * (no < 0.5) * (yes > 2)).sum(axis=1),
        "omitted.others": np.where(some, no[rows, first], -1),
        "omitted.z": (surprise - usual).sum(axis=1) / np.sqrt(variance),
        "rare.sum": rare.sum(axis=1),
        "rare.others": np.where(any_rare, yes[rows, odd], -1),
    }
    parts = {
        "omitted": columns["omitted.sum"],
        "omitted.part": columns["omitted.part"],
        "rare": columns["rare.0"],
    }
    return columns, omitted, parts


def _repeats(repeats: Array, trust: Array) -> tuple[dict[str, Array], Array]:
    """Describe steps that occur more often than usual."""
    again = np.minimum(repeats, 1.0)
    z, _, _ = log_odds(again, 1.0, trust)
    rare = again * np.maximum(-z, 0)
    worst = largest(rare, 2)
    columns = {"repeated.1": worst[:, 0], "repeated.2": worst[:, 1], "repeated": rare.sum(axis=1)}
    return columns, worst[:, 0]


def _order(counts: StepCounts, trust: Array) -> tuple[dict[str, Array], Array]:
    """Describe pairs of steps that are out of order."""
    demos, size = len(trust), max(counts.n_subtasks - 1, 1)
    z, yes, no = log_odds(counts.before, counts.both, trust)
    violated = np.maximum(z, 0) * (1 - counts.before) * counts.both
    flat = violated.reshape(demos, -1)
    worst = flat.argmax(axis=1)
    rows = np.arange(demos)
    sure = (no < 0.5) & (yes > 2)
    broken = (sure * (1 - counts.before) * counts.both).sum(axis=(1, 2))
    p = expit(z)
    expected = (counts.both * np.abs(z) * np.minimum(p, 1 - p)).sum(axis=(1, 2)) / 2
    variance = (counts.both * z**2 * p * (1 - p)).sum(axis=(1, 2)) / 2
    columns = {f"order.{k + 1}": v for k, v in enumerate(_independent(violated))}
    columns |= {
        "order.norm": np.linalg.norm(flat, axis=1),
        "order.sum": flat.sum(axis=1) / size,
        "order.blame": (violated + violated.transpose(0, 2, 1)).sum(axis=2).max(axis=1) / size,
        "order.sure": broken,
        "order.sureshare": broken / np.maximum((sure * counts.both).sum(axis=(1, 2)), 1),
        "order.others": np.where(flat[rows, worst] > 0, no.reshape(demos, -1)[rows, worst], -1),
        "order.z": (flat.sum(axis=1) - expected) / np.sqrt(variance * (size + 1) / 2 + 0.3),
        "order.expected": expected / size,
    }
    return columns, violated


def _independent(violated: Array, count: int = 3) -> list[Array]:
    """Return the worst pair (D,), the worst one without the step most to blame, and so on."""
    left = violated + violated.transpose(0, 2, 1)
    rows = np.arange(len(left))
    found = []
    for _ in range(count):
        flat = left.reshape(len(left), -1)
        worst = flat.argmax(axis=1)
        found.append(flat[rows, worst])
        first, second = np.divmod(worst, left.shape[2])
        blame = left.sum(axis=2)
        step = np.where(blame[rows, first] >= blame[rows, second], first, second)
        left[rows, step, :] = 0
        left[rows, :, step] = 0
    return found


def _following(follows: Array, trust: Array) -> tuple[dict[str, Array], Array]:
    """Describe unusual next steps."""
    weighted = trust[:, None, None] * follows
    others = weighted.sum(axis=0) - weighted + SMOOTHING
    done: NDArray[np.bool_] = follows > 0
    excess = np.where(done, np.log(others.max(axis=2, keepdims=True) / others), 0.0)
    number = done.sum(axis=(1, 2))
    new = (done & (others < SMOOTHING + 0.3)).sum(axis=(1, 2))
    worst = largest(excess.reshape(len(follows), -1), 3)
    columns = {f"following.{k}": v for k, v in enumerate(worst.T)}
    columns |= {
        "following.mean": (excess * follows).sum(axis=(1, 2)) / follows.sum(axis=(1, 2)),
        "following.new": new,
        "following.newshare": new / number,
        "following.start": excess[:, -1].max(axis=1),
        "following.end": excess[:, :, -1].max(axis=1),
    }
    return columns, worst[:, 0]
