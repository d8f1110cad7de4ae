"""Background subtraction: static pixels become grey (paper section 3.2).

Foreground masks are cleaned by an opening with a 3x3 ellipse. The grey is the backbone's zero.
"""

from collections.abc import Callable

import numpy as np

from filtering.vision.frames import Frames
from teasim.common.registry import named

GREY = 127
"""Value of a background pixel; the backbone's input is (x - 127) / 128."""
DIFFERENCE = 20
"""Difference from the median in any channel that makes a pixel foreground [0..255]."""
MOG2_VARIANCE = 16.0
"""Squared Mahalanobis distance that makes a pixel foreground for MOG2 (OpenCV's default)."""
MOG2_RATIO = 0.6
"""Share of the overview frames that the background states of a pixel make up."""

Subtraction = Callable[[Frames, Frames], Frames]
"""Takes frames in order of time and frames spread over the whole video; returns the foreground."""


def keep_all(frames: Frames, overview: Frames) -> Frames:
    """Return the frames as they are."""
    del overview
    return frames


def subtract_median(frames: Frames, overview: Frames) -> Frames:
    """Grey out what looks like the per-pixel median of the video's overview frames."""
    background = np.median(overview, axis=0).astype(np.int16)
    masks = [
        np.abs(image.astype(np.int16) - background).max(axis=2) > DIFFERENCE for image in frames
    ]
    return _grey_out(frames, masks)


def subtract_mog2(frames: Frames, overview: Frames) -> Frames:
    """Grey out what OpenCV's Gaussian-mixture model, warmed up on the overview, calls still."""
    import cv2

    model = cv2.createBackgroundSubtractorMOG2(
        history=len(overview), varThreshold=MOG2_VARIANCE, detectShadows=False
    )
    model.setBackgroundRatio(MOG2_RATIO)
    for image in overview:
        model.apply(image)
    # Learning stops here: an arm that rests for a while must not become background.
    return _grey_out(frames, [model.apply(image, learningRate=0) > 0 for image in frames])


def _grey_out(frames: Frames, masks: list[np.ndarray]) -> Frames:
    import cv2

    ellipse = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    result = np.full_like(frames, GREY)
    for image, mask, target in zip(frames, masks, result, strict=True):
        opened = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, ellipse) > 0
        target[opened] = image[opened]
    return result


BACKGROUNDS: dict[str, Subtraction] = {
    "none": keep_all,
    "median": subtract_median,
    "mog2": subtract_mog2,
}


def subtraction_named(name: str) -> Subtraction:
    """Return a background subtraction.

    Raises:
        ConfigError: there is none of that name.
    """
    return named("background subtraction", BACKGROUNDS, name)
