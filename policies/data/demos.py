"""Read the decisions of a pool: the observation before each sub-task, and the sub-task chosen.

The robot rests in its start pose at every decision, so a policy will see what the frame at the
start of a sub-task's span shows. The neighbouring frames add nothing; altered copies do
(features.py).
"""

import zlib
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from policies.data.features import NO_MAPS, Maps, camera_maps, views
from policies.data.samples import DecisionSamples, ObservationSpec
from teasim.common import parallel
from teasim.common.errors import ConfigError, PoolError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Episode, Pool
from teasim.pool.lerobot.layout import ENVIRONMENT_STATE, STATE

OBSERVE = ("auto", "pixels", "pixels_agent_pos", "state")
"""`auto`: frames, and joint positions if the pool logs them (videos of people have none); without
cameras, `state`. `state`: joint positions and environment state, no frames; needs no rendering."""


@dataclass(frozen=True)
class DemosConfig:
    """How a pool is turned into decisions."""

    observe: str = "auto"
    """What the policy sees: `auto`, `pixels`, `pixels_agent_pos` or `state`."""
    cameras: tuple[str, ...] = ()
    """Cameras the policy sees; empty: all of the pool."""
    copies: int = 3
    """Number of altered copies of each decision's frames."""
    seed: int = 0
    """Seed of the alterations, which otherwise depend on the demonstration alone."""

    def __post_init__(self) -> None:
        """Raise ConfigError for an unknown way to observe or a negative number of copies."""
        if self.observe not in OBSERVE:
            raise ConfigError(f"Unknown observe '{self.observe}'; choose {', '.join(OBSERVE)}.")
        if self.copies < 0:
            raise ConfigError(f"copies is {self.copies}; choose 0 or more.")


def load_decisions(
    pool: Pool, config: DemosConfig | None = None, *, workers: Workers = IN_PROCESS
) -> DecisionSamples:
    """Read the decisions of every demonstration of `pool`, in the order of the pool.

    Raises:
        ConfigError: a camera or the joint log that `config` asks for is not in the pool.
        PoolError: the pool has no sub-task labels, or a video or log is damaged.
    """
    config = config or DemosConfig()
    if not pool.subtasks:
        raise PoolError(f"'{pool.root}' has no sub-task labels, so there is no decision to learn.")
    spec = observation_spec(pool, config)
    acting = [place for place, episode in enumerate(pool.episodes) if episode.spans()]
    if not acting:
        raise PoolError(f"No demonstration of '{pool.root}' holds a sub-task.")
    read = partial(_read_demo, subtasks=pool.subtasks, spec=spec, config=config)
    episodes = [pool.episodes[place] for place in acting]
    demos = parallel.run(read, episodes, workers=workers, description="decisions")
    maps, low_dim, labels = (np.concatenate(parts) for parts in zip(*demos, strict=True))
    places = np.repeat(acting, [len(labels) for _, _, labels in demos])
    return DecisionSamples(maps, low_dim, labels, places, spec, pool.subtasks)


def observation_spec(pool: Pool, config: DemosConfig) -> ObservationSpec:
    """Describe what a policy trained on `pool` sees.

    Raises:
        ConfigError: a camera or the joint log that `config` asks for is not in the pool.
    """
    unknown = [camera for camera in config.cameras if camera not in pool.cameras]
    if unknown:
        choices = ", ".join(pool.cameras) or "none"
        raise ConfigError(f"'{pool.root}' has no camera '{unknown[0]}'; choose {choices}.")
    if config.observe in ("pixels_agent_pos", "state") and not pool.state_names:
        raise ConfigError(
            f"'{pool.root}' logs no joint positions; choose observe auto or pixels instead."
        )
    if config.observe == "state" or (config.observe == "auto" and not pool.cameras):
        return ObservationSpec((), 0, 0, tuple(pool.state_names or ()), _environment_names(pool))
    if not pool.cameras:
        raise ConfigError(f"'{pool.root}' has no camera; choose observe auto or state instead.")
    names = () if config.observe == "pixels" else pool.state_names or ()
    cameras = config.cameras or pool.cameras
    height, width, _ = pool.episodes[0].clip(cameras[0]).frames([0])[0].shape
    return ObservationSpec(cameras, height, width, tuple(names))


def _read_demo(
    episode: Episode, *, subtasks: tuple[str, ...], spec: ObservationSpec, config: DemosConfig
) -> tuple[Maps, NDArray[np.float32], NDArray[np.int64]]:
    """Read one demonstration: maps (n, V, K, C, h, w), state (n, S), labels (n,)."""
    spans = episode.spans()
    starts = [span.start for span in spans]
    labels = np.array([subtasks.index(span.subtask) for span in spans], dtype=np.int64)
    columns = [STATE] if spec.state_names else []
    columns += [ENVIRONMENT_STATE] if spec.environment_names else []
    nothing = np.empty((len(spans), 0))
    parts = [nothing, *(episode.column(name)[starts] for name in columns)]
    return _maps(episode, starts, spec, config), np.hstack(parts).astype(np.float32), labels


def _maps(episode: Episode, starts: list[int], spec: ObservationSpec, config: DemosConfig) -> Maps:
    """Feature maps (n, V, K, C, h, w) of the frames at `starts`; K is 0 without cameras."""
    if not spec.cameras:
        return np.empty((len(starts), 1, *NO_MAPS), dtype=np.float16)
    random = np.random.default_rng([config.seed, zlib.crc32(episode.demo_id.encode())])
    seen = {
        camera: views(episode.clip(camera).frames(starts), config.copies, random)
        for camera in spec.cameras
    }
    flat = {camera: frames.reshape(-1, *frames.shape[2:]) for camera, frames in seen.items()}
    maps = camera_maps(flat, spec.cameras)
    return maps.reshape(len(starts), 1 + config.copies, *maps.shape[1:])


def _environment_names(pool: Pool) -> tuple[str, ...]:
    names = column_names(pool, ENVIRONMENT_STATE)
    if not names:
        raise ConfigError(
            f"'{pool.root}' logs no environment state; choose observe auto, pixels or "
            "pixels_agent_pos instead."
        )
    return names


def column_names(pool: Pool, column: str) -> tuple[str, ...]:
    """Return the names of the numbers in a column of `pool`, () if it is not logged.

    Pools of other programs may give no names; then the numbers are called 0, 1, ...
    """
    feature = pool.info["features"].get(column)
    if feature is None:
        return ()
    names = feature.get("names")
    return tuple(map(str, names if isinstance(names, list) else range(feature["shape"][0])))
