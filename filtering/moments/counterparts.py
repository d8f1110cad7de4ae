"""Where each moment of a video has its counterpart in the other videos.

Every video is compared with the references: all videos of a small pool, the most central ones of a
large pool. One matrix D of distances says both where the moments of the reference are found in the
video, and where those of the video are found in the reference.

A step that is left out has no counterpart, but there may be a step much like it, whose moments have
a better counterpart of their own. A place u of the other video is therefore contested by the other
moments t' of this one, those more than APART from t, and the counterpart of t is the place of the
least

    contested(t, u) = log D(t, u) + max(0, log D(t, u) - min over t' of log D(t', u)).

What a video shows again and again, such as rests, has no place of its own: a moment of one rest has
its counterpart in another rest, earlier or later. A moment recurs if its own video shows nearly the
same at another time. Such a moment says nothing about order, and neither does its counterpart. How
often it is shown is no evidence either, so that its place is not contested.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from filtering.moments.vectors import Vectors, agreeing
from filtering.moments.windows import window_distances

MOST_REFERENCES = 30
"""Most videos that all others are compared with."""
SCOUTS = 12
"""Videos by which the references of a large pool are chosen."""
TRUSTED = 0.6
"""Share of a large pool, the most central videos, that references are drawn from."""
ROUND_TRIP = 3
"""Most moments by which the counterpart of a counterpart may miss where it began."""
APART = 6
"""Moments from which on another moment contests a place: 1.2 s, less than a step lasts."""
ANOTHER_TIME = 12
"""Moments from which on it is at another time that a video looks the same: 2.4 s, so that a rest of
5 s recurs in itself."""
RECURRING = -1.0
"""Log distance, relative to the median between the moments of the same video, below which a moment
at another time looks nearly the same. In five of the scenes TUNED_ON it is -0.9 or more for all but
one moment in twenty. In tea-making with long rests, on which it was chosen, it is -1.5 or less for
a quarter of the moments. Motions that are alike recur too, such as to turn the oven on and off."""
TINY = 1e-6
"""Keeps logarithms finite where two videos are the same."""


class Match(NamedTuple):
    """Where the moments of one video are found in another."""

    near: NDArray[np.float32]
    """(n,) log distance of the most similar moment of the other video."""
    nearest: NDArray[np.int64]
    """(n,) that moment."""
    contested: NDArray[np.float32]
    """(n,) contested log distance of the counterpart, `near` or more; `near` of what recurs."""
    at: NDArray[np.int64]
    """(n,) moment of the other video that is the counterpart."""
    recurs: NDArray[np.bool_]
    """(n,) True where the moment or its counterpart recurs in its own video."""
    again: NDArray[np.bool_]
    """(n,) True where the moment recurs, and so does the most similar one of the other video."""


@dataclass(frozen=True)
class Counterparts:
    """The counterparts between the references and all videos of a pool."""

    lengths: tuple[int, ...]
    """Number of moments of each of D videos."""
    references: tuple[int, ...]
    """Numbers of the R references."""
    there: tuple[tuple[Match | None, ...], ...]
    """[r][d]: the moments of reference r found in video d; None for itself."""
    back: tuple[tuple[Match | None, ...], ...]
    """[r][d]: the moments of video d found in reference r; None for itself."""


def returned(there: Match, back: Match, slack: int) -> NDArray[np.bool_]:
    """Return (n,): True for moments whose counterpart's counterpart is at most `slack` away."""
    return np.asarray(np.abs(back.at[there.at] - np.arange(len(there.at))) <= slack)


def placed(there: Match, back: Match) -> NDArray[np.bool_]:
    """Return (n,): True for moments that return, and have a place of their own."""
    return returned(there, back, ROUND_TRIP) & ~there.recurs


