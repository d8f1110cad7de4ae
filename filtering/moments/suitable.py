"""Whether moments can judge a pool at all; where they cannot, one sentence says why."""

from collections.abc import Sequence

import numpy as np

from filtering.moments.counterparts import ROUND_TRIP, Counterparts
from filtering.moments.vectors import Video
from teasim.common.errors import ConfigError

FEWEST_VIDEOS = 3
"""With fewer videos there is no majority to agree with."""
FEWEST_MOMENTS = 10
"""A video with fewer moments shows no step: 2 s at 5 moments per second."""
LEAST_VARIATION = 1.0
"""Least median over the videos of a cell's standard deviation over time, in the cells that vary
most, 0..255: a camera that sees less sees nothing happen."""
LEAST_RETURN = 0.2
"""Least share of moments whose counterpart's counterpart is about where it began, in the median
pair of videos. On the scenes tabletop, hands and conveyor it is 0.9 or more, but 0.3 where squares
are carried in any order; of independent random walks it is 0.13 or less."""


def check_videos(cameras: dict[str, Sequence[Video]]) -> None:
    """Refuse too few or too short videos.

    Args:
        cameras: per camera the videos of the demonstrations.

    Raises:
        ConfigError: in one sentence.
    """
    if not cameras:
        raise ConfigError("No camera was given; moments are judged from videos.")
    videos = next(iter(cameras.values()))
    if len(videos) < FEWEST_VIDEOS:
        raise ConfigError(
            f"{len(videos)} videos were given; moments need {FEWEST_VIDEOS} or more to compare."
        )
    for number, video in enumerate(videos):
        if len(video) < FEWEST_MOMENTS:
            raise ConfigError(
                f"Video {number} has {len(video)} moments; moments need {FEWEST_MOMENTS} or more, "
                "which are 2 s."
            )


def sees_motion(videos: Sequence[Video]) -> bool:
    """Tell whether a camera sees anything happen."""
    varies = []
    for video in videos:
        deviation = video.cells.astype(np.float32).std(axis=0).max(axis=-1)
        varies.append(np.quantile(deviation, 0.95))
    return float(np.median(varies)) >= LEAST_VARIATION


def shared_structure(found: Counterparts) -> float:
    """Return the share of moments that return from a round trip, in the median pair of videos."""
    shares = []
    for row, back in zip(found.there, found.back, strict=True):
        for there, returned in zip(row, back, strict=True):
            if there is None or returned is None:
                continue
            missed = np.abs(returned.at[there.at] - np.arange(len(there.at)))
            shares.append(float((missed <= ROUND_TRIP).mean()))
    return float(np.median(shares))
