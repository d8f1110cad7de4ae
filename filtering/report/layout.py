"""Positions on the page: dots of the strip plot, marks above a timeline."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

DOT_WIDTH = 0.022
"""Width of a dot [weight]; dots closer than that are stacked."""
STACK = 16.0
"""Height of a dot in a stack [px]."""
TALLEST = 220.0
"""Greatest height of a stack [px]; dots of taller ones become flatter."""
FLAT = 6.0
"""Least height of a round dot [px]; flatter ones are drawn as bars, in columns."""
MARK_WIDTH = 40.0
"""Greatest width of the text of a mark [% of the timeline]; the page cuts a longer one off."""


@dataclass(frozen=True)
class Dot:
    """A demonstration in the strip plot."""

    x: float
    """Its weight."""
    level: int
    """Height in the stack, 0 is the lowest."""


@dataclass(frozen=True)
class Strip:
    """The strip plot of all weights."""

    dots: tuple[Dot, ...]
    """A dot per demonstration."""
    step: float
    """Height of a level [px]."""
    bars: bool
    """Whether the dots are drawn as bars, because there are many."""

    @property
    def height(self) -> float:
        """Height of the highest stack [px]."""
        return self.step * (1 + max((dot.level for dot in self.dots), default=0))


@dataclass(frozen=True)
class Mark:
    """An unusual place on a timeline."""

    second: float
    """Its time [unit of the page]."""
    text: str
    """Why it is unusual, in a few words."""


@dataclass(frozen=True)
class PlacedMark:
    """A mark with its place above the timeline."""

    left: float
    """Distance from the left end [% of the longest video]."""
    level: int
    """Line of its text, 0 is the closest to the timeline."""
    mark: Mark
    """The mark."""
    turned: bool
    """Whether the text is left of the mark, because it does not fit on the right."""


def place_dots(weights: Sequence[float]) -> list[Dot]:
    """Stack dots that would overlap; the order of `weights` is kept."""
    placed: list[Dot] = []
    for weight in weights:
        taken = {dot.level for dot in placed if abs(dot.x - weight) < DOT_WIDTH}
        level = next(number for number in range(len(taken) + 1) if number not in taken)
        placed.append(Dot(weight, level))
    return placed


def strip_of(weights: Sequence[float]) -> Strip:
    """Return the strip plot of weights; many dots become flat and stand in columns."""
    dots = place_dots(weights)
    highest = 1 + max((dot.level for dot in dots), default=0)
    if TALLEST / highest >= FLAT:
        return Strip(tuple(dots), min(STACK, TALLEST / highest), bars=False)
    columns: Counter[int] = Counter()
    bars = []
    for weight in weights:
        column = round(weight / DOT_WIDTH)
        bars.append(Dot(column * DOT_WIDTH, columns[column]))
        columns[column] += 1
    return Strip(tuple(bars), TALLEST / max(columns.values()), bars=True)


def place_marks(marks: Sequence[Mark], longest: float) -> list[PlacedMark]:
    """Put the texts of marks on lines so that they do not overlap."""
    placed: list[PlacedMark] = []
    # From right to left: an earlier mark stands higher, so no line runs through a text.
    for mark in sorted(reversed(marks), key=lambda item: -item.second):
        left = 100.0 * mark.second / longest
        turned = left > 100.0 - MARK_WIDTH
        taken = {other.level for other in placed if abs(other.left - left) < 2 * MARK_WIDTH}
        level = next(number for number in range(len(taken) + 1) if number not in taken)
        placed.append(PlacedMark(left, level, mark, turned))
    return placed