def unless_again(match: Match, evidence: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return (n,): the evidence of moments, at most 0 for those that recur in both videos.

    Args:
        match: where the moments are found.
        evidence: (n,) positive for moments that are found worse than usual.
    """
    spared = np.where(match.again, np.minimum(evidence, 0.0), evidence)
    return np.asarray(spared, dtype=np.float64)


def find_counterparts(vectors: Sequence[Vectors]) -> Counterparts:
    """Find the counterparts, with directions weighed by agreement.

    Args:
        vectors: per video (n, K), see `vectors.Blocks`.
    """
    references = choose_references(vectors)
    among = compare([vectors[r] for r in references], range(len(references)))
    weighed = agreeing(vectors, _differences([vectors[r] for r in references], among))
    return compare(weighed, references, [recurring(one) for one in weighed])


def compare(
    vectors: Sequence[Vectors],
    references: Sequence[int],
    recurs: Sequence[NDArray[np.bool_]] | None = None,
) -> Counterparts:
    """Compare every video with the references.

    Args:
        vectors: per video (n, K).
        references: numbers of the references.
        recurs: per video (n,) True for moments that recur in it; None: no moment does.
    """
    own = recurs or [np.zeros(len(one), dtype=np.bool_) for one in vectors]
    there: list[list[Match | None]] = [[None] * len(vectors) for _ in references]
    back: list[list[Match | None]] = [[None] * len(vectors) for _ in references]
    rows = {video: row for row, video in enumerate(references)}
    for row, r in enumerate(references):
        for d in range(len(vectors)):
            if d == r or there[row][d] is not None:
                continue
            distances = window_distances(vectors[r], vectors[d])
            there[row][d] = find_match(distances, own[r], own[d])
            back[row][d] = find_match(distances.T, own[d], own[r])
            if d in rows:
                there[rows[d]][r], back[rows[d]][r] = back[row][d], there[row][d]
    return Counterparts(
        tuple(map(len, vectors)),
        tuple(references),
        tuple(map(tuple, there)),
        tuple(map(tuple, back)),
    )


def choose_references(vectors: Sequence[Vectors]) -> tuple[int, ...]:
    """Return the numbers of the references: all, or central ones spread over a large pool."""
    count = len(vectors)
    if count <= MOST_REFERENCES:
        return tuple(range(count))
    order = by_content(vectors)
    found = compare(vectors, spread(order, SCOUTS))
    far = [how_far(row[d] for row in found.back) for d in range(count)]
    limit = float(np.quantile(far, TRUSTED))
    return tuple(sorted(spread([d for d in order if far[d] <= limit], MOST_REFERENCES)))


def how_far(matches: Iterable[Match | None]) -> float:
    """Return how far a video is from others: the median of the median log distances."""
    return float(np.median([np.median(match.near) for match in matches if match is not None]))


def by_content(vectors: Sequence[Vectors]) -> list[int]:
    """Return the numbers of the videos in an order that does not depend on that of the pool."""
    return sorted(
        range(len(vectors)), key=lambda d: (len(vectors[d]), float(np.abs(vectors[d]).sum()))
    )


def spread(numbers: Sequence[int], count: int) -> list[int]:
    """Return `count` of the numbers at equal distances, or all if there are fewer."""
    places = np.linspace(0, len(numbers) - 1, min(count, len(numbers))).round().astype(int)
    return [numbers[place] for place in places]


def find_match(
    distances: NDArray[np.float32], own: NDArray[np.bool_], other: NDArray[np.bool_]
) -> Match:
    """Return the counterparts of the n moments of one video in another.

    Args:
        distances: (n, m), see `windows.window_distances`.
        own: (n,) True for moments of the video that recur in it.
        other: (m,) the same of the other video.
    """
    logs = np.log(distances + TINY)
    contested = logs + np.maximum(logs - _elsewhere(logs, APART), 0.0)
    rows, nearest, at = np.arange(len(logs)), logs.argmin(axis=1), contested.argmin(axis=1)
    near = logs[rows, nearest]
    far = np.where(own, near, contested[rows, at])
    return Match(near, nearest, far, at, own | other[at], own & other[nearest])


def recurring(video: Vectors) -> NDArray[np.bool_]:
    """Return (n,): True for moments of a video (n, K) that look nearly the same at another time."""
    if len(video) <= ANOTHER_TIME + 1:
        return np.zeros(len(video), dtype=np.bool_)
    logs = np.log(window_distances(video, video) + TINY)
    usual = np.median(logs[np.tril_indices(len(video), -ANOTHER_TIME - 1)])
    return np.asarray(np.diagonal(_elsewhere(logs, ANOTHER_TIME)) - usual < RECURRING)


def _elsewhere(logs: NDArray[np.float32], apart: int) -> NDArray[np.float32]:
    """Return (n, m): the least log distance to u of the moments more than `apart` from t."""
    least = np.full_like(logs, np.inf)
    if len(logs) > apart + 1:
        least[apart + 1 :] = np.minimum.accumulate(logs)[: -apart - 1]
        later = np.minimum.accumulate(logs[::-1])[::-1][apart + 1 :]
        least[: -apart - 1] = np.minimum(least[: -apart - 1], later)
    return least


def _differences(vectors: Sequence[Vectors], found: Counterparts) -> Iterator[Vectors]:
    """Yield (P, K) per pair: what the nearer half of the mutual counterparts differ by."""
    for r in range(len(vectors)):
        for d in range(len(vectors)):
            if r == d:
                continue
            there, back = found.there[r][d], found.back[r][d]
            assert there is not None
            assert back is not None
            mutual = returned(there, back, ROUND_TRIP) & (there.near <= np.median(there.near))
            yield vectors[r][mutual] - vectors[d][there.at[mutual]]
