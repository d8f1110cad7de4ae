"""Ineffective steps without pictures: the log of the environment before and after each segment.

As in `surprise`, a segment is compared with those of the same sub-task after the same sub-tasks in
the other demonstrations. A log is nearly exact, so every number k counts by how alike its changes
x_k are there, with the median m_k and the scatter s_k:

    a = (sum_k m_k x_k / s_k^2) / (sum_k m_k^2 / s_k^2)

is the share of the usual effect that a segment has, and a part that is lacking shows, too. The
log-likelihood ratio of "some share between 0 and 1 is there", all equally likely, to "as usual",
N(1, s^2), is

    (1 - a)^2 / (2 s^2) + log(s sqrt(2 pi))    nats, not below 0, and 0 where a > 1.
"""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from filtering.effects.rests import change_scales, changes, rest_features
from filtering.effects.surprise import FEWEST_OTHERS, MAD_TO_DEVIATION, number_steps, spread_of
from teasim.common.arrays import Array
from teasim.pool import Span
from teasim.pool.lerobot.layout import ENVIRONMENT_STATE
from teasim.pool.source import Source

ROBOT = re.compile(r"hand(?!le)|gripper|eef|tcp")
"""Names of numbers that say where the robot is, as teasim, robosuite and others write them."""
LEAST_SCATTER = 0.05
"""Least scatter of a number [its root mean square change in all steps]."""


def log_surprises(
    pool: Source, segments: Sequence[tuple[Span, ...]], labels: Sequence[Sequence[int]]
) -> list[Array] | None:
    """Return per demonstration (q,): how surprising the lack of effect of each segment is [nats].

    Args:
        pool: demonstrations without pictures.
        segments: the q segments of each.
        labels: the q sub-task labels of each, any whole numbers.

    Returns:
        None where no log tells what the things of the environment do, or the frame rate is not
        known.

    Raises:
        PoolError: a log is damaged.
    """
    names = pool.logs.get(ENVIRONMENT_STATE, ())
    things = [place for place, name in enumerate(names) if not ROBOT.search(name.lower())]
    if not things or pool.fps is None:
        return None
    changed = []
    for episode, spans in zip(pool.episodes, segments, strict=True):
        log = episode.log(ENVIRONMENT_STATE)[:, things]
        changed.append(changes(rest_features(log, episode.length, spans, pool.fps)))
    return change_surprises(changed, labels)


def change_surprises(changed: Sequence[Array], labels: Sequence[Sequence[int]]) -> list[Array]:
    """Return per demonstration (q,) surprises [nats] from the changes (q, F) of its segments."""
    lengths = [len(rows) for rows in changed]
    demos, steps = np.repeat(np.arange(len(changed)), lengths), number_steps(labels)
    rows = np.vstack(changed)
    amounts = _amounts(rows / change_scales(rows), steps, demos)
    nats = np.zeros(len(amounts))
    for row in np.flatnonzero(amounts < 1):  # not where it is unknown, nan
        spread = spread_of(amounts[(steps == steps[row]) & (demos != demos[row])])
        z = (1 - amounts[row]) / spread
        nats[row] = z**2 / 2 + np.log(spread * np.sqrt(2 * np.pi))
    return np.split(np.maximum(nats, 0.0), np.cumsum(lengths)[:-1])


def _amounts(changed: Array, steps: NDArray[np.int64], demos: NDArray[np.int64]) -> Array:
    """Return (S,): a, the share of the usual effect in each segment; nan where it is not known."""
    amounts = np.full(len(changed), np.nan)
    for row in range(len(changed)):
        others = (steps == steps[row]) & (demos != demos[row])
        if len(np.unique(demos[others])) < FEWEST_OTHERS:
            continue
        usual = np.median(changed[others], axis=0)
        scatter = MAD_TO_DEVIATION * np.median(np.abs(changed[others] - usual), axis=0)
        weights = usual / np.square(np.hypot(scatter, LEAST_SCATTER))
        strength = float(weights @ usual)
        # A sub-task that never changes anything is always complete.
        amounts[row] = float(weights @ changed[row]) / strength if strength > 0 else 1.0
    return amounts
