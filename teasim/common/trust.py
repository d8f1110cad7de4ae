"""Trust weights at a temperature: how much each of several losses is believed, of a given total.

Minimising sum_k c_k (w_k l_k + tau [w_k log w_k + (1 - w_k) log(1 - w_k)]) over 0 <= w <= 1 with
sum_k c_k w_k = M has the solution w_k = sigmoid((nu - l_k) / tau), with nu from the constraint.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import expit

REACH = 50.0
"""Distance of nu from the outermost losses that is searched [temperatures]: sigmoid(50) is 1 and
sigmoid(-50) is 2e-22, so every total between 0 and all is within reach."""


def trust(
    losses: NDArray[np.float64], counts: NDArray[np.float64], total: float, temperature: float
) -> NDArray[np.float64]:
    """Return w_k = sigmoid((nu - l_k) / tau), (K,), with nu such that sum_k counts_k w_k = total.

    Args:
        losses: l, (K,).
        counts: c, how many times each loss counts, (K,), positive.
        total: M, more than 0 and less than the sum of `counts`.
        temperature: tau, in the unit of the losses, positive.

    >>> trust(np.array([0.0, 0.0, 1.0, 1.0]), np.ones(4), 2.0, 0.01).round(3).tolist()
    [1.0, 1.0, 0.0, 0.0]
    """

    def surplus(level: float) -> float:
        return float(counts @ expit((level - losses) / temperature) - total)

    margin = REACH * temperature
    level = brentq(surplus, losses.min() - margin, losses.max() + margin, xtol=1e-14)
    weights: NDArray[np.float64] = expit((level - losses) / temperature)
    return weights
