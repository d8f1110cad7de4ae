"""Curves of training: a value per epoch or iteration."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from teasim.common.figures.colours import colours_of

MARKED = 40
"""Largest number of values that are also marked by dots."""


@dataclass(frozen=True)
class CurvesFigure:
    """One or more series over the same steps."""

    series: Mapping[str, tuple[float, ...]]
    """Values by name, one per step."""
    value: str = "loss"
    """What the values are, with their unit."""
    step: str = "epoch"
    """What a step is."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [inches]."""
        return 5.0, 3.0

    def draw(self, axes: Any) -> None:
        """Draw a line per series; a single value is a dot."""
        for (name, values), colour in zip(
            self.series.items(), colours_of(list(self.series)).values(), strict=True
        ):
            marker = "o" if len(values) <= MARKED else ""
            steps = range(1, len(values) + 1)
            axes.plot(steps, values, marker=marker, markersize=3, color=colour, label=name)
        axes.grid(axis="y")
        axes.set(xlabel=self.step, ylabel=self.value)
        axes.locator_params(axis="x", integer=True)
        if len(self.series) > 1:
            axes.legend()
