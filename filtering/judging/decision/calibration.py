"""Batches of drawn pools, and the calibration on those that were held back."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.special import expit
from sklearn.linear_model import LogisticRegression
from torch import Tensor

from filtering.judging.decision.drawing import Lesson
from filtering.judging.decision.model import DecisionModel, Line
from filtering.judging.decision.network import DecisionNetwork, squash
from filtering.judging.decision.prior.pools import FACTS
from teasim.common.arrays import Array


@dataclass(frozen=True)
class Batch:
    """Pools padded to one size."""

    rows: Tensor
    """(B, D, F) squashed columns."""
    pairs: Tensor
    """(B, D, D, P) columns of pairs."""
    mask: Tensor
    """(B, D) False for padding."""
    incorrect: Tensor
    """(B, D) truth."""
    facts: Tensor
    """(B, 4) truth about the pools."""


def pad(lessons: Sequence[Lesson]) -> Batch:
    """Return lessons as one batch."""
    number, most = len(lessons), max(len(lesson.rows) for lesson in lessons)
    rows = torch.zeros(number, most, lessons[0].rows.shape[1])
    pairs = torch.zeros(number, most, most, lessons[0].pairs.shape[2])
    mask = torch.zeros(number, most, dtype=torch.bool)
    incorrect = torch.zeros(number, most)
    for row, lesson in enumerate(lessons):
        demos = len(lesson.rows)
        rows[row, :demos] = torch.from_numpy(lesson.rows)
        pairs[row, :demos, :demos] = torch.from_numpy(lesson.pairs)
        mask[row, :demos] = True
        incorrect[row, :demos] = torch.from_numpy(lesson.incorrect).float()
    facts = torch.from_numpy(np.stack([lesson.facts for lesson in lessons])).float()
    return Batch(squash(rows), pairs, mask, incorrect, facts)


def calibrated(
    networks: tuple[DecisionNetwork, ...], lessons: Sequence[Lesson], card: dict[str, object]
) -> DecisionModel:
    """Return a model whose logits fit the truth of pools that the networks have not seen."""
    raw = DecisionModel(networks, (1.0, 0.0), {}, {})
    logits, facts, truth = [], [], []
    for start in range(0, len(lessons), 32):
        batch = pad(lessons[start : start + 32])
        demos, pools = raw.mean_logits(batch.rows, batch.pairs, batch.mask)
        logits.append(demos[batch.mask.numpy()])
        truth.append(batch.incorrect[batch.mask].numpy())
        facts.append(pools)
    every, incorrect = np.concatenate(logits), np.concatenate(truth)
    pools, stated = np.concatenate(facts), np.stack([lesson.facts for lesson in lessons])
    demo = _line(every, incorrect)
    lines = {name: _line(pools[:, k], stated[:, k]) for k, name in enumerate(FACTS)}
    measured = calibration(expit(demo[0] * every + demo[1]), incorrect.astype(np.float64))
    return DecisionModel(networks, demo, lines, card | {"held back": measured})


def _line(logits: Array, truth: NDArray[np.generic]) -> Line:
    if len(np.unique(truth)) < 2:
        return 1.0, 0.0
    fitted = LogisticRegression(C=1e6).fit(logits[:, None], truth)
    return float(fitted.coef_[0, 0]), float(fitted.intercept_[0])


def calibration(p: Array, truth: Array, bins: int = 10) -> dict[str, object]:
    """Return the expected calibration error, the Brier score, and the reliability diagram.

    Args:
        p: (n,) probabilities.
        truth: (n,) 0 or 1.
        bins: number of bins of equal width.
    """
    place = np.minimum((p * bins).astype(int), bins - 1)
    used = [place == number for number in range(bins) if (place == number).any()]
    diagram = [(int(at.sum()), float(p[at].mean()), float(truth[at].mean())) for at in used]
    base = float(truth.mean())
    return {
        "ece": sum(number * abs(mean - share) for number, mean, share in diagram) / len(p),
        "brier": float(((p - truth) ** 2).mean()),
        "brier of the base rate": base * (1 - base),
        "diagram": diagram,
    }
