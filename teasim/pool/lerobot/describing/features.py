"""Which features of a data set are logs of numbers, and what their dimensions are called."""

import math
from collections.abc import Mapping
from typing import Any

PREFIXES = ("action", "observation.")
OUTCOMES = ("next.reward", "next.success")
NOT_NUMBERS = ("video", "image", "string", "language")
"""Kinds of features that are no numbers."""


def is_log(name: str, feature: Mapping[str, Any]) -> bool:
    """Tell whether a feature is a log: numbers that were commanded, measured or earned."""
    named = name in OUTCOMES or name.startswith(PREFIXES)
    return named and feature["dtype"] not in NOT_NUMBERS


def dimension_names(name: str, feature: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the dimensions, or NAME_0, NAME_1, ... where they are not stored."""
    told = feature.get("names")
    if isinstance(told, Mapping):  # some recorders write {"motors": [...]}
        told = next(iter(told.values()), None)
    width = math.prod(feature["shape"])
    if isinstance(told, list) and len(told) == width:
        return tuple(map(str, told))
    short = name.rpartition(".")[2]
    return (short,) if width == 1 else tuple(f"{short}_{place}" for place in range(width))
