"""What the segments and weights of a pool say about the pool as a whole, in data and in words."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.judging.rules.order import number_of
from filtering.judging.rules.risk import learned_risks, risks_of, words_about_risks
from filtering.judging.rules.rules import Told
from filtering.segmentation.segments import Segmentation
from teasim.common.arrays import Array
from teasim.pool.ways.ways import Ways, find_ways
from teasim.pool.ways.words import words_about


@dataclass(frozen=True)
class PoolSummary:
    """The ways in which a pool carries out the task, and the risks of its steps."""

    ways: Ways
    """The sequences of steps."""
    risks: dict[str, float]
    """Risk of leaving out each step, in [0, 1]."""
    words: tuple[str, ...]
    """Sentences about both; the terminal, filter.json and the page show the same."""


def summarise(
    segments: Segmentation, weights: Array, flagged: NDArray[np.bool_], told: Told
) -> PoolSummary:
    """Return what can be said about a pool of D demonstrations.

    Args:
        segments: the segments that it was judged by.
        weights: (D,) weight of each demonstration.
        flagged: (D,) True for those called incorrect.
        told: the rules of the user.
    """
    names = segments.subtasks
    optional = [number_of(name, names, "optional") for name in told.optional]
    critical = [number_of(name, names, "critical") for name in told.critical]
    ways = find_ways(
        [[span.subtask for span in spans] for spans in segments.spans],
        optional=[names[number] for number in optional],
    )
    occurs = np.array([[name in steps for name in names] for steps in ways.demos], dtype=np.float64)
    risks = risks_of(names, learned_risks(occurs, weights), critical, optional)
    accused = np.flatnonzero(flagged).tolist()
    settled = [names[number] for number in (*optional, *critical)]
    words = [*words_about(ways, accused, settled), words_about_risks(risks, settled)]
    if 2 * len(accused) > len(flagged):
        words.insert(
            0,
            f"No majority: {len(accused)} of {len(flagged)} demonstrations are flagged. What is "
            "usual in this pool may itself be wrong.",
        )
    return PoolSummary(ways, risks, tuple(words))
