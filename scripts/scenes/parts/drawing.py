"""Drawing in two dimensions, and a simple camera that films the drawing."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

Point = np.ndarray
"""(2,) x and y [pixels]."""
Colour = tuple[int, int, int]
"""Red, green and blue, 0..255."""
SUBPIXEL = 4
"""Binary digits of a pixel's fractions in OpenCV's drawing functions."""


def smooth(share: float) -> float:
    """Return how far a motion is that starts and ends at rest, for `share` of its time."""
    return 3 * share**2 - 2 * share**3


def along(stops: Sequence[Point], share: float) -> tuple[Point, int]:
    """Return where a motion through `stops` is, and on which leg, 0 for the first one."""
    legs = len(stops) - 1
    leg = min(int(share * legs), legs - 1)
    inside = smooth(share * legs - leg)
    return stops[leg] * (1 - inside) + stops[leg + 1] * inside, leg


class Canvas:
    """An RGB picture to draw on."""

    def __init__(self, background: np.ndarray) -> None:
        """Start with a copy of `background` (H, W, 3) uint8."""
        self.image = background.copy()

    def disc(self, centre: Point, radius: float, colour: Colour) -> None:
        """Draw a filled circle."""
        cv2.circle(
            self.image, _fixed(centre), round(radius * 16), colour, -1, cv2.LINE_AA, SUBPIXEL
        )

    def box(self, centre: Point, half: Sequence[float], colour: Colour, angle: float = 0) -> None:
        """Draw a filled rectangle of half sides `half`, turned by `angle` [rad]."""
        c, s = np.cos(angle), np.sin(angle)
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(half)
        self.polygon(centre + corners @ np.array([[c, s], [-s, c]]), colour)

    def polygon(self, corners: np.ndarray, colour: Colour) -> None:
        """Draw a filled polygon with corners (n, 2)."""
        fixed = np.round(np.asarray(corners) * 16).astype(np.int32)
        cv2.fillPoly(self.image, [fixed], colour, cv2.LINE_AA, SUBPIXEL)

    def line(self, start: Point, end: Point, width: int, colour: Colour) -> None:
        """Draw a line."""
        cv2.line(self.image, _fixed(start), _fixed(end), colour, width, cv2.LINE_AA, SUBPIXEL)


@dataclass(frozen=True)
class Look:
    """How different the videos of a scene look."""

    offset: float = 2.0
    """Standard deviation of where a camera stands, per video [pixels]."""
    turn: float = 0.01
    """Standard deviation of how it is turned, per video [rad]."""
    shake: float = 0.0
    """Standard deviation of its motion from frame to frame [pixels]."""
    light: float = 0.08
    """Standard deviation of the log of the light's strength, per video."""
    drift: float = 0.0
    """Standard deviation of the log of how the light changes within a video."""
    noise: float = 3.0
    """Standard deviation of a pixel's noise, 0..255."""


class Film:
    """One video's camera."""

    def __init__(self, look: Look, rng: np.random.Generator) -> None:
        """Draw where the camera stands and how strong the light is."""
        self._look = look
        self._rng = rng
        self._offset = rng.normal(0, look.offset, 2)
        self._turn = rng.normal(0, look.turn)
        self._gain = np.exp(rng.normal(0, look.light) + rng.normal(0, look.light / 4, 3))
        self._drift = rng.normal(0, look.drift)
        self._sway = np.zeros(2)
        self._frame = 0

    def take(self, image: np.ndarray) -> np.ndarray:
        """Return what the camera sees of a drawing (H, W, 3)."""
        height, width = image.shape[:2]
        self._sway = 0.8 * self._sway + self._rng.normal(0, 0.6 * self._look.shake, 2)
        matrix = cv2.getRotationMatrix2D((width / 2, height / 2), np.degrees(self._turn), 1.0)
        matrix[:, 2] += self._offset + self._sway
        seen = cv2.warpAffine(
            image, matrix, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        light = self._gain * np.exp(self._drift * np.sin(self._frame / 60))
        self._frame += 1
        noise = self._rng.normal(0, self._look.noise, (height, width, 1))
        return (seen * light + noise).clip(0, 255).astype(np.uint8)


def table(height: int, width: int, colour: Colour, seed: int) -> np.ndarray:
    """Return a table top with a coarse grain (H, W, 3), the same for one seed."""
    rng = np.random.default_rng(seed)
    coarse = rng.normal(0, 8, (height // 10 + 1, width // 10 + 1))
    grain = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR)
    return (np.array(colour) + grain[:, :, None]).clip(0, 255).astype(np.uint8)


def _fixed(point: Point) -> tuple[int, int]:
    return round(float(point[0]) * 16), round(float(point[1]) * 16)
