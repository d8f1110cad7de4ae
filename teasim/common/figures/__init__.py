"""Figures as files, from plain data: SVG and PNG in one style. They need the extra `figures`."""

from collections.abc import Mapping
from types import MappingProxyType

from teasim.common.figures.accuracy import AccuracyFigure
from teasim.common.figures.confusion import ConfusionFigure
from teasim.common.figures.curves import CurvesFigure
from teasim.common.figures.drawing import Drawing, can_draw, check_figures, save_figures
from teasim.common.figures.precedence import PrecedenceFigure
from teasim.common.figures.reliability import ReliabilityFigure
from teasim.common.figures.timelines import Bar, TimelinesFigure
from teasim.common.figures.weights import WeightsFigure

FIGURES: Mapping[str, type[Drawing]] = MappingProxyType(
    {
        "weights": WeightsFigure,
        "timelines": TimelinesFigure,
        "confusion": ConfusionFigure,
        "curves": CurvesFigure,
        "accuracy": AccuracyFigure,
        "precedence": PrecedenceFigure,
        "reliability": ReliabilityFigure,
    }
)
"""Every kind of figure by name."""

__all__ = [
    "FIGURES",
    "AccuracyFigure",
    "Bar",
    "ConfusionFigure",
    "CurvesFigure",
    "Drawing",
    "PrecedenceFigure",
    "ReliabilityFigure",
    "TimelinesFigure",
    "WeightsFigure",
    "can_draw",
    "check_figures",
    "save_figures",
]
