"""Whether a pool can be judged from its videos at all; where it cannot, one sentence says why."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.moments.counterparts import Counterparts, find_counterparts
from filtering.moments.structure import shared_structure
from filtering.moments.vectors import Video
from filtering.moments.weighing import weighed_vectors
from teasim.common.errors import ConfigError

FEWEST_VIDEOS = 3
"""With fewer videos there is no majority to agree with."""
FEWEST_MOMENTS = 10
"""A video with fewer moments shows no step: 2 s at 5 moments per second."""
LEAST_VARIATION = 1.0
"""Least median over the videos of the standard deviation over time of the cell that varies most,
0..255: a camera that sees less sees nothing happen. One cell is enough, because a task may fill a
hundredth of the picture; noise is left to `LEAST_RETURN`."""
LEAST_RETURN = 0.13
"""Least `shared_structure`. In pools of 12 to 14 videos of the scenes TUNED_ON it is 0.53 or more,
but 0.23 where squares are carried in any order, and in pools of 3 such videos 0.18 or more; of one
video of each of 6 or 8 scenes it is 0.02 or less, and of 6 random walks 0.10 or less."""


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
        found = {name: find_counterparts(weighed_vectors(seen)) for name, seen in moving.items()}
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
    varies = [video.cells.astype(np.float32).std(axis=0).max() for video in videos]
    return float(np.median(varies)) >= LEAST_VARIATION
