"""Accuracy over K, the number of incorrect demonstrations (paper, figure 6), or another number."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from teasim.common.figures.colours import colours_of

SHIFT = 0.08
"""Distance between the intervals of series at the same K, so that they do not cover each other,
where K spans WIDTH."""
WIDTH = 7.0
"""Span of K in the paper, from 1 to 8."""
LEGEND = 84
"""Characters that fit side by side in the legend."""
MARK = 7
"""Characters that the mark before a name takes."""


@dataclass(frozen=True)
class Point:
    """A measured share with its interval."""

    k: float
    """Incorrect demonstrations in the pool, or what else the axis shows."""
    value: float
    """Share in [0, 1]."""
    low: float
    """Lower end of its 95 % interval."""
    high: float
    """Upper end of its 95 % interval."""


@dataclass(frozen=True)
class AccuracyFigure:
    """Series of shares over K."""

    series: Mapping[str, tuple[Point, ...]]
    """Points by name."""
    measure: str = "policy accuracy"
    """What is measured."""
    over: str = "incorrect demonstrations K"
    """What the horizontal axis shows."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [inches]."""
        return 6.0, 3.4

    def draw(self, axes: Any) -> None:
        """Draw a line per series, with 95 % intervals."""
        colours = colours_of(list(self.series))
        places = sorted({point.k for points in self.series.values() for point in points})
        wide = (places[-1] - places[0]) / WIDTH if len(places) > 1 else 1.0
        for number, (name, points) in enumerate(self.series.items()):
            points = tuple(sorted(points, key=lambda point: point.k))
            shift = SHIFT * wide * (number - (len(self.series) - 1) / 2)
            values = [100 * point.value for point in points]
            below = [100 * max(0.0, point.value - point.low) for point in points]
            above = [100 * max(0.0, point.high - point.value) for point in points]
            axes.errorbar(
                [point.k + shift for point in points],
                values,
                (below, above),
                marker="o",
                markersize=4,
                capsize=2,
                linewidth=1.3,
                color=colours[name],
                label=name,
            )
        axes.grid(axis="y")
        axes.set_xticks(places, [f"{place:.3g}" for place in places])
        axes.set(xlabel=self.over, ylabel=f"{self.measure} [%]", ylim=(0, 103))
        longest = max(map(len, self.series), default=0)
        columns = max(1, min(3, len(self.series), LEGEND // (longest + MARK)))
        axes.figure.legend(loc="outside upper center", ncols=columns)
