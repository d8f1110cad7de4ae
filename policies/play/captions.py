"""A line of text below a picture."""

import cv2
import numpy as np
from numpy.typing import NDArray

STRIP = 24
"""Height of the strip below the picture [pixel]; even, as videos need it."""
LARGEST = 0.5
"""Largest scale of the letters; a long text in a narrow picture gets smaller ones."""
WHITE = (255, 255, 255)


def caption(frame: NDArray[np.uint8], text: str) -> NDArray[np.uint8]:
    """Return `frame` (H, W, 3) with `text` in a dark strip below it, (H + STRIP, W, 3)."""
    strip = np.zeros((STRIP, *frame.shape[1:]), dtype=np.uint8)
    (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 1.0, 1)
    scale = min(LARGEST, 0.95 * frame.shape[1] / width)
    line = cv2.LINE_AA
    cv2.putText(strip, text, (2, STRIP - 8), cv2.FONT_HERSHEY_SIMPLEX, scale, WHITE, 1, line)
    return np.vstack([frame, strip])
