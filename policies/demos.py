"""A pool -> the decisions in it: what was seen before each sub-task, and which one came next.

The robot rests in its start pose whenever it decides, so the frame at the start of a sub-task's
span is what a policy will see. Neighbouring frames in which it still rests show the same decision
under other pixel noise; they are added as augmentation, sharing the decision's weight.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from policies.base import DecisionSamples, ObservationSpec
from policies.features import decision_inputs
from teasim import parallel
from teasim.errors import ConfigError, PoolError
from teasim.pool import Episode, Pool, Span, read_frames

STATE_COLUMN = "observation.state"

REST_TOLERANCE = 2e-3
"""Largest joint motion [rad; m for grippers] from the decision at which the robot still rests."""

OBSERVE = ("auto", "pixels", "pixels_agent_pos")
"""`auto`: joint positions too where the pool logs them, frames alone (human videos) where not."""


@dataclass(frozen=True)
class DemosConfig:
    """How a pool is turned into decisions."""

    observe: str = "auto"
    """What a policy will see: `pixels`, `pixels_agent_pos` or `auto`."""
    cameras: tuple[str, ...] = ()
    """Cameras to use; empty: all of the pool."""
    rest_frames: int = 3
    """Most frames per decision, the one at the start of the span included."""

    def __post_init__(self) -> None:
        """Raise ConfigError for an unknown way to observe or no frame at all."""
        if self.observe not in OBSERVE:
            raise ConfigError(f"Unknown observe '{self.observe}'; choose {', '.join(OBSERVE)}.")
        if self.rest_frames < 1:
            raise ConfigError(f"rest_frames is {self.rest_frames}; choose 1 or more.")


@dataclass(frozen=True)
class Decision:
    """One decision of one demonstration."""

    label: int
    """Chosen sub-task, an index into the pool's."""
    frames: tuple[int, ...]
    """Frames in which it was seen; the first is the start of the span."""


def load_decisions(
    pool: Pool, config: DemosConfig | None = None, *, jobs: int = 1
) -> DecisionSamples:
    """Read the decisions of every demonstration of `pool`, in its order.

    Raises:
        ConfigError: a camera or the joint log that `config` asks for is not in the pool.
        PoolError: the pool has no sub-task labels, or a video or log is damaged.
    """
    config = config or DemosConfig()
    if not pool.subtasks:
        raise PoolError(f"'{pool.root}' has no sub-task labels, so there is no decision to learn.")
    spec = observation_spec(pool, config)
    read = partial(_read_demo, subtasks=pool.subtasks, spec=spec, most=config.rest_frames)
    acting = [place for place, episode in enumerate(pool.episodes) if episode.spans()]
    if not acting:
        raise PoolError(f"No demonstration of '{pool.root}' holds a sub-task.")
    episodes = [pool.episodes[place] for place in acting]
    demos = parallel.run(read, episodes, jobs=jobs, description="decisions")
    inputs, labels, shares = (np.concatenate(parts) for parts in zip(*demos, strict=True))
    places = np.repeat(acting, [len(labels) for _, labels, _ in demos])
    return DecisionSamples(inputs, labels, places, shares, spec, pool.subtasks)


def observation_spec(pool: Pool, config: DemosConfig) -> ObservationSpec:
    """Say what a policy trained on `pool` looks at.

    Raises:
        ConfigError: a camera or the joint log that `config` asks for is not in the pool.
    """
    unknown = [camera for camera in config.cameras if camera not in pool.cameras]
    if unknown:
        raise ConfigError(
            f"'{pool.root}' has no camera '{unknown[0]}'; choose {', '.join(pool.cameras)}."
        )
    if config.observe == "pixels_agent_pos" and not pool.state_names:
        raise ConfigError(
            f"'{pool.root}' logs no joint positions; choose observe auto or pixels instead."
        )
    names = () if config.observe == "pixels" else pool.state_names or ()
    cameras = config.cameras or pool.cameras
    height, width, _ = read_frames(pool.episodes[0].video(cameras[0]), [0])[0].shape
    return ObservationSpec(cameras, height, width, tuple(names))


def find_decisions(
    spans: Sequence[Span],
    subtasks: tuple[str, ...],
    joints: NDArray[np.float32] | None,
    most: int,
) -> list[Decision]:
    """Find the decision before each of `spans` and up to `most` frames that show it.

    Args:
        spans: sub-task spans in order of time.
        subtasks: names in the order of the labels.
        joints: joint positions (n, J) [rad; m]; None without a joint log, then rest cannot be
            told and each decision has its one frame.
        most: most frames per decision.
    """
    decisions = []
    free = 0
    for span in spans:
        frames = [span.start]
        if joints is not None:
            frames += _rest_frames(joints, free, span.start, span.stop)
        decisions.append(Decision(subtasks.index(span.subtask), tuple(frames[:most])))
        free = span.stop
    return decisions


def _rest_frames(joints: NDArray[np.float32], free: int, start: int, stop: int) -> list[int]:
    """Frames next to `start` in which the robot rests as there, nearest first.

    Only frames of no sub-task (from `free`) and of this one (before `stop`) are asked: at the end
    of the sub-task before, the world may still be moving while the robot rests.
    """
    rests = np.abs(joints[free:stop] - joints[start]).max(axis=1) <= REST_TOLERANCE
    moves = np.flatnonzero(~rests) + free
    first = moves[moves < start].max(initial=free - 1) + 1
    last = moves[moves > start].min(initial=stop)
    near = [frame for frame in range(first, last) if frame != start]
    return sorted(near, key=lambda frame: (abs(frame - start), frame))


def _read_demo(
    episode: Episode, *, subtasks: tuple[str, ...], spec: ObservationSpec, most: int
) -> tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.float64]]:
    """Read one demonstration: inputs (n, F), labels (n,), shares (n,)."""
    joints = episode.column(STATE_COLUMN) if spec.state_names else None
    decisions = find_decisions(episode.spans(), subtasks, joints, most)
    frames = [frame for decision in decisions for frame in decision.frames]
    sizes = [len(decision.frames) for decision in decisions]
    labels = np.repeat([decision.label for decision in decisions], sizes).astype(np.int64)
    pixels = {camera: read_frames(episode.video(camera), frames) for camera in spec.cameras}
    seen = None if joints is None else joints[frames]
    shares = np.repeat([1 / size for size in sizes], sizes)
    return decision_inputs(pixels, seen, spec), labels, shares
