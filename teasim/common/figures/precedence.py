"""The precedence graph that a pool agrees on: which sub-task comes before which."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teasim.common.figures.colours import colours_of, ink_on

AGREED = 0.85
"""Share of the demonstrations from which an order is drawn; the rest are free. Set by judgement:
about six of seven."""


@dataclass(frozen=True)
class PrecedenceFigure:
    """How often each sub-task comes before each other one."""

    names: tuple[str, ...]
    """Names of the T sub-tasks."""
    before: tuple[tuple[float, ...], ...]
    """(T, T) share of the demonstrations with both in which the row's comes before the column's."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [inches]."""
        layers = self._layers()
        widest = max(np.bincount(layers).tolist(), default=1)
        return 1.2 + 1.5 * (max(layers, default=0) + 1), 1.0 + 0.8 * widest

    def edges(self) -> list[tuple[int, int]]:
        """Return the agreed orders that do not follow from two others."""
        agreed = self._agreed()
        implied = agreed.astype(np.int64) @ agreed.astype(np.int64) > 0
        return [(int(a), int(b)) for a, b in zip(*np.nonzero(agreed & ~implied), strict=True)]

    def draw(self, axes: Any) -> None:
        """Draw a box per sub-task, from left to right, and an arrow per agreed order."""
        layers = np.array(self._layers(), dtype=np.int64)
        places = np.zeros((len(self.names), 2))
        for layer in sorted(set(layers.tolist())):
            own = np.flatnonzero(layers == layer)
            places[own, 0] = layer
            places[own, 1] = (len(own) - 1) / 2 - np.arange(len(own))
        for a, b in self.edges():
            # Arrows over other boxes are bent around them.
            bend = 0.0 if layers[b] - layers[a] == 1 else -0.35
            axes.annotate(
                "",
                places[b],
                places[a],
                arrowprops={
                    "arrowstyle": "-|>",
                    "color": "#7d878e",
                    "shrinkA": 22,
                    "shrinkB": 26,
                    "linewidth": 0.6 + 1.4 * (self.before[a][b] - AGREED) / (1 - AGREED),
                    "connectionstyle": f"arc3,rad={bend}",
                },
            )
        for number, (name, colour) in enumerate(colours_of(self.names).items()):
            axes.text(
                *places[number],
                name.replace("_", "\n", 1).replace("_", " "),
                ha="center",
                va="center",
                fontsize=8,
                color=ink_on(colour),
                bbox={"boxstyle": "round,pad=0.4", "facecolor": colour, "edgecolor": "none"},
            )
        axes.set(xlim=(-0.6, layers.max(initial=0) + 0.6))
        axes.set(ylim=(places[:, 1].min(initial=0) - 0.7, places[:, 1].max(initial=0) + 0.7))
        axes.set_axis_off()
        axes.set_title(
            f"arrows: orders that {100 * AGREED:.0f} % or more agree on",
            fontweight="normal",
            fontsize=8,
        )

    def _agreed(self) -> NDArray[np.bool_]:
        """Return (T, T): the agreed orders; none that contradict the usual order as a whole."""
        before = np.array(self.before, dtype=np.float64).reshape(len(self.names), len(self.names))
        rank = np.argsort(np.argsort(-before.sum(axis=1), kind="stable"), kind="stable")
        forward: NDArray[np.bool_] = rank[:, None] < rank[None, :]
        return (before >= AGREED) & forward

    def _layers(self) -> list[int]:
        """Return the length of the longest chain of agreed orders that leads to each sub-task."""
        agreed = self._agreed()
        layers = [0] * len(self.names)
        for _ in self.names:
            layers = [
                max((layers[a] + 1 for a in np.flatnonzero(agreed[:, b])), default=0)
                for b in range(len(self.names))
            ]
        return layers
