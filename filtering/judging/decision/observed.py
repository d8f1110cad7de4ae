"""What the decision reads of a pool, numbered and ordered by content alone.

Labels are numbered and demonstrations are ordered by what they do, so that neither the names of
sub-tasks nor the order of the pool changes the result, not even in the last bit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from filtering.judging.norm.steps import StepList
from teasim.common.arrays import Array


@dataclass(frozen=True)
class Observed:
    """The step lists of a pool of D demonstrations and what else is known of their segments."""

    steps: tuple[StepList, ...]
    """D step lists."""
    reliability: tuple[Array, ...] | None = None
    """Per demonstration (q,): mean probability that the segmenter gives the label of each segment,
    in [0, 1]; None where it gives none."""
    ineffective: tuple[Array, ...] | None = None
    """Per demonstration (q,): surprise at how little each segment changed [nats]; None where videos
    were not examined."""
    told: bool = False
    """Whether the segments are logged or annotated ones: hardly any step is lost or invented."""

    def chosen(self, rows: Sequence[int] | NDArray[np.int64]) -> "Observed":
        """Return the demonstrations of some rows."""
        return Observed(
            tuple(self.steps[row] for row in rows),
            None if self.reliability is None else tuple(self.reliability[row] for row in rows),
            None if self.ineffective is None else tuple(self.ineffective[row] for row in rows),
            self.told,
        )


@dataclass(frozen=True)
class Canonical:
    """A pool in its own order."""

    pool: Observed
    """Demonstrations ordered, labels numbered from 0 without gaps, by content."""
    rows: NDArray[np.int64]
    """(D,) row of each demonstration in the pool as it was given."""
    kinds: NDArray[np.int64]
    """(D,) number of the content of each row; equal for demonstrations that cannot be told
    apart."""


def canonical(pool: Observed) -> Canonical:
    """Number labels and order demonstrations by content.

    Colours are refined as in the test of Weisfeiler and Leman: a label is known by where it occurs
    in which demonstrations, a demonstration by its labels. Of labels that remain alike, one is told
    from the others and the colours are refined again; whichever it is, the result is the same if
    the labels can be exchanged.
    """
    used = sorted({label for demo in pool.steps for label in demo.labels})
    colours = dict.fromkeys(used, 0)
    contents = [_content(pool, row) for row in range(len(pool.steps))]
    colours, demos = _refined(pool, contents, colours)
    kinds = demos
    while len(set(colours.values())) < len(used):
        values = list(colours.values())
        tied = min(colour for colour in values if values.count(colour) > 1)
        single = next(label for label in used if colours[label] == tied)
        told = {
            label: 2 * colour + (colour == tied and label != single)
            for label, colour in colours.items()
        }
        colours, demos = _refined(pool, contents, told)
    rows = np.argsort(np.array(demos), kind="stable")
    steps = [
        StepList(tuple(colours[label] for label in demo.labels), demo.lengths)
        for demo in pool.steps
    ]
    renamed = replace(pool, steps=tuple(steps)).chosen(rows)
    return Canonical(renamed, rows, np.array(kinds)[rows])


def _content(pool: Observed, row: int) -> tuple[tuple[float, ...], ...]:
    """Return per segment what is known of it besides its label."""
    parts: list[Sequence[float]] = [pool.steps[row].lengths]
    for known in (pool.reliability, pool.ineffective):
        if known is not None:
            parts.append(known[row].tolist())
    return tuple(zip(*parts, strict=True))


def _refined(
    pool: Observed, contents: list[tuple[tuple[float, ...], ...]], colours: dict[int, int]
) -> tuple[dict[int, int], list[int]]:
    """Refine until nothing changes; return the colours of labels and of demonstrations."""
    while True:
        keys = [
            tuple(zip((colours[label] for label in demo.labels), content, strict=True))
            for demo, content in zip(pool.steps, contents, strict=True)
        ]
        demos = _ranks(keys)
        places: dict[int, list[tuple[int, int]]] = {label: [] for label in colours}
        for number, demo in zip(demos, pool.steps, strict=True):
            for place, label in enumerate(demo.labels):
                places[label].append((number, place))
        labels = list(colours)
        ranks = _ranks([(colours[label], tuple(sorted(places[label]))) for label in labels])
        refined = dict(zip(labels, ranks, strict=True))
        if len(set(ranks)) == len(set(colours.values())):
            return refined, demos
        colours = refined


def _ranks(keys: Sequence[tuple[object, ...]]) -> list[int]:
    """Return the rank of each key among the different keys."""
    numbers = {key: rank for rank, key in enumerate(sorted(set(keys)))}
    return [numbers[key] for key in keys]
