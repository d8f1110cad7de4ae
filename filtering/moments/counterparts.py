"""Where each moment of a video has its counterpart in the other videos.

Every video is compared with the references: all videos of a small pool, the most central ones of a
large pool. One matrix of distances says both where the moments of the reference are found in the
video, and where those of the video are found in the reference.
"""

from collections.abc import Iterator, Sequence
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


class Match(NamedTuple):
    """Where the moments of one video are found in another."""

    near: NDArray[np.float32]
    """(n,) distance of the counterpart."""
    at: NDArray[np.int64]
    """(n,) moment of the other video that is the counterpart."""


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
    """Return (n,): True for moments whose counterpart's counterpart is at most `slack` away.

    A moment that looks like many others, such as a rest, does not return.
    """
    return np.asarray(np.abs(back.at[there.at] - np.arange(len(there.at))) <= slack)


def find_counterparts(vectors: Sequence[Vectors]) -> Counterparts:
    """Find the counterparts, with directions weighed by agreement.

    Args:
        vectors: per video (n, K), see `vectors.moment_vectors`.
    """
    references = choose_references(vectors)
    among = compare([vectors[r] for r in references], range(len(references)))
    weighed = agreeing(vectors, _differences([vectors[r] for r in references], among))
    return compare(weighed, references)


def compare(vectors: Sequence[Vectors], references: Sequence[int]) -> Counterparts:
    """Compare every video with the references."""
    there: list[list[Match | None]] = [[None] * len(vectors) for _ in references]
    back: list[list[Match | None]] = [[None] * len(vectors) for _ in references]
    rows = {video: row for row, video in enumerate(references)}
    for row, r in enumerate(references):
        for d in range(len(vectors)):
            if d == r or there[row][d] is not None:
                continue
            distances = window_distances(vectors[r], vectors[d])
            there[row][d], back[row][d] = _nearest(distances), _nearest(distances.T)
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
    order = sorted(range(count), key=lambda d: (len(vectors[d]), float(np.abs(vectors[d]).sum())))
    found = compare(vectors, _spread(order, SCOUTS))
    far = [
        float(np.median([np.median(m.near) for row in found.back if (m := row[d]) is not None]))
        for d in range(count)
    ]
    limit = float(np.quantile(far, TRUSTED))
    return tuple(sorted(_spread([d for d in order if far[d] <= limit], MOST_REFERENCES)))


def _spread(numbers: Sequence[int], count: int) -> list[int]:
    places = np.linspace(0, len(numbers) - 1, min(count, len(numbers))).round().astype(int)
    return [numbers[place] for place in places]


def _nearest(distances: NDArray[np.float32]) -> Match:
    at = distances.argmin(axis=1)
    return Match(distances[np.arange(len(at)), at], at)


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
