"""A person's arm, daylight, things that lie about, and wood, for drawn scenes."""

import cv2
import numpy as np

from scenes.parts.drawing import Canvas, Colour, Point

PALM = 7.0
"""Radius of a palm [pixels]."""


def colour_of(values: np.ndarray) -> Colour:
    """Return a colour made of numbers of any kind."""
    red, green, blue = (int(value) for value in np.clip(values, 0, 255))
    return red, green, blue


def draw_arm(
    canvas: Canvas, hand: Point, elbow: Point, colours: tuple[Colour, Colour], *, grip: float = 0.0
) -> None:
    """Draw a forearm from the elbow to the palm and its fingers.

    Args:
        canvas: to draw on.
        hand: where the palm is.
        elbow: where the arm comes from.
        colours: of the sleeve and of the skin.
        grip: how far the hand is closed, 0..1.
    """
    sleeve, skin = colours
    way = (hand - elbow) / max(float(np.linalg.norm(hand - elbow)), 1.0)
    side = np.array([-way[1], way[0]])
    canvas.line(elbow, hand - 6 * way, 10, skin)
    canvas.line(elbow, hand - 20 * way, 16, sleeve)
    canvas.disc(hand, PALM, skin)
    for number in (-1.5, -0.5, 0.5, 1.5):
        root = hand + 3.4 * number * side
        spread = (0.25 - 0.35 * grip) * number
        canvas.line(root, root + (12 - 5 * grip) * (way + spread * side), 3, skin)
    canvas.line(hand - 3 * side, hand + (7 - 3 * grip) * way - (10 - 4 * grip) * side, 3, skin)
    dark = colour_of(0.8 * np.array(skin))
    canvas.line(hand - 3 * side + 3 * way, hand + 3 * side + 3 * way, 1, dark)


COARSE = np.mgrid[-1:1:12j, -1:1:16j]
"""y and x of the places at which daylight is computed, from -1 to 1 across a picture."""


class Daylight:
    """Light from one side, and a shadow that passes."""

    def __init__(self, strength: float, rng: np.random.Generator) -> None:
        """Draw from where it comes; `strength` is the standard deviation of its logarithm."""
        self._slope = strength * rng.normal(0, 1, 2)
        self._strength = strength
        self._edge, self._speed = rng.uniform(-2, 2), rng.normal(0, 0.012)

    def fall(self, image: np.ndarray) -> np.ndarray:
        """Return a lit drawing (H, W, 3); the shadow moves on."""
        self._edge += self._speed
        y, x = COARSE
        shadow = 1 / (1 + np.exp(-6 * (x + 0.4 * y - self._edge)))
        log = self._slope[0] * x + self._slope[1] * y - self._strength * shadow
        log -= np.abs(self._slope).sum() / 2  # the brightest corner does not lose all colour
        light = cv2.resize(np.exp(log).astype(np.float32), image.shape[1::-1])
        return cv2.multiply(image, cv2.merge([light] * 3), dtype=cv2.CV_8U)


class Clutter:
    """Things that do not matter, elsewhere in every video."""

    def __init__(self, places: np.ndarray, spread: float, rng: np.random.Generator) -> None:
        """Lay a thing near each of the places (n, 2)."""
        self._places = places + rng.normal(0, spread, places.shape)
        self._sizes = rng.uniform(3, 8, places.shape)
        self._angles = rng.uniform(0, np.pi, len(places))
        self._colours = rng.integers(30, 235, (len(places), 3))
        self._round = rng.random(len(places)) < 0.5

    def draw(self, canvas: Canvas) -> None:
        """Draw them."""
        for place, size, angle, colour, is_round in zip(
            self._places, self._sizes, self._angles, self._colours, self._round, strict=True
        ):
            if is_round:
                canvas.disc(place, size[0], colour_of(colour))
                canvas.disc(place, 0.7 * size[0], colour_of(0.8 * colour))
            else:
                canvas.box(place, size, colour_of(colour), angle)


def wood(height: int, width: int, colour: Colour, seed: int) -> np.ndarray:
    """Return boards with a grain along x (H, W, 3), the same for one seed."""
    rng = np.random.default_rng(seed)
    coarse = rng.normal(0, 9, (height // 2 + 1, width // 20 + 1))
    grain = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    seams = np.where(np.arange(height) % 40 == 0, -30, 0)[:, None]
    return (np.array(colour) + (grain + seams)[:, :, None]).clip(0, 255).astype(np.uint8)
