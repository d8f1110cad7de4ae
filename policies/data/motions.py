"""Read the motion of a pool: the state at every control step, and the joint targets.

The joint level sees the state alone: joint positions, then the environment state.
"""

import hashlib
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from policies.data.demos import column_names
from policies.data.samples import Observation, ObservationSpec
from teasim.common import parallel
from teasim.common.errors import ConfigError, PoolError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Episode, Pool
from teasim.pool.lerobot.layout import ACTION, ENVIRONMENT_STATE, STATE

OBSERVE = ("auto", "state")
"""Values of `observe` at the joint level; `auto` means `state` here."""


@dataclass(frozen=True)
class MotionSamples:
    """The n control steps of a pool; those of one demonstration are in temporal order."""

    low_dim: NDArray[np.float32]
    """Joint positions [rad; m for grippers], then environment state.  # (n, S)"""
    targets: NDArray[np.float32]
    """Joint targets [rad; m for grippers], for each of the first J numbers seen.  # (n, J)"""
    demos: NDArray[np.int64]
    """Position in the pool of the demonstration the step comes from.  # (n,)"""
    spec: ObservationSpec
    """What is seen."""
    action_names: tuple[str, ...]
    """Names of the J targets."""
    labels: NDArray[np.int64] | None = None
    """Sub-task that each step belongs to, an index; None: the pool names no sub-tasks.  # (n,)"""

    def __post_init__(self) -> None:
        """Check that the fields belong together and make the arrays read-only."""
        arrays = (self.low_dim, self.targets, self.demos, self.subtasks)
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

    @property
    def subtasks(self) -> NDArray[np.int64]:
        """Sub-task that each step belongs to, (n,); 0 where none are named."""
        if self.labels is None:
            return np.zeros(len(self.demos), dtype=np.int64)
        return self.labels

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> "MotionSamples":
        """Return the steps at `rows` (indices, repeats allowed, or a mask)."""
        return MotionSamples(
            self.low_dim[rows],
            self.targets[rows],
            self.demos[rows],
            self.spec,
            self.action_names,
            self.subtasks[rows],
        )


@dataclass(frozen=True)
class MotionDemo:
    """The n control steps of one demonstration."""

    low_dim: NDArray[np.float32]
    """What was seen.  # (n, S)"""
    targets: NDArray[np.float32]
    """Joint targets.  # (n, J)"""
    subtasks: NDArray[np.int64]
    """Sub-task that each step belongs to.  # (n,)"""
    share: float
    """Share of the total weight."""

    def take(self, rows: NDArray[np.bool_]) -> "MotionDemo":
        """Return the steps where `rows` (n,) is true."""
        return MotionDemo(self.low_dim[rows], self.targets[rows], self.subtasks[rows], self.share)


def distinct_demos(samples: MotionSamples, shares: NDArray[np.float64]) -> list[MotionDemo]:
    """Return every different demonstration of `samples`, with the share of the rows' `shares`.

    They are sorted by a hash of their content, so the result does not depend on the order in the
    pool, and a demonstration that occurs twice equals one of twice the weight.
    """
    found: dict[bytes, MotionDemo] = {}
    for place in np.unique(samples.demos):
        rows = samples.demos == place
        parts = samples.low_dim[rows], samples.targets[rows], samples.subtasks[rows]
        key = hashlib.sha256(b"".join(part.tobytes() for part in parts)).digest()
        before = found[key].share if key in found else 0.0
        # A demonstration counts by its weight, not by its length.
        found[key] = MotionDemo(*parts, share=before + float(shares[rows].mean()))
    total = sum(demo.share for demo in found.values())
    return [
        MotionDemo(demo.low_dim, demo.targets, demo.subtasks, demo.share / total)
        for _, demo in sorted(found.items(), key=lambda pair: pair[0])
    ]


def load_motions(
    pool: Pool, observe: str = "auto", *, workers: Workers = IN_PROCESS
) -> MotionSamples:
    """Read every control step of every demonstration of `pool`, in the order of the pool.

    Raises:
        ConfigError: `observe` is not of this level, or the pool has no joint log to learn from.
        PoolError: a log is damaged.
    """
    if observe not in OBSERVE:
        raise ConfigError(
            f"The level 'joint' sees no pictures; choose observe {' or '.join(OBSERVE)}."
        )
    check_log(pool)
    names = tuple(pool.state_names or ()), column_names(pool, ENVIRONMENT_STATE)
    spec, action_names = ObservationSpec((), 0, 0, *names), column_names(pool, ACTION)
    read = partial(_read_demo, spec=spec, subtasks=pool.subtasks)
    demos = parallel.run(read, pool.episodes, workers=workers, description="motions")
    low_dim, targets, labels = (np.concatenate(parts) for parts in zip(*demos, strict=True))
    places = np.repeat(np.arange(len(demos)), [len(steps) for _, steps, _ in demos])
    try:
        return MotionSamples(low_dim, targets, places, spec, action_names, labels)
    except ValueError as error:
        raise PoolError(f"The joint log of '{pool.root}' is damaged: {error}.") from error


def seen_numbers(observation: Observation, spec: ObservationSpec) -> NDArray[np.float32]:
    """Return the state that a policy of `spec` sees, (S,), or (n, S) for a batch of n."""
    parts = [np.asarray(observation["agent_pos"])]
    if spec.environment_names:
        environment = np.asarray(observation["environment_state"])
        parts.append(one_sign(environment, spec.environment_names))
    return np.concatenate(parts, axis=-1).astype(np.float32)


def one_sign(environment: NDArray[np.floating], names: tuple[str, ...]) -> NDArray[np.floating]:
    """Return the environment state (..., E) with every quaternion at qw >= 0.

    A quaternion and its negative are the same rotation and must have the same numbers.
    """
    turned = environment.copy()
    for place, name in enumerate(names):
        if name.endswith("_qw"):
            quaternion = turned[..., place : place + 4]
            quaternion *= np.where(quaternion[..., :1] < 0, -1, 1)
    return turned


def check_log(pool: Pool) -> None:
    """Raise ConfigError unless `pool` logs joint positions and one joint target for each."""
    targets = column_names(pool, ACTION)
    if not pool.state_names or not targets:
        raise ConfigError(
            f"'{pool.root}' has no joint log, so there is no motion to learn from it; "
            "choose level subtask instead."
        )
    if len(targets) != len(pool.state_names):
        raise ConfigError(
            f"'{pool.root}' logs {len(targets)} targets for {len(pool.state_names)} joints; "
            "the level 'joint' needs one for each."
        )


def _read_demo(
    episode: Episode, *, spec: ObservationSpec, subtasks: tuple[str, ...]
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int64]]:
    """Read one demonstration: states (n, S), targets (n, J), sub-tasks (n,)."""
    observation = {"agent_pos": episode.column(STATE)}
    if spec.environment_names:
        observation["environment_state"] = episode.column(ENVIRONMENT_STATE)
    targets = episode.column(ACTION).astype(np.float32)
    labels = np.zeros(len(targets), dtype=np.int64)
    for span in episode.spans():
        labels[span.start : span.stop] = subtasks.index(span.subtask)
    return seen_numbers(observation, spec), targets, labels
