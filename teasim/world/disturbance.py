"""Slow random offsets of the executed joint targets, from which a demonstration recovers.

A learner that has only seen undisturbed executions does not know how to return to them. Disturbing
the execution while the planned action is logged shows it (Laskey et al., DART: Noise Injection for
Robust Imitation Learning, CoRL 2017).
"""

from collections.abc import Iterator

import numpy as np

from teasim.constants import CONTROL_TIMESTEP

CORRELATION_TIME = 0.5
"""Time constant of each of the two low-pass filters that smooth the disturbance [s]."""


def disturbances(sigma: float, joints: int, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Yield an offset (joints + 2,) per control step: of each joint [rad], and 0 for both openings.

    Each joint's offset starts at 0 and is independent of the others: white noise through two equal
    first-order filters, so that position and velocity are continuous.

    Args:
        sigma: Standard deviation of an offset after a few time constants [rad].
        joints: Number of joints of both arms.
        rng: The source of the noise; nothing else may draw from it.
    """
    keep = float(np.exp(-CONTROL_TIMESTEP / CORRELATION_TIME))
    # The stationary variance of x[t] = 2 a x[t-1] - a^2 x[t-2] + e is var(e) (1 + a^2)/(1 - a^2)^3.
    drive = sigma * np.sqrt((1 - keep**2) ** 3 / (1 + keep**2))
    before = last = np.zeros(joints)
    while True:
        now = 2 * keep * last - keep**2 * before + drive * rng.standard_normal(joints)
        before, last = last, now
        yield np.append(now, [0.0, 0.0])
