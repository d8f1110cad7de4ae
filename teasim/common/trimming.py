"""Soft trimming: the weights that trust the demonstrations of least loss at a temperature."""

import numpy as np
from scipy.optimize import brentq
from scipy.special import expit

from teasim.common.arrays import Array

REACH = 40.0
"""Temperatures beyond the losses at which a sigmoid is 0 or 1 in double precision."""


def soft_trim(losses: Array, copies: Array, trusted: float, temperature: float) -> Array:
    """Return w (D,) in [0, 1] that minimises the trimmed loss with an entropy term.

    w_d = sigmoid((nu - l_d) / tau) is the minimum of sum_d c_d [w_d l_d + tau (w_d log w_d +
    (1 - w_d) log(1 - w_d))] subject to sum_d c_d w_d = M; nu is found by root finding.

    Args:
        losses: (D,) l_d.
        copies: (D,) c_d, number of equal demonstrations that each entry stands for.
        trusted: M, between 0 and the sum of `copies`.
        temperature: tau, above 0 [unit of the losses].
    """

    def excess(level: float) -> float:
        return float(copies @ expit((level - losses) / temperature) - trusted)

    reach = temperature * (np.log(copies.sum()) + REACH)
    level = brentq(excess, losses.min() - reach, losses.max() + reach, xtol=1e-14)
    weights: Array = expit((level - losses) / temperature)
    return weights
