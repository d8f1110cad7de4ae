"""Steps that a demonstration carries out more often than the others do: extra or repeated ones.

They are no part of the loss of the default score, but the learned decision knows them.
"""

from collections.abc import Sequence

import numpy as np

from filtering.judging.explain import Finding
from filtering.judging.norm.norm_score import SMOOTHING
from filtering.judging.places import NOTABLE, Places
from teasim.common.arrays import Array


def find_extras(
    labels: Sequence[Sequence[int]], trust: Array, places: Places
) -> tuple[tuple[Finding, ...], ...]:
    """Return per demonstration its notable extra steps, the most surprising one first.

    The surprise of the k-th time that a step is carried out is the log-odds that another
    demonstration carries it out fewer than k times [nats].

    Args:
        labels: per demonstration its q sub-task labels, 0..T-1.
        trust: (D,) how much each demonstration shapes the norm.
        places: the segments and their names.
    """
    counts = np.zeros((len(labels), len(places.subtasks)), dtype=np.int64)
    for demo, steps in enumerate(labels):
        np.add.at(counts[demo], list(steps), 1)
    found = []
    for demo, steps in enumerate(labels):
        done = np.unique(np.array(steps)).tolist()
        surprises = {label: _surprise(counts[:, label], demo, trust) for label in done}
        notable = sorted((-nats, label) for label, nats in surprises.items() if nats >= NOTABLE)
        found.append(tuple(places.extra(demo, label, -nats) for nats, label in notable))
    return tuple(found)


def _surprise(times: np.ndarray, demo: int, trust: Array) -> float:
    as_often = times >= times[demo]
    yes, no = (float(trust @ part - trust[demo] * part[demo]) for part in (as_often, ~as_often))
    return float(np.log((no + SMOOTHING) / (yes + SMOOTHING)))
