"""How surprisingly little each segment changes, as examined videos or logs say it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teasim.common.arrays import Array

UNSEEN = 0.2
"""Share of the segments without effect that look like others."""
HIDDEN = 0.004
"""Share of the segments whose effect something hides. This and the ranges of `draw_sight` were set
by hand after logged sub-tasks of two pools of tea-making were looked at, one of them filmed."""


@dataclass(frozen=True)
class Sight:
    """How well the effects of steps are seen in a pool."""

    doubtful: float
    """Share of the segments that seem to change less than usual."""
    haze: float
    """Mean surprise at these [nats]."""
    clear: float
    """Mean surprise at segments without effect [nats]."""


def draw_sight(rng: np.random.Generator) -> Sight:
    """Draw how well the effects of steps are seen in a pool."""
    return Sight(
        doubtful=float(rng.uniform(0.0, 0.1)),
        haze=float(rng.uniform(0.2, 1.0)),
        clear=float(rng.uniform(4.0, 12.0)),
    )


def surprises(rng: np.random.Generator, sight: Sight, ineffective: NDArray[np.bool_]) -> Array:
    """Draw the surprise at how little each segment changed, (q,) [nats]."""
    count = len(ineffective)
    doubt = rng.exponential(sight.haze, count) * (rng.random(count) < sight.doubtful)
    doubt = np.where(rng.random(count) < HIDDEN, rng.exponential(2.0, count), doubt)
    seen = ineffective & (rng.random(count) >= UNSEEN)
    return np.asarray(np.where(seen, rng.gamma(4.0, sight.clear / 4.0, count), doubt))
