"""Intervals of a segment as a graph of typed relations, the paper's ITR graph (section 3.2)."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch_geometric.data import Data

from filtering.features.graphs.intervals import Intervals
from filtering.features.graphs.relations import NO_RELATION, Relation, relation_matrix


def interval_graph(intervals: Intervals, channels: int) -> Data:
    """Return the graph of a segment's I intervals; N = `channels`.

    Its fields:
        x (I, N) float32: the interval's largest activation in the slot of its channel, else 0.
        edge_index (2, E) int64: from the interval in a relation to the one it lies to.
        edge_type (E,) int64: the `Relation`.

    `before` joins intervals of the same channel only; there are too many others, and they say
    little. Intervals that are equal are joined in both directions.
    """
    nodes = np.zeros((len(intervals), channels), dtype=np.float32)
    nodes[np.arange(len(intervals)), intervals.channels] = intervals.values
    sources, targets, kinds = _edges(intervals)
    return Data(
        x=torch.from_numpy(nodes),
        edge_index=torch.from_numpy(np.stack([sources, targets])),
        edge_type=torch.from_numpy(kinds),
    )


def _edges(
    intervals: Intervals,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return sources, targets and relations, (E,) each."""
    relations = relation_matrix(intervals.starts, intervals.stops)
    np.fill_diagonal(relations, NO_RELATION)
    same_channel = intervals.channels[:, None] == intervals.channels[None, :]
    relations[(relations == Relation.BEFORE) & ~same_channel] = NO_RELATION
    sources, targets = np.nonzero(relations != NO_RELATION)
    return sources, targets, relations[sources, targets]
