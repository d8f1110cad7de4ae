"""A pool -> the motion in it: what was seen at every control step, and where the joints were sent.

The joint level sees the state alone: joint positions, then the environment state.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from policies.data.samples import Observation, ObservationSpec
from teasim.common import parallel
from teasim.common.errors import ConfigError, PoolError
from teasim.pool import Episode, Pool

STATE_COLUMN = "observation.state"
ENVIRONMENT_COLUMN = "observation.environment_state"
ACTION_COLUMN = "action"

OBSERVE = ("auto", "state")
"""Ways to observe that the joint level has; `auto` is `state` here."""


@dataclass(frozen=True)
class MotionSamples:
    """The control steps of a pool, n in all; those of one demonstration in the order of time."""

    low_dim: NDArray[np.float32]
    """Joint positions [rad; m for grippers], then environment state.  # (n, S)"""
    targets: NDArray[np.float32]
    """Joint targets [rad; m for grippers], for each of the first J numbers seen.  # (n, J)"""
    demos: NDArray[np.int64]
    """Position in the pool of the demonstration the step comes from.  # (n,)"""
    spec: ObservationSpec
    """What was looked at."""
    action_names: tuple[str, ...]
    """Names of the targets, J."""

    def __post_init__(self) -> None:
        """Check that the fields belong together and make the arrays read-only."""
        arrays = (self.low_dim, self.targets, self.demos)
        if len({len(array) for array in arrays}) != 1:
            raise ValueError(f"fields differ in length: {[len(array) for array in arrays]}")
        if self.low_dim.shape[1:] != (self.spec.low_dim,):
            raise ValueError(f"low_dim has shape {self.low_dim.shape}, not (n, S)")
        if self.targets.shape[1:] != (len(self.action_names),):
            raise ValueError(f"targets have shape {self.targets.shape}, not (n, J)")
        if not (np.isfinite(self.low_dim).all() and np.isfinite(self.targets).all()):
            raise ValueError("an input is not finite")
        for array in arrays:
            array.setflags(write=False)

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> "MotionSamples":
        """Return the steps at `rows` (indices, repeats allowed, or a mask)."""
        return MotionSamples(
            self.low_dim[rows], self.targets[rows], self.demos[rows], self.spec, self.action_names
        )


def load_motions(pool: Pool, observe: str = "auto", *, jobs: int = 1) -> MotionSamples:
    """Read every control step of every demonstration of `pool`, in its order.

    Raises:
        ConfigError: `observe` is not of this level, or the pool has no joint log to learn from.
        PoolError: a log is damaged.
    """
    if observe not in OBSERVE:
        raise ConfigError(
            f"The level 'joint' sees no pictures; choose observe {' or '.join(OBSERVE)}."
        )
    spec, action_names = _logged_names(pool)
    read = partial(_read_demo, spec=spec)
    demos = parallel.run(read, pool.episodes, jobs=jobs, description="motions")
    low_dim, targets = (np.concatenate(parts) for parts in zip(*demos, strict=True))
    places = np.repeat(np.arange(len(demos)), [len(steps) for _, steps in demos])
    try:
        return MotionSamples(low_dim, targets, places, spec, action_names)
    except ValueError as error:
        raise PoolError(f"The joint log of '{pool.root}' is damaged: {error}.") from error


def seen_numbers(observation: Observation, spec: ObservationSpec) -> NDArray[np.float32]:
    """What a policy of `spec` sees of an observation, (S,), or of a batch of n, (n, S)."""
    parts = [np.asarray(observation["agent_pos"])]
    if spec.environment_names:
        environment = np.asarray(observation["environment_state"])
        parts.append(one_sign(environment, spec.environment_names))
    return np.concatenate(parts, axis=-1).astype(np.float32)


def one_sign(environment: NDArray[np.floating], names: tuple[str, ...]) -> NDArray[np.floating]:
    """Return the environment state (..., E) with every quaternion turned to qw >= 0.

    A quaternion and its negative are one rotation, which must not look like two.
    """
    turned = environment.copy()
    for place, name in enumerate(names):
        if name.endswith("_qw"):
            quaternion = turned[..., place : place + 4]
            quaternion *= np.where(quaternion[..., :1] < 0, -1, 1)
    return turned


def _logged_names(pool: Pool) -> tuple[ObservationSpec, tuple[str, ...]]:
    """Say what is seen and what is controlled, from the columns the pool declares."""
    if not pool.state_names or ACTION_COLUMN not in pool.info["features"]:
        raise ConfigError(
            f"'{pool.root}' has no joint log, so there is no motion to learn from it; "
            "choose level subtask instead."
        )
    targets = _names(pool, ACTION_COLUMN)
    if len(targets) != len(pool.state_names):
        raise ConfigError(
            f"'{pool.root}' logs {len(targets)} targets for {len(pool.state_names)} joints; "
            "the level 'joint' needs one for each."
        )
    return ObservationSpec((), 0, 0, tuple(pool.state_names), _names(pool, ENVIRONMENT_COLUMN)), (
        targets
    )


def _names(pool: Pool, column: str) -> tuple[str, ...]:
    """Names of the numbers in a column, () if it is not logged; foreign pools may name nothing."""
    feature = pool.info["features"].get(column)
    if feature is None:
        return ()
    names = feature.get("names")
    return tuple(map(str, names if isinstance(names, list) else range(feature["shape"][0])))


def _read_demo(
    episode: Episode, *, spec: ObservationSpec
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Read one demonstration: what was seen (n, S), targets (n, J)."""
    observation = {"agent_pos": episode.column(STATE_COLUMN)}
    if spec.environment_names:
        observation["environment_state"] = episode.column(ENVIRONMENT_COLUMN)
    return seen_numbers(observation, spec), episode.column(ACTION_COLUMN).astype(np.float32)
