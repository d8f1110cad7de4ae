"""Who acts, told by the colours of what moves: a hand, a sleeve, a glove or a gripper.

Another person does every step with a hand of another colour, and often with the other hand, so that
arms rest and cover other places than usual. A cell moves at the moments at which it differs from
its median over about WINDOW moments: what was put somewhere soon moves no more. The colours of all
such cells make up a histogram, once of the whole video and once of each third of it, because things
that are used in one step move only there. The distance of two videos is the sum of the absolute
differences of their histograms, 0..2.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial.distance import cdist

from filtering.moments.peers.clusters import PARTS, Rule, clusters
from filtering.moments.vectors import Video

Array = NDArray[np.float64]

MOVES = 30.0
"""Least difference of a cell from its median that is no noise, 0..255."""
WINDOW = 50
"""About how many moments, 10 s, a median is taken over."""
LEVELS = 8
"""Levels of each of three colours."""
SMOOTHING = 0.7
"""Standard deviation by which a histogram is smoothed: shades of a colour are near [levels]."""
RULE = Rule(gap=0.45, gap_of_part=0.35, fewest=1)
"""When another acts. Of three people who make tea the gaps are 0.55 or more, and 0.42 in the part
that shows it least. In eight scenes TUNED_ON, in which one hand acts, none of 15 or 18 pools each
has a gap above 0.38."""


def actors_of(videos: Sequence[Video]) -> NDArray[np.int64]:
    """Return (D,): the same number for videos in which what moves has the same colours."""
    colours = np.stack([colours_of(video) for video in videos])
    far = [cdist(own, own, "cityblock") for own in colours.swapaxes(0, 1)]
    actors = np.zeros(len(videos), dtype=np.int64)
    for number, members in enumerate(clusters(far[0], far[1:], RULE)):
        actors[members] = number
    return actors


def colours_of(video: Video) -> Array:
    """Return (1 + PARTS, LEVELS^3): histograms of what moves, of the video and of its parts."""
    cells = video.lit_alike()
    windows = np.array_split(cells, max(round(len(cells) / WINDOW), 1))
    still = [np.broadcast_to(np.median(one, axis=0), one.shape) for one in windows]
    moves = np.linalg.norm(cells - np.concatenate(still), axis=-1) > MOVES
    parts = zip(np.array_split(cells, PARTS), np.array_split(moves, PARTS), strict=True)
    counts = [_histogram(own[moving]) for own, moving in parts]
    return np.stack([_shares(one) for one in (np.sum(counts, axis=0), *counts)])


def _histogram(colours: NDArray[np.float32]) -> Array:
    """Return (LEVELS, LEVELS, LEVELS): how many of (n, 3) colours have each level."""
    levels = np.clip(colours * LEVELS // 256, 0, LEVELS - 1).astype(np.int64)
    numbers = np.ravel_multi_index(tuple(levels.T), (LEVELS,) * 3)
    counts = np.bincount(numbers, minlength=LEVELS**3).astype(np.float64)
    return counts.reshape((LEVELS,) * 3)


def _shares(counts: Array) -> Array:
    """Return (LEVELS^3,): the counts smoothed, with a sum of 1, or of 0 where nothing moves."""
    smooth = gaussian_filter(counts, SMOOTHING, mode="constant").ravel()
    return np.asarray(smooth / max(float(smooth.sum()), 1.0))
