"""The style of all figures, and their files: the same data give the same bytes."""

import io
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

from teasim.common.errors import ConfigError, TeasimError
from teasim.common.files import write_bytes

STYLE: Mapping[str, Any] = {
    "font.family": "DejaVu Sans",  # it comes with matplotlib, so it is the same everywhere
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#7d878e",
    "axes.labelcolor": "#1f2529",
    "axes.titlesize": 10,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "text.color": "#1f2529",
    "xtick.color": "#56616a",
    "ytick.color": "#56616a",
    "grid.color": "#dfe3e6",
    "legend.frameon": False,
    "legend.fontsize": 8,
    "figure.facecolor": "white",
    "svg.hashsalt": "teasim",  # names inside the SVG
}
"""Settings of matplotlib for all figures."""
GOOD, BAD, NEUTRAL, FAINT = "#2f6f4f", "#b3261e", "#56616a", "#eef0f2"
"""Colours of kept and flagged demonstrations, of aids, and of backgrounds."""
RESOLUTION = 150
"""Resolution of the PNG files [pixels per inch]."""


class Drawing(Protocol):
    """The data of a figure that knows how it is drawn."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [inches]."""

    def draw(self, axes: Any) -> None:
        """Draw on matplotlib's Axes."""


def can_draw() -> bool:
    """Return whether matplotlib is installed."""
    return find_spec("matplotlib") is not None


def check_figures(folder: Path | None) -> None:
    """Refuse figures that could not be written; called before the work. None asks for none.

    Raises:
        ConfigError: matplotlib is not installed, or the folder is a file.
    """
    if folder is None:
        return
    if not can_draw():
        raise ConfigError(
            "Figures need matplotlib, which is not installed; run 'pip install teasim[figures]' or "
            "leave out --figures."
        )
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"The folder of figures '{folder}' is a file; choose a folder.")


def save_figures(folder: Path, drawings: Mapping[str, Drawing]) -> None:
    """Write NAME.svg and NAME.png of each figure; files of these names are replaced.

    Raises:
        ConfigError: matplotlib is not installed, or the folder is a file.
        TeasimError: a file cannot be written.
    """
    check_figures(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, drawing in drawings.items():
            for ending, content in rendered(drawing).items():
                write_bytes(folder / f"{name}.{ending}", content)
    except OSError as error:
        raise TeasimError(
            f"The figures in '{folder}' cannot be written: {error.strerror}."
        ) from error


def rendered(drawing: Drawing) -> dict[str, bytes]:
    """Return the figure as the content of an svg and of a png file."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    settings: Any = dict(STYLE)
    with rc_context(settings):
        figure = Figure(figsize=drawing.size, layout="constrained")
        drawing.draw(figure.add_subplot())
        files = {}
        # Neither date nor version: another day's figure of the same data is the same file.
        for ending, about in (
            ("svg", {"Date": None, "Creator": None}),
            ("png", {"Software": None}),
        ):
            content = io.BytesIO()
            figure.savefig(content, format=ending, dpi=RESOLUTION, metadata=about)
            files[ending] = content.getvalue()
    return files
