"""One video cut into parts that look alike and follow each other: TW-FINCH.

Sarfraz et al., *Temporally-Weighted Hierarchical Clustering for Unsupervised Action Segmentation*,
CVPR 2021. Every moment is joined with its nearest neighbour, where distance is difference in looks
times distance in time; the groups are averaged and joined again, until few enough are left. The
last joins, down to the wanted number, are made pair by pair (their algorithm 2). It knows one video
alone: which parts of different videos show the same is found out in `discovery`.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

Array = NDArray[np.float64]
Labels = NDArray[np.int64]


def partition(moments: Array, parts: int) -> Labels:
    """Return the part that each moment of a video belongs to, (n,), 0..parts-1.

    A part may return after another one. Fewer than `parts` moments are a part each.

    Args:
        moments: (n, F) features.
        parts: number of parts wanted, 1 or more.
    """
    labels = np.arange(len(moments))
    while True:
        coarser = _join_neighbours(moments, labels)
        if coarser.max() + 1 < parts or coarser.max() == labels.max():
            break
        labels = coarser
    while labels.max() + 1 > parts:
        labels = _join_nearest_pair(moments, labels)
    return labels


def _join_neighbours(moments: Array, labels: Labels) -> Labels:
    """Join every group with its nearest one; chains of neighbours become one group."""
    distances = _distances(moments, labels)
    count = len(distances)
    if count == 1:
        return labels
    links = (np.ones(count), (np.arange(count), distances.argmin(axis=1)))
    _, groups = connected_components(coo_array(links, shape=(count, count)), directed=False)
    return groups[labels].astype(np.int64)


def _join_nearest_pair(moments: Array, labels: Labels) -> Labels:
    distances = _distances(moments, labels)
    kept, joined = sorted(np.unravel_index(distances.argmin(), distances.shape))
    labels = np.where(labels == joined, kept, labels)
    return labels - (labels > joined)


def _distances(moments: Array, labels: Labels) -> Array:
    """Return (groups, groups): (1 - cosine) times distance in time, infinite on the diagonal."""
    members = labels == np.arange(labels.max() + 1)[:, None]  # (groups, n)
    counts = members.sum(axis=1)
    looks = members @ moments / counts[:, None]
    lengths = np.linalg.norm(looks, axis=1, keepdims=True)
    looks = looks / np.where(lengths > 0.0, lengths, 1.0)
    times = members @ np.arange(len(moments)) / counts
    apart = np.abs(times[:, None] - times) / len(moments)
    distances: Array = np.maximum(1.0 - looks @ looks.T, 0.0) * apart
    np.fill_diagonal(distances, np.inf)
    return distances
