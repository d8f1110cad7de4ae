"""How far probabilities of being incorrect can be believed: observed shares over predicted ones."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from teasim.common.figures.drawing import BAD, NEUTRAL
from teasim.common.statistics import wilson_interval

BINS = 10
"""Number of ranges of equal width that probabilities are put into."""


@dataclass(frozen=True)
class ReliabilityFigure:
    """Probabilities of D demonstrations whose labels are known."""

    probabilities: tuple[float, ...]
    """(D,) probability of being incorrect, in [0, 1]."""
    incorrect: tuple[bool, ...]
    """(D,) whether the demonstration is labelled incorrect."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [inches]."""
        return 3.8, 3.8

    def draw(self, axes: Any) -> None:
        """Draw the share of incorrect demonstrations per range, with 95 % intervals and counts."""
        p = np.array(self.probabilities, dtype=np.float64)
        wrong: np.ndarray = np.array(self.incorrect, dtype=np.bool_)
        bins = np.minimum((p * BINS).astype(np.int64), BINS - 1)
        axes.plot([0, 1], [0, 1], color=NEUTRAL, dashes=(4, 3), linewidth=1)
        for number in np.unique(bins):
            own = bins == number
            hits, trials = int(wrong[own].sum()), int(own.sum())
            low, high = wilson_interval(hits, trials)
            x, y = float(p[own].mean()), hits / trials
            axes.errorbar(x, y, ([y - low], [high - y]), marker="o", color=BAD, capsize=2)
            axes.annotate(str(trials), (x, y), (6, -3), textcoords="offset points", fontsize=8)
        axes.grid()
        axes.set_aspect("equal")
        axes.set(xlim=(-0.04, 1.08), ylim=(-0.04, 1.04))
        axes.set(xlabel="predicted probability", ylabel="share labelled incorrect")
        axes.set_title("numbers: demonstrations", fontweight="normal", fontsize=8)
