"""What can be asked of pictures, checked without OpenGL and without a simulator."""

from collections.abc import Sequence

from teasim.common.errors import ConfigError
from teasim.constants import CAMERAS, QUALITIES

LARGEST_SIDE = 4096
"""Largest width and height of a picture [pixels]."""


def check_cameras(cameras: Sequence[str]) -> tuple[str, ...]:
    """Return `cameras` as a tuple.

    Raises:
        ConfigError: none is given, one is unknown, or one is given twice.
    """
    for camera in cameras:
        if camera not in CAMERAS:
            raise ConfigError(f"Unknown camera '{camera}'; choose {', '.join(CAMERAS)}.")
    if not cameras or len(set(cameras)) != len(cameras):
        raise ConfigError(f"Name each camera once, at least one of {', '.join(CAMERAS)}.")
    return tuple(cameras)


def check_picture(width: int, height: int, quality: str) -> None:
    """Check the size [pixels] and the quality of pictures.

    Raises:
        ConfigError: unknown quality, or a side out of range.
    """
    if quality not in QUALITIES:
        raise ConfigError(f"Unknown quality '{quality}'; choose {', '.join(QUALITIES)}.")
    for name, side in (("width", width), ("height", height)):
        if not 1 <= side <= LARGEST_SIDE:
            raise ConfigError(f"The {name} is {side} pixels; choose from 1 to {LARGEST_SIDE}.")
