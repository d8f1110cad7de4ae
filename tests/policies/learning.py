"""How the tests make any learner, and let what it learned decide again."""

import numpy as np

from policies.learners import LEARNERS

QUICK = {
    "bcnd": {"members": 2, "rounds": 2},
    "demodice": {"experts": (0, 1), "ratio_steps": 60},
}
"""Settings that make a law cheap to test; two demonstrations are experts where some are needed."""


def make(name, **settings):
    """The learner `name` with its quick settings and, before them, `settings`."""
    return LEARNERS[name].make(**(QUICK.get(name, {}) | settings))


def replay(policy, samples):
    """Probabilities (n, A) for the frames as they were, each demonstration from its start."""
    chances = np.empty((len(samples.labels), samples.n_actions))
    for demo in np.unique(samples.demos):
        memory = None
        for row in np.flatnonzero(samples.demos == demo):
            here = slice(row, row + 1)
            seen = (samples.maps[here, 0], samples.low_dim[here])
            chances[here], memory = policy.decide(*seen, memory)
    return chances
