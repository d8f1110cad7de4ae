"""Whether a pool can be judged from its videos at all; where it cannot, one sentence says why."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.moments.counterparts import ROUND_TRIP, Counterparts, find_counterparts
from filtering.moments.vectors import Video, moment_vectors
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


class UnsuitableError(ConfigError):
    """Videos that show nothing to judge, whatever the settings are."""


@dataclass(frozen=True)
class Comparable:
    """What the cameras that are of use saw, and what it has in common."""

    videos: Mapping[str, Sequence[Video]]
    """Per camera of use the videos of the demonstrations."""
    found: Mapping[str, Counterparts]
    """Per camera of use the counterparts; empty where a video is too short to tell."""
    structure: Mapping[str, float]
    """Per camera that sees something happen, `shared_structure`; empty likewise."""
    notes: tuple[str, ...] = ()
    """A sentence about each camera that is left out."""


def comparable(cameras: Mapping[str, Sequence[Video]]) -> Comparable:
    """Leave out cameras that see nothing, or nothing that the videos have in common.

    Args:
        cameras: per camera the videos of the demonstrations.

    Raises:
        UnsuitableError: no camera sees anything happen, or the videos do not show one task.
    """
    moving = {camera: videos for camera, videos in cameras.items() if sees_motion(videos)}
    if not moving:
        raise UnsuitableError(
            f"Nothing happens in the pictures of {', '.join(cameras)}; name a camera that sees "
            "the task."
        )
    notes = tuple(
        f"Nothing happens in the pictures of {camera}, which is left out."
        for camera in cameras
        if camera not in moving
    )
    if min(len(video) for videos in moving.values() for video in videos) < FEWEST_MOMENTS:
        return Comparable(moving, {}, {}, notes)
    # The matrices are small: more BLAS threads only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        found = {name: find_counterparts(moment_vectors(seen)) for name, seen in moving.items()}
        structure = {camera: shared_structure(one) for camera, one in found.items()}
    useful = {c: one for c, one in found.items() if structure[c] >= LEAST_RETURN}
    if not useful:
        raise UnsuitableError(
            "These videos do not show one task: most of their moments have no counterpart in "
            "the other videos; filter the videos of one task at a time."
        )
    notes += tuple(
        f"The pictures of {camera} have little in common, and are left out."
        for camera in found
        if camera not in useful
    )
    return Comparable({c: moving[c] for c in useful}, useful, structure, notes)


def check_videos(cameras: Mapping[str, Sequence[Video]]) -> None:
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
