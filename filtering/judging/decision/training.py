"""Learning the decision from drawn pools: networks, then a calibration on pools held back."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits as cross_entropy

from filtering.judging.decision.calibration import Batch, calibrated, pad
from filtering.judging.decision.drawing import Lesson
from filtering.judging.decision.model import DecisionModel, rounded
from filtering.judging.decision.network import DecisionNetwork, Shape, squash
from filtering.judging.decision.prior.pools import FACTS
from filtering.vision.determinism import seeded


@dataclass(frozen=True)
class LearningConfig:
    """How networks are fitted."""

    seed: int = 0
    """Seed of the first network; the others have the numbers after it."""
    networks: int = 4
    """Number of networks whose logits are averaged."""
    epochs: int = 6
    """Passes over the pools."""
    batch: int = 32
    """Pools per step."""
    rate: float = 2e-3
    """Largest learning rate of AdamW; one cycle."""
    decay: float = 0.02
    """Weight decay of AdamW."""
    dropout: float = 0.1
    """Share of the columns left out at random."""
    facts: float = 0.1
    """Weight of the loss of the facts about the pool."""
    held_back: float = 0.1
    """Share of the pools, the last ones, for the calibration."""


Log = Callable[[str], None]
"""Receives a line about the progress."""


def learn(lessons: Sequence[Lesson], config: LearningConfig, log: Log = print) -> DecisionModel:
    """Fit networks to all lessons but the last ones, and calibrate on those."""
    kept = round(len(lessons) * (1 - config.held_back))
    networks = []
    for number in range(config.networks):
        with seeded(config.seed + number):
            networks.append(_fit(lessons[:kept], config, number, log))
    return calibrated(tuple(networks), lessons[kept:], {"learning": asdict(config)})


def _fit(
    lessons: Sequence[Lesson], config: LearningConfig, number: int, log: Log
) -> DecisionNetwork:
    rng = np.random.default_rng([config.seed, number])
    shape = Shape(lessons[0].rows.shape[1], lessons[0].pairs.shape[2], len(FACTS))
    network = DecisionNetwork(shape, config.dropout)
    _standardise(network, lessons)
    steps = len(lessons) // config.batch
    optimiser = torch.optim.AdamW(network.parameters(), config.rate, weight_decay=config.decay)
    plan = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, config.rate, total_steps=config.epochs * steps + 1, pct_start=0.15
    )
    network.train()
    for epoch in range(config.epochs):
        losses = []
        for rows in _like_sizes(rng, lessons, steps):
            loss = _loss(network, pad([lessons[row] for row in rows]), config.facts)
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            plan.step()
            losses.append(float(loss.detach()))
        log(f"network {number + 1}, epoch {epoch + 1}: loss {np.mean(losses):.4f}")
    return rounded(network)


def _standardise(network: DecisionNetwork, lessons: Sequence[Lesson]) -> None:
    some = squash(torch.from_numpy(np.concatenate([lesson.rows for lesson in lessons[:3000]])))
    network.centre.copy_(some.mean(0))
    network.scale.copy_(some.std(0) + 0.05)


def _like_sizes(
    rng: np.random.Generator, lessons: Sequence[Lesson], steps: int
) -> list[NDArray[np.int64]]:
    """Return batches in random order; pools of like size go together, to pad little."""
    sizes = np.array([len(lesson.rows) for lesson in lessons])
    order = np.argsort(sizes * np.exp(0.1 * rng.normal(size=len(sizes))))
    batches = np.array_split(order, steps)
    return [batches[number] for number in rng.permutation(len(batches))]


def _loss(network: DecisionNetwork, batch: Batch, facts_weight: float) -> Tensor:
    """Return the cross-entropy; a pool of D demonstrations counts as sqrt(D)."""
    logits, facts = network(batch.rows, batch.pairs, batch.mask)
    weight = batch.mask.float() / batch.mask.sum(1, keepdim=True).float().sqrt()
    each = cross_entropy(logits, batch.incorrect, reduction="none") * weight
    return each.sum() / weight.sum() + facts_weight * cross_entropy(facts, batch.facts)
