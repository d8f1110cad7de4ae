"""The different sequences of steps in a pool, and how each differs from the most frequent order."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

Steps = tuple[str, ...]
"""Names of the steps of a demonstration in order of time; a step in several pieces counts once."""
Pair = tuple[str, str]
"""Two steps (a, b): a came before b."""

FEWEST_LEAVE_OUT = 0.2
"""Share from which a step that is left out may be optional rather than forgotten, as in the prior
of docs/decision.md."""
MOST_LEAVE_OUT = 0.8
"""Share above which a step is an extra of those who do it, as in the same prior."""
FEWEST = 2
"""Demonstrations that a habit takes; one alone is an accident."""


@dataclass(frozen=True)
class Way:
    """One sequence of steps and who follows it."""

    steps: Steps
    """Names in order of time."""
    rows: tuple[int, ...]
    """Numbers of the demonstrations, from 0."""


@dataclass(frozen=True)
class Ways:
    """The sequences of the D demonstrations of a pool."""

    demos: tuple[Steps, ...]
    """Steps of each demonstration."""
    optional: frozenset[str] = frozenset()
    """Steps that are known to be optional; they do not make another order."""

    @cached_property
    def all(self) -> tuple[Way, ...]:
        """Every different sequence, the most frequent one first."""
        rows: dict[Steps, list[int]] = {}
        for row, steps in enumerate(self.demos):
            rows.setdefault(steps, []).append(row)
        ways = [Way(steps, tuple(own)) for steps, own in rows.items()]
        return tuple(sorted(ways, key=lambda way: (-len(way.rows), way.steps)))

    @cached_property
    def left_out(self) -> dict[str, tuple[int, ...]]:
        """Per step that some, but neither few nor most, leave out: who does."""
        names = dict.fromkeys(name for steps in self.demos for name in steps)
        found = {}
        for name in names:
            rows = tuple(row for row, steps in enumerate(self.demos) if name not in steps)
            enough = FEWEST <= len(rows) <= len(self.demos) - FEWEST
            if enough and FEWEST_LEAVE_OUT <= len(rows) / len(self.demos) <= MOST_LEAVE_OUT:
                found[name] = rows
        return found

    @cached_property
    def orders(self) -> tuple[Way, ...]:
        """The different orders, the one that most demonstrations keep first.

        A demonstration keeps an order if the steps that it has in common with it come in the same
        order; what it leaves out, adds or repeats does not matter.
        """
        free = self.optional | set(self.left_out)
        plain = [tuple(dict.fromkeys(s for s in steps if s not in free)) for steps in self.demos]
        left, found = list(range(len(plain))), []
        while left:
            counts = Counter(plain[row] for row in left)
            # Of equally frequent ones the longest says most; the names make it one of these.
            best = max(counts, key=lambda order: (counts[order], len(order), order))
            own = [row for row in left if not inversions(best, plain[row])]
            found.append(Way(best, tuple(own)))
            left = [row for row in left if row not in own]
        return tuple(sorted(found, key=lambda way: -len(way.rows)))


def find_ways(demos: Sequence[Sequence[str]], optional: Collection[str] = ()) -> Ways:
    """Return the ways of a pool.

    Args:
        demos: per demonstration the names of its segments in order of time.
        optional: steps that are known to be optional.
    """
    merged = tuple(tuple(name for name, _ in groupby(steps)) for steps in demos)
    return Ways(merged, frozenset(optional))


def inversions(usual: Sequence[str], other: Sequence[str]) -> list[Pair]:
    """Return the fewest pairs (a, b) that explain the order of `other`, where `usual` has b first.

    The steps of the longest part that both have in common stay; each other step is named with the
    nearest of these that it has passed.
    """
    place = {name: number for number, name in enumerate(dict.fromkeys(usual))}
    own = [name for name in dict.fromkeys(other) if name in place]
    stays = _longest_rising([place[name] for name in own])
    found = []
    for row, name in enumerate(own):
        if row in stays:
            continue
        passed = [k for k in sorted(stays) if (k < row) != (place[own[k]] < place[name])]
        nearest = min(passed, key=lambda k: abs(k - row))
        found.append((name, own[nearest]) if row < nearest else (own[nearest], name))
    return found


def _longest_rising(values: Sequence[int]) -> set[int]:
    """Return the positions of a longest rising part of different numbers."""
    best: list[tuple[int, ...]] = []
    for row, value in enumerate(values):
        before = [part for part in best if values[part[-1]] < value]
        best.append((*_longest(before), row))
    return set(_longest(best))


def _longest(parts: Sequence[tuple[int, ...]]) -> tuple[int, ...]:
    return max(parts, key=lambda part: len(part), default=())


def difference(usual: Sequence[str], other: Sequence[str]) -> list[str]:
    """Return in words how a sequence differs from the usual one; empty if they are equal."""
    omitted = [name for name in dict.fromkeys(usual) if name not in other]
    added = [name for name in dict.fromkeys(other) if name not in usual]
    first, second = Counter(usual), Counter(other)
    again = [name for name in first if 0 < first[name] < second[name]]
    once = [name for name in second if 0 < second[name] < first[name]]
    return [
        *(f"without {name}" for name in omitted),
        *(f"with {name}" for name in added),
        *(f"{name} more often" for name in again),
        *(f"{name} less often" for name in once),
        *(f"{a} before {b}" for a, b in inversions(usual, other)),
    ]
