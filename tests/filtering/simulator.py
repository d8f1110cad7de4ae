"""Pools at feature level: what segments of a tea-making pool look like to a CNN, without a CNN.

A segment's feature is its sub-task's mean, plus what the sub-tasks done before leave in view, plus
a participant's offset and noise. Noise 1 means: as large as the distance between two sub-tasks.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

TASKS = ("on", "water", "sugar", "milk", "bag", "stir", "off")
SEQ_1 = ("on", "bag", "sugar", "milk", "off", "water", "stir")
SEQ_2 = ("on", "sugar", "milk", "bag", "off", "water", "stir")
CRITICAL = ("bag", "water", "off")


@dataclass(frozen=True)
class SimulatedPool:
    features: list[np.ndarray]
    labels: list[list[int]]
    correct: np.ndarray

    @property
    def n_subtasks(self) -> int:
        return len(TASKS)


def seq_3(rng: np.random.Generator) -> tuple[str, ...]:
    """One or two of the critical three left out; sometimes the oven is turned off last instead."""
    kind = rng.integers(0, 10)
    if kind == 0:
        return ("on", "bag", "sugar", "milk", "water", "stir", "off")
    if kind == 1:
        return ("on", "bag", "sugar", "milk", "water", "off", "stir")
    dropped = rng.choice(CRITICAL, size=rng.integers(1, 3), replace=False)
    return tuple(task for task in SEQ_1 if task not in dropped)


def simulate(
    sequences: Sequence[Sequence[str]],
    correct: Sequence[bool],
    *,
    seed: int,
    noise: float = 0.5,
    traces: float = 0.5,
    participants: float = 0.5,
    size: int = 60,
) -> SimulatedPool:
    rng = np.random.default_rng(seed)
    scale = 1 / np.sqrt(2 * size)
    means = rng.normal(size=(len(TASKS), size)) / np.sqrt(2 * size)
    left_behind = traces * rng.normal(size=(len(TASKS), size)) / np.sqrt(2 * size)
    offsets = participants * rng.normal(size=(3, size)) * scale
    features, labels = [], []
    for sequence in sequences:
        names = [TASKS.index(task) for task in sequence]
        offset = offsets[rng.integers(3)]
        world = np.zeros(size)
        rows = []
        for label in names:
            rows.append(means[label] + world + offset + noise * scale * rng.normal(size=size))
            world = world + left_behind[label]
        features.append(np.array(rows))
        labels.append(names)
    return SimulatedPool(features, labels, np.array(correct))


def pool_of(
    n_correct: int, kind: str, n_wrong: int, *, seed: int, noise: float = 0.5
) -> SimulatedPool:
    rng = np.random.default_rng([seed, 1])
    wrong = [SEQ_2 if kind == "seq_2" else seq_3(rng) for _ in range(n_wrong)]
    sequences = [SEQ_1] * n_correct + wrong
    correct = [True] * n_correct + [False] * n_wrong
    order = rng.permutation(len(sequences))
    return simulate(
        [sequences[i] for i in order], [correct[i] for i in order], seed=seed, noise=noise
    )
