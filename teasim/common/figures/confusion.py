"""What a segmenter takes each sub-task for."""

from dataclasses import dataclass
from typing import Any

import numpy as np

DARK = 0.55
"""Share from which numbers are white, so that they can be read on the colour."""


@dataclass(frozen=True)
class ConfusionFigure:
    """Frames by true and by predicted label."""

    names: tuple[str, ...]
    """T names of the labels."""
    counts: tuple[tuple[int, ...], ...]
    """(T, T) number of frames, a row per true label and a column per predicted label."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [inches]."""
        side = 2.2 + 0.5 * len(self.names)
        return side, side

    def draw(self, axes: Any) -> None:
        """Draw the share of each row [%] as colour and number; rows without frames stay empty."""
        counts = np.array(self.counts, dtype=np.float64)
        shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
        axes.imshow(shares, cmap="Blues", vmin=0, vmax=1)
        for row, column in zip(*np.nonzero(shares >= 0.005), strict=True):
            share = shares[row, column]
            axes.text(
                column,
                row,
                f"{100 * share:.0f}",
                ha="center",
                va="center",
                fontsize=8,
                color="white" if share > DARK else "#1f2529",
            )
        words = [name.replace("_", " ") for name in self.names]
        axes.set_xticks(range(len(words)), words, rotation=45, ha="right", rotation_mode="anchor")
        axes.set_yticks(range(len(words)), words)
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        axes.set(xlabel="predicted [% of the true frames]", ylabel="true")
