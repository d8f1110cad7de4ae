"""TW-FINCH: a video cut into parts of similar appearance that are close in time.

Sarfraz et al., *Temporally-Weighted Hierarchical Clustering for Unsupervised Action Segmentation*,
CVPR 2021. Every frame is joined with its nearest neighbour, where the distance is the difference in
appearance times the distance in time; the groups are averaged and joined again until few enough are
left. The last joins, down to the number asked for, are made pair by pair (their algorithm 2). It
uses a single video; `discovery` relates the parts of different videos.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from teasim.common.arrays import Array

Labels = NDArray[np.int64]


def partition(moments: Array, parts: int) -> Labels:
    """Return the part (n,) of each frame of a video, 0..parts-1.

    A part may occur again after another one. Fewer than `parts` frames are a part each.

    Args:
        moments: (n, F) features.
        parts: number of parts, 1 or more.
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
