"""How the tests make any learner, and let what it learned decide again."""

import numpy as np

from policies.data.motions import MotionSamples
from policies.learners.registry import AT_JOINTS, LEARNERS, find_learner

SMALL = {"steps": 40, "width": 16, "blocks": 1, "batch": 8, "learning_rate": 1e-2}
QUICK = {
    "act": SMALL | {"chunk": 3},
    "bc@joint": SMALL,
    "bc-rnn@joint": SMALL | {"chunk": 2, "horizon": 4, "hidden": 8},
    "nearest": {"chunk": 3},
    "bcnd": {"members": 2, "rounds": 2},
    "demodice": {"experts": (0, 1), "ratio_steps": 60},
}
"""Settings that make a law cheap to test; two demonstrations are experts where some are needed."""

ROWS = (*LEARNERS, *(f"{name}@joint" for name in AT_JOINTS))
"""Every learner; one that has a row for each level also as NAME@joint."""
AT_SUBTASKS = [name for name, kind in LEARNERS.items() if "subtask" in kind.levels]
"""Learners that choose sub-tasks."""


def kind_of(row):
    """The learner of `row`, at the level after @ or else at its only or first one."""
    name, _, level = row.partition("@")
    return find_learner(name, level or LEARNERS[name].levels[0])


def make(row, **settings):
    """The learner of `row` with its quick settings and, before them, `settings`."""
    return kind_of(row).make(**(QUICK.get(row, {}) | settings))


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
