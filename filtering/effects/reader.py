"""What has been done, read from a video at rest; learned from labelled demonstrations.

Effects add up: what is seen at rest changes between two rests by

    x = sum_e y_e b_e + noise,      y_e = 1 where effect e came, -1 where it was undone, else 0,

so that b comes from least squares over all pairs of rests of a demonstration, whatever the order of
its sub-tasks, and y from generalised least squares (Aitken, 1936),

    y = (B C^-1 B')^-1 B C^-1 x,    C the covariance of the noise (Ledoit and Wolf, 2004).

A probe per effect on single rests takes what always comes together for the same thing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
from sklearn.covariance import ledoit_wolf
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.effects.rests import change_scales
from filtering.vision.frame_features import FrameSource
from teasim.common.errors import ConfigError

Array = NDArray[np.float64]

FEWEST_DEMOS = 3
"""Effects are learned from this many demonstrations or more: each is read by the others' once."""
OPPOSITE = -0.6
"""Cosine of what two sub-tasks change below which one of them undoes the other."""
ERROR_FLOOR = 0.1
"""Least error of a reading; a few demonstrations cannot show that there is none."""


@dataclass(frozen=True)
class Effect:
    """What a sub-task leaves behind."""

    subtask: str
    """The sub-task that brings it."""
    undone_by: str | None
    """The sub-task that takes it away, or None: the oven is on until it is turned off."""


@dataclass(frozen=True, eq=False)
class EffectReader:
    """Reads from a video at rest which effects are there."""

    effects: tuple[Effect, ...]
    """E effects."""
    weights: NDArray[np.float32]
    """(E, F): a change of features times these is 1 for the effect, and 0 without."""
    errors: tuple[float, ...]
    """Per effect how far readings of unseen demonstrations are from 0 and 1, root mean square."""
    accuracies: tuple[float, ...]
    """Per effect the balanced accuracy of readings of unseen demonstrations [share]."""
    certainties: tuple[float, ...]
    """Per effect the most that one reading says [nats]: so many of unseen ones were right to one
    that was wrong."""
    source: FrameSource
    """What is looked at in a video."""

    def read(self, rests: Array) -> Array:
        """Return (q, E): the probability that each effect is there after each of q segments.

        Args:
            rests: (q + 1, F) see `rest_features`.

        Raises:
            ConfigError: the features are not those the reader was fitted to.
        """
        return np.asarray(expit(self._evidence(rests)))

    def surprises(self, rests: Array, subtasks: Sequence[str]) -> Array:
        """Return (q,): how much speaks against what each segment should have left [nats].

        Args:
            rests: (q + 1, F) see `rest_features`.
            subtasks: names of the q segments; those without a known effect cost nothing.

        Raises:
            ConfigError: the features are not those the reader was fitted to.
        """
        came = np.array([[effect.subtask == name for effect in self.effects] for name in subtasks])
        went = np.array(
            [[effect.undone_by == name for effect in self.effects] for name in subtasks]
        )
        against = np.where(came, -1.0, np.where(went, 1.0, 0.0)) * self._evidence(rests)
        return np.asarray(against.max(axis=1, initial=0.0))

    def reliability(self) -> dict[str, float]:
        """Return the balanced accuracy of each effect by the sub-task that brings it [share]."""
        names = [effect.subtask for effect in self.effects]
        return dict(zip(names, self.accuracies, strict=True))

    def _evidence(self, rests: Array) -> Array:
        """Return (q, E): log-odds of "it is there", N(1, error^2) against N(0, error^2) [nats]."""
        if rests.shape[1] != self.weights.shape[1]:
            raise ConfigError(
                f"The video has {rests.shape[1]} features per rest; the effects were learned from "
                f"{self.weights.shape[1]}."
            )
        readings = (rests[1:] - rests[0]) @ self.weights.T.astype(np.float64)
        evidence = (readings - 0.5) / np.square(self.errors)
        return np.asarray(np.clip(evidence, -np.array(self.certainties), self.certainties))


def fit_effects(
    rests: Sequence[Array], subtasks: Sequence[Sequence[str]], source: FrameSource
) -> EffectReader:
    """Learn effects from labelled demonstrations.

    Args:
        rests: per demonstration (q + 1, F), see `rest_features`.
        subtasks: per demonstration the names of its q segments.
        source: what the features were taken from.

    Raises:
        ConfigError: there are too few demonstrations.
    """
    if len(rests) < FEWEST_DEMOS:
        raise ConfigError(
            f"Effects are learned from {FEWEST_DEMOS} labelled demonstrations or more, "
            f"not {len(rests)}."
        )
    with threadpool_limits(limits=1, user_api="blas"):
        effects = find_effects(rests, subtasks)
        states = [effect_states(effects, names) for names in subtasks]
        weights = _fit(rests, states).astype(np.float32)
        readings = _unseen_readings(rests, states)
    truth = np.vstack([rows[1:] for rows in states])
    right = ((readings > 0.5) == (truth > 0.5)).sum(axis=0)
    errors = np.hypot(np.sqrt(np.square(readings - truth).mean(axis=0)), ERROR_FLOOR)
    return EffectReader(
        effects=effects,
        weights=weights,
        errors=tuple(errors.tolist()),
        accuracies=tuple(balanced_accuracy(readings > 0.5, truth > 0.5).tolist()),
        certainties=tuple(_certainties(right, len(truth)).tolist()),
        source=source,
    )


