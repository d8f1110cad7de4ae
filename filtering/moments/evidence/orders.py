"""How free the orders of a pool are."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from filtering.moments.evidence.usual import Reference

Array = NDArray[np.float64]

AGREED = (0.4, 0.5)
"""Share of the others whose order a demonstration of the better half keeps, from which there is
nearly an order of the task, and from which there is one. Ten demonstrations of one order keep that
of 0.53 of the others beside eight of any orders; in pools of any legal order of the scenes TUNED_ON
it is 0.47 or less, but where a scene has few legal orders."""
FREEST = 0.9
"""Quantile of the moves between demonstrations that tells how free orders are."""
SMALL_MOVE = 0.02
"""Least move of a step that changes the order [length of a video]."""


def moves_between(references: Sequence[Reference]) -> Array:
    """Return (R, R): how far steps move between trusted references [length of a video].

    NaN on the diagonal. Of the two that look at a pair, the one that sees less move counts.
    """
    trusted = [reference for reference in references if reference.trusted]
    moves = np.array([[one.move(other.number) for other in trusted] for one in trusted])
    return np.fmin(moves, moves.T)


def kept_orders(references: Sequence[Reference], between: Array, count: int) -> Array:
    """Return (D,): share of the other trusted references whose order each demonstration keeps.

    Args:
        references: what is usual.
        between: (R, R) see `moves_between`.
        count: D, the number of demonstrations.
    """
    trusted = [reference for reference in references if reference.trusted]
    moves = np.array([[one.move(d) for d in range(count)] for one in trusted])
    moves[:, [one.number for one in trusted]] = between
    return np.asarray(np.nanmean(_in_one_order(moves), axis=0))


def variety_of(moves: Array) -> float:
    """Return how far steps move from one demonstration to another [length of a video].

    It is 0 where half of the demonstrations keep an order that half of the others keep too.

    Args:
        moves: (R, R) see `moves_between`.
    """
    kept = np.sort(np.nanmean(_in_one_order(moves), axis=1))
    low, high = AGREED
    free = np.clip((high - kept[len(kept) // 2]) / (high - low), 0.0, 1.0)
    return float(free * np.nanquantile(moves, FREEST))


def _in_one_order(moves: Array) -> Array:
    """Return (R, R): 1 for pairs that keep one order, 0 for others, NaN where nothing is known."""
    return np.where(np.isnan(moves), np.nan, moves < SMALL_MOVE)
