"""How the tests make any learner, and let what it learned decide again."""

import numpy as np

from policies.data.motions import MotionSamples
from policies.learners.registry import LEARNERS

QUICK = {
    "nearest": {"chunk": 3},
    "bcnd": {"members": 2, "rounds": 2},
    "demodice": {"experts": (0, 1), "ratio_steps": 60},
}
"""Settings that make a law cheap to test; two demonstrations are experts where some are needed."""

AT_SUBTASKS = [name for name, kind in LEARNERS.items() if "subtask" in kind.levels]
"""Learners that choose sub-tasks."""


def make(name, **settings):
    """The learner `name` with its quick settings and, before them, `settings`."""
    return LEARNERS[name].make(**(QUICK.get(name, {}) | settings))


def replay(policy, samples):
    """Probabilities (n, A) for the frames as they were, each demonstration from its start.

    At the joint level: targets (n, J).
    """
    if isinstance(samples, MotionSamples):
        return _replay_motion(policy, samples)
    chances = np.empty((len(samples.labels), samples.n_actions))
    for demo in np.unique(samples.demos):
        memory = None
        for row in np.flatnonzero(samples.demos == demo):
            here = slice(row, row + 1)
            seen = (samples.maps[here, 0], samples.low_dim[here])
            chances[here], memory = policy.decide(*seen, memory)
    return chances


def _replay_motion(policy, samples):
    targets, state = [], None
    joints = len(policy.spec.state_names)
    for row, seen in enumerate(samples.low_dim):
        start = np.array([row == 0 or samples.demos[row] != samples.demos[row - 1]])
        observation = {"agent_pos": seen[:joints], "environment_state": seen[joints:]}
        target, state = policy.predict(observation, state, start, deterministic=True)
        targets.append(target)
    return np.stack(targets)
