"""From evidence of several kinds and cameras to one strength per demonstration, and a cut.

Evidence counts by how far it lies above the median of the trusted demonstrations, in units of what
is honest: SCALE, what usual videos reach in any pool, wider by the variety v of the orders of this
pool, and how much its demonstrations scatter, s, because where people differ all of it is larger:

    z_k      = max(0, value - median) / sqrt((SCALE_k (1 + FREE_k v) u_k)^2 + (SCATTER_k s_k)^2)
    strength = (sum over kinds of z_k^3)^(1/3)
    logit p  = STEEPNESS (strength - 1)

u is 1 but for missing and extra moments where even usual videos are found badly in each other, as
by a camera close to one thing that looks different in every video: there the median of the evidence
of extra moments is larger than UNLIKE, and u is larger than 1 by the difference.

Where a camera stands close, correct demonstrations change its picture in different ways: a tea bag
falls to the other side of the cup. An unexpected change therefore counts at most UNEXPECTED times
as much as the extra moments of the same demonstration: who does something else also moves in
another way.

Where a short step is moved, few moments pass each other, though they do so in nearly all pairs of
videos. Evidence of order therefore counts more if a demonstration keeps the order of fewer others
than is usual: with f the difference in units of FEWER, z becomes max(z, min(f, z / WITNESS)).

A demonstration of strength 1 is as probably incorrect as correct. The exponent lets one clear kind
of evidence outweigh several weak ones. Everybody is trusted at first. Gross mistakes hide small
ones, because what many do passes for variety; those whose strength is DISTRUST or more are
therefore trusted no longer, and what is usual, the evidence, median and scatter are found again
from the others (`judge`). Of several cameras the most telling one counts for each kind; a camera
that sees little, or moves, has a large scatter of its own and tells little.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from filtering.moments.peers.peers import Flags

Array = NDArray[np.float64]

KINDS = ("missing", "order", "extra", "ineffective", "unexpected")
"""Kinds of evidence."""
SCALE: Mapping[str, float] = MappingProxyType(
    {"missing": 0.25, "order": 0.15, "extra": 0.36, "ineffective": 0.6, "unexpected": 0.25}
)
"""Evidence of each kind above which a video is flagged in a pool without scatter and variety.
Chosen with FREE and SCATTER on two or three pools of every kind of each scene TUNED_ON and on
twenty of tea-making, as a compromise between mistakes found and correct videos accused
(`scripts/check_scenes.py`); those of missing and extra once more since BRIEF moments count, on
eight of the scenes and two banks of tea-making, by two for a miss and one for a false alarm, and of
those that cost the same the one that accuses fewest. For unexpected changes see UNEXPECTED."""
FREE: Mapping[str, float] = MappingProxyType(
    {"missing": 2.0, "order": 6.0, "extra": 2.0, "ineffective": 9.0, "unexpected": 2.0}
)
"""How much wider SCALE is where another order moves a step past the whole video; where orders are
free, alignments err too, so that it concerns all kinds."""
SCATTER: Mapping[str, float] = MappingProxyType(
    {"missing": 1.5, "order": 2.0, "extra": 1.5, "ineffective": 1.5, "unexpected": 1.5}
)
"""How much the scatter of a pool counts beside SCALE. That of ineffective steps was chosen again
since pictures are shifted, on five of the scenes and three banks of tea-making, of people and of
the random look: it costs least, by two for a miss and one for a false alarm."""
UNLIKE = 0.5
"""Median evidence of extra moments among the trusted up to which videos are found well in each
other. It is 0.3 or less in five of the scenes TUNED_ON and 0.6 or less in views of the whole tea
table, but 0.9 to 2 close to the cup, where correct videos were accused under the random look."""
UNEXPECTED = 1.5
"""How much more than extra moments an unexpected change counts at most. Chosen with its SCALE and
SCATTER on two pools of every kind, of one and of three incorrect videos, of twelve scenes TUNED_ON
and of five banks of tea-making: of 488 incorrect videos 422 are found in place of 416 without such
changes, and 63 correct ones accused in place of 60; without this limit 429 and 117."""
FEWER = 0.45
"""How much less than the usual share of the others, the median of the trusted, must keep the same
order as a demonstration. Among ten of one order and three of another, those of the scenes TUNED_ON
that keep it are at most 0.3 below the median, but for one in a hundred."""
WITNESS = 0.6
"""Evidence of order from which such a demonstration is flagged. Where counterparts are often wrong
(`drawers`), correct ones seem to keep the order of hardly any other; nothing else speaks against
them."""
STEEPNESS = 5.0
"""How fast the logit of the probability rises with the strength; of the size that a logistic
regression on the same pools gives."""
EXPONENT = 3
"""Exponent with which kinds are summed."""
DISTRUST = 1.3
"""Strength from which a demonstration does not say what is usual. At 1, honest variety lost its
rarest members one after the other."""
MAD_TO_DEVIATION = 1.4826
"""Standard deviation of a Gaussian [median absolute deviation]."""
ROUNDS = 3
"""Most times that trust is revised."""


class Observed(NamedTuple):
    """What one camera gives."""

    values: Mapping[str, Array]
    """Per kind (D,) its evidence against each demonstration."""
    variety: float
    """How free the orders of the pool are, see `evidence.variety_of`; the same for all cameras."""
    kept: Array
    """(D,) share of the others whose order each demonstration keeps; the same for all cameras."""


def judge(
    evidence: Callable[[Flags], Sequence[Observed]], count: int
) -> tuple[Flags, list[dict[str, Array]]]:
    """Find whom to trust; return it, (D,), and the exceedances per camera and kind, (D,) each.

    Trust once lost does not return, and is not taken from more than half of the demonstrations.

    Args:
        evidence: returns what each camera gives, once it is told whom to trust.
        count: D, the number of demonstrations.
    """
    trusted = np.ones(count, dtype=np.bool_)
    for attempt in range(ROUNDS + 1):
        exceeded = [all_exceedances(one, trusted) for one in evidence(trusted)]
        strengths = strengths_of(most_telling(exceeded))
        revised = trusted & (strengths < DISTRUST)
        if attempt == ROUNDS or np.array_equal(revised, trusted) or 2 * revised.sum() < count:
            break
        trusted = revised
    return trusted, exceeded


def all_exceedances(observed: Observed, trusted: Flags) -> dict[str, Array]:
    """Return per kind (D,): how far what a camera gives lies above what is usual.

    Args:
        observed: what it gives.
        trusted: (D,) True for those that say what is usual.
    """
    found = {kind: exceedances(kind, observed, trusted) for kind in KINDS}
    found["unexpected"] = np.minimum(found["unexpected"], UNEXPECTED * found["extra"])
    return found


def exceedances(kind: str, observed: Observed, trusted: Flags) -> Array:
    """Return (D,): z, how far evidence lies above what is usual among the trusted.

    Args:
        kind: one of KINDS.
        observed: what a camera gives.
        trusted: (D,) True for those that say what is usual.
    """
    values = observed.values[kind]
    usual = values[trusted]
    median = np.median(usual)
    scatter = MAD_TO_DEVIATION * float(np.median(np.abs(usual - median)))
    scale = SCALE[kind] * (1 + FREE[kind] * observed.variety) * _unlikeness(kind, observed, trusted)
    above = (values - median) / np.hypot(scale, SCATTER[kind] * scatter)
    if kind == "order":
        usual_share = np.median(observed.kept[trusted])
        fewer = (usual_share - observed.kept) / FEWER
        above = np.maximum(above, np.minimum(fewer, above / WITNESS))
    return np.asarray(np.maximum(above, 0.0))


def _unlikeness(kind: str, observed: Observed, trusted: Flags) -> float:
    """Return u, how much wider SCALE is because usual videos are found badly in each other."""
    if kind not in ("missing", "extra"):
        return 1.0
    return 1.0 + max(0.0, float(np.median(observed.values["extra"][trusted])) - UNLIKE)


def most_telling(exceeded: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Return per kind (D,): the largest exceedance that a camera gives."""
    return {kind: np.max([one[kind] for one in exceeded], axis=0) for kind in KINDS}


def telling(cameras: Sequence[Array]) -> NDArray[np.int64]:
    """Return (D,): for each demonstration the camera with the largest exceedance."""
    return np.asarray(np.argmax(np.stack(cameras), axis=0))


def strengths_of(exceeded: Mapping[str, Array]) -> Array:
    """Return (D,): strengths from the exceedances of all kinds."""
    powers = np.sum([z**EXPONENT for z in exceeded.values()], axis=0)
    return np.asarray(powers ** (1 / EXPONENT))


def probabilities_of(strengths: Array) -> Array:
    """Return (D,): probability of being incorrect, one half at strength 1."""
    return np.asarray(expit(STEEPNESS * (strengths - 1)))
