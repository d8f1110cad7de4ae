"""Colours of sub-tasks and other series, each with a text colour that can be read on it."""

import colorsys
from collections.abc import Sequence

PALETTE = (
    "#d9822b",
    "#4c86c6",
    "#c9b458",
    "#8d7bb8",
    "#5a9e6f",
    "#b86b8f",
    "#5b6770",
    "#9a6b4f",
    "#3fa7a0",
    "#7d8f3a",
)
"""Colours of the first sub-tasks in their order."""
GOLDEN_ANGLE = 137.508
"""Further colours are this far apart on the colour wheel [degrees]."""
INKS = ("#000000", "#ffffff")
"""Text colours; one of them has a contrast of 4.58 or more with any colour."""


def colours_of(names: Sequence[str]) -> dict[str, str]:
    """Return a colour for each name in the order of names, as #rrggbb."""
    return {name: colour(number) for number, name in enumerate(names)}


def colour(number: int) -> str:
    """Return the colour of the sub-task `number`, as #rrggbb."""
    if number < len(PALETTE):
        return PALETTE[number]
    hue, lightness = GOLDEN_ANGLE * number % 360 / 360, (0.44, 0.56)[number % 2]
    parts = colorsys.hls_to_rgb(hue, lightness, 0.38)
    return "#" + "".join(f"{round(255 * part):02x}" for part in parts)


def ink_on(background: str) -> str:
    """Return the text colour of INKS that has the higher contrast with a background."""
    return max(INKS, key=lambda ink: contrast(ink, background))


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours #rrggbb, 1 to 21 (WCAG 2.2, contrast ratio)."""
    dark, light = sorted((_luminance(one), _luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def _luminance(colour: str) -> float:
    """Return the relative luminance of a colour #rrggbb, 0 to 1 (WCAG 2.2)."""
    parts = [int(colour[place : place + 2], 16) / 255 for place in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return float(sum(f * p for f, p in zip((0.2126, 0.7152, 0.0722), linear, strict=True)))
