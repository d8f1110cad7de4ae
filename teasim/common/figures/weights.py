"""Weights of demonstrations by their true sequence, with the threshold (paper, figures 4 and 5)."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from teasim.common.figures.drawing import BAD, FAINT, GOOD, NEUTRAL


@dataclass(frozen=True)
class WeightsFigure:
    """The weight of each of D demonstrations."""

    weights: tuple[float, ...]
    """(D,) in [0, 1]."""
    flagged: tuple[bool, ...]
    """(D,) True where the demonstration is flagged."""
    sequences: tuple[str, ...]
    """(D,) what the demonstration is by its labels; one empty text for all where none are known."""
    threshold: float
    """Weight below which a demonstration is flagged; 0 when there is none."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [inches]."""
        return min(12.0, 3.5 + 0.07 * len(self.weights)), 3.2

    def draw(self, axes: Any) -> None:
        """Draw a point per demonstration, sequence by sequence, each by falling weight."""
        names = sorted(set(self.sequences))
        start, middles = 0, []
        for number, name in enumerate(names):
            own = [d for d, sequence in enumerate(self.sequences) if sequence == name]
            own.sort(key=lambda d: -self.weights[d])
            if number % 2:
                axes.axvspan(start - 0.5, start + len(own) - 0.5, color=FAINT, zorder=0)
            self._points(axes, own, start)
            middles.append(start + (len(own) - 1) / 2)
            start += len(own)
        if self.threshold > 0:
            axes.axhline(self.threshold, color=NEUTRAL, dashes=(4, 3), linewidth=1)
            label = f"threshold {self.threshold:.2f}"
            axes.annotate(
                label,
                (1, self.threshold),
                (-2, 3),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                ha="right",
                color=NEUTRAL,
                fontsize=8,
            )
        axes.set_xticks(middles, [name.replace("_", " ") or "demonstrations" for name in names])
        axes.tick_params(axis="x", length=0)
        axes.set(xlim=(-0.7, max(start, 1) - 0.3), ylim=(-0.05, 1.05), ylabel="weight")
        if any(self.flagged):
            axes.figure.legend(loc="outside upper right", ncols=2)

    def _points(self, axes: Any, own: list[int], start: int) -> None:
        places = np.arange(start, start + len(own))
        for flagged, marker, colour in ((False, "o", GOOD), (True, "X", BAD)):
            chosen = [k for k, d in enumerate(own) if self.flagged[d] == flagged]
            heights = [self.weights[own[k]] for k in chosen]
            label = None if start else ("flagged" if flagged else "kept")
            axes.plot(
                places[chosen],
                heights,
                marker,
                color=colour,
                label=label,
                clip_on=False,
                markersize=6,
                markeredgecolor="white",
                markeredgewidth=0.6,
            )
