"""Timelines of demonstrations: the segments that were found, over the true ones where known."""

from dataclasses import dataclass
from typing import Any

from teasim.common.figures.colours import colours_of


@dataclass(frozen=True)
class Bar:
    """A segment on a timeline."""

    subtask: str
    """Its name."""
    start: float
    """Start [unit of the figure]."""
    stop: float
    """End [unit of the figure]."""


@dataclass(frozen=True)
class TimelinesFigure:
    """The segments of D demonstrations."""

    names: tuple[str, ...]
    """(D,) names of the demonstrations."""
    found: tuple[tuple[Bar, ...], ...]
    """(D,) segments that were found."""
    true: tuple[tuple[Bar, ...], ...]
    """(D,) labelled segments; empty ones where there are no labels."""
    subtasks: tuple[str, ...]
    """Names in the order of their colours; others follow in the order in which they occur."""
    unit: str = "s"
    """Unit of times, s or frames."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [inches]."""
        return 8.0, 1.3 + 0.2 * len(self._colours()) / 4 + 0.36 * len(self.names)

    def draw(self, axes: Any) -> None:
        """Draw a row per demonstration, the first one on top; true segments are thin, below."""
        colours = self._colours()
        for row, (found, true) in enumerate(zip(self.found, self.true, strict=True)):
            for bars, low, height in ((found, -0.36, 0.44 if true else 0.72), (true, 0.12, 0.24)):
                axes.broken_barh(
                    [(bar.start, bar.stop - bar.start) for bar in bars],
                    (row + low, height),
                    facecolors=[colours[bar.subtask] for bar in bars],
                    edgecolor="white",
                    linewidth=0.5,
                )
        axes.set_yticks(range(len(self.names)), self.names)
        axes.set_ylim(len(self.names) - 0.4, -0.6)
        axes.tick_params(axis="y", length=0)
        axes.set_xlim(left=0)
        axes.set_xlabel(f"time [{self.unit}]" if self.unit == "s" else self.unit)
        if any(self.true):
            axes.set_title("thick: found; thin: labelled", fontweight="normal", fontsize=8)
        self._explain(axes, colours)

    def _explain(self, axes: Any, colours: dict[str, str]) -> None:
        from matplotlib.patches import Patch

        used = {bar.subtask for bars in (*self.found, *self.true) for bar in bars}
        entries = [
            Patch(color=colour, label=name.replace("_", " "))
            for name, colour in colours.items()
            if name in used
        ]
        axes.figure.legend(handles=entries, loc="outside lower center", ncols=min(4, len(entries)))

    def _colours(self) -> dict[str, str]:
        bars = [bar for row in (*self.found, *self.true) for bar in row]
        return colours_of(list(dict.fromkeys([*self.subtasks, *(bar.subtask for bar in bars)])))
