"""Importance of channels by erasure (paper section 3.2).

Erasure (Li, Monroe, Jurafsky, arXiv:1612.08220): channel k matters to class c as much as the
classifier's score for c falls when the channel is really taken out of its input,

    importance(c, k) = mean over clips of (logit_c - logit_c without k) / logit_c.

A softmax does not change when all logits are shifted, but this quotient does. So logits are centred
first (mean 0 over the classes), and the clips are those of class c that the classifier recognises:
their logit_c is the largest, hence above 0, and a loss of it never counts as a gain.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from filtering.features.graphs.intervals import Activations, Intervals

DecisionFunction = Callable[[Sequence[Intervals]], NDArray[np.float64]]
"""A classifier: intervals of S clips to logits (S, T)."""


def erasure_importance(
    decide: DecisionFunction, clips: Sequence[Intervals], labels: NDArray[np.int64], channels: int
) -> NDArray[np.float64]:
    """Return the importance (T, N) of each channel to each class; N = `channels`.

    1 means that without the channel nothing speaks for the class any more, 0 that nothing changes,
    below 0 that the class is clearer without it. A class that is never recognised gets 0.

    Args:
        decide: the classifier.
        clips: intervals of S clips.
        labels: (S,) their classes, 0..T-1.
        channels: N.
    """
    logits = _centred(decide(clips))
    recognised = np.flatnonzero((logits.argmax(axis=1) == labels) & (np.ptp(logits, axis=1) > 0))
    importance = np.zeros((logits.shape[1], channels))
    if not len(recognised):
        return importance
    kept = [clips[number] for number in recognised.tolist()]
    classes = labels[recognised]
    scores = logits[recognised, classes]
    counts = np.bincount(classes, minlength=len(importance))
    for channel in range(channels):
        erased = _centred(decide([clip.without([channel]) for clip in kept]))
        losses = (scores - erased[np.arange(len(recognised)), classes]) / scores
        sums = np.bincount(classes, losses, minlength=len(importance))
        importance[:, channel] = sums / np.maximum(counts, 1)
    return importance


def rank_channels(importance: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return all channels (N,), the most important first, from importance (T, N).

    A channel counts by the class that needs it most: one sub-task may be seen in one channel alone.
    """
    return np.argsort(-importance.max(axis=0), kind="stable")


def max_over_time(
    activations: Sequence[Activations], kept: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return (S, N) from the activations (n, N) of S segments: the strongest over time.

    Args:
        activations: of each segment.
        kept: channels that stay; the others are 0.
    """
    features = np.zeros((len(activations), activations[0].shape[1]))
    for row, segment in zip(features, activations, strict=True):
        row[kept] = segment[:, kept].max(axis=0)
    return features


def _centred(logits: NDArray[np.float64]) -> NDArray[np.float64]:
    return logits - logits.mean(axis=1, keepdims=True)