def find_effects(rests: Sequence[Array], subtasks: Sequence[Sequence[str]]) -> tuple[Effect, ...]:
    """Return an effect for each sub-task, but one for two that take turns to undo each other.

    They are in the order in which demonstrations show them first.
    """
    names = _in_order(subtasks)
    alone = tuple(Effect(name, None) for name in names)
    changes, moves = _pairs(rests, [effect_states(alone, done) for done in subtasks])
    traces = np.linalg.lstsq(moves, changes / change_scales(changes), rcond=None)[0]
    traces /= np.maximum(np.linalg.norm(traces, axis=1, keepdims=True), 1e-12)
    likeness = traces @ traces.T
    opposite = likeness.argmin(axis=1)
    undoes = {
        int(second): first
        for first, second in enumerate(opposite)
        if first < second and opposite[second] == first and likeness[first, second] < OPPOSITE
    }
    undone_by = {first: names[second] for second, first in undoes.items()}
    return tuple(
        Effect(name, undone_by.get(number))
        for number, name in enumerate(names)
        if number not in undoes
    )


def effect_states(effects: Sequence[Effect], subtasks: Sequence[str]) -> Array:
    """Return (q + 1, E): which effects should be there at first and after each of q segments."""
    states = np.zeros((len(subtasks) + 1, len(effects)))
    for row, name in enumerate(subtasks, start=1):
        states[row] = states[row - 1]
        for number, effect in enumerate(effects):
            if name in (effect.subtask, effect.undone_by):
                states[row, number] = float(name == effect.subtask)
    return states


def balanced_accuracy(said: NDArray[np.bool_], truth: NDArray[np.bool_]) -> Array:
    """Return (E,) mean of the shares of true and of false ones that were called so, (n, E) each."""
    hits = [(said & truth).sum(axis=0), (~said & ~truth).sum(axis=0)]
    counts = [truth.sum(axis=0), (~truth).sum(axis=0)]
    shares = [hit / np.maximum(count, 1) for hit, count in zip(hits, counts, strict=True)]
    return np.asarray(np.mean(shares, axis=0))


def _unseen_readings(rests: Sequence[Array], states: Sequence[Array]) -> Array:
    """Return (S, E): every demonstration read by what the others teach."""
    readings = []
    for left, own in enumerate(rests):
        others = [number for number in range(len(rests)) if number != left]
        weights = _fit([rests[n] for n in others], [states[n] for n in others])
        readings.append((own[1:] - own[0]) @ weights.T)
    return np.vstack(readings)


def _certainties(right: NDArray[np.int64], count: int) -> Array:
    """Return log-odds of being right from (E,) readings of `count` that were; not below 0."""
    return np.asarray(np.maximum(np.log((right + 1) / (count - right + 1)), 0.0))


def _fit(rests: Sequence[Array], states: Sequence[Array]) -> Array:
    """Return the weights (E, F) of readings."""
    changes, moves = _pairs(rests, states)
    scales = change_scales(changes)
    # All that was ever seen to change lies in the span of the changes from the first rest.
    basis = np.linalg.svd(
        np.vstack([rows[1:] - rows[0] for rows in rests]) / scales, full_matrices=False
    )[2]
    seen = (changes / scales) @ basis.T
    traces = np.linalg.lstsq(moves, seen, rcond=None)[0]
    noise, _ = ledoit_wolf(seen - moves @ traces, assume_centered=True)
    weighted = traces @ np.linalg.pinv(noise, hermitian=True)
    weights: Array = np.linalg.pinv(weighted @ traces.T, hermitian=True) @ weighted @ basis / scales
    return weights


def _pairs(rests: Sequence[Array], states: Sequence[Array]) -> tuple[Array, Array]:
    """Return changes (P, F) and moves of effects (P, E) of all pairs of rests of a video."""
    earlier_later = [np.triu_indices(len(rows), 1) for rows in rests]
    changes = [rows[j] - rows[i] for rows, (i, j) in zip(rests, earlier_later, strict=True)]
    moves = [rows[j] - rows[i] for rows, (i, j) in zip(states, earlier_later, strict=True)]
    return np.vstack(changes), np.vstack(moves)


def _in_order(subtasks: Sequence[Sequence[str]]) -> list[str]:
    """Return the names of all sub-tasks by how early demonstrations show them on average."""
    places: dict[str, list[int]] = {}
    for names in subtasks:
        for name in dict.fromkeys(names):
            places.setdefault(name, []).append(names.index(name))
    return sorted(places, key=lambda name: (float(np.mean(places[name])), name))
