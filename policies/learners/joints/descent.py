"""Gradient descent of the networks that plan joint targets: a schedule, and averaged weights."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from filtering.vision.determinism import one_thread
from teasim.common.errors import ConfigError

WARM_UP = 0.03
"""Share of the steps in which the learning rate rises from 0; afterwards it falls as a cosine."""
LARGEST_GRADIENT = 1.0
"""Norm to which a larger gradient is reduced."""
AVERAGED_EVERY = 10
"""Steps from one update of the averaged weights to the next."""
RECORDS = 200
"""Largest number of losses that are kept: means over equal parts of the descent."""


@dataclass(frozen=True)
class PlanConfig:
    """Settings that the learners of joint targets share."""

    chunk: int = 10
    """K, control steps (0.1 s) planned ahead."""
    ensemble: float = 0.8
    """Weight of the plan of the step before in the joined plan; 0: only the newest plan counts."""
    batch: int = 64
    """Control steps per sub-task in a gradient step."""
    emphasis: float = 3.0
    """Weight of a control step before a gripper opens or closes; 1: like the others."""
    steps: int = 12000
    """Gradient steps."""
    learning_rate: float = 1e-3
    """Largest step size of AdamW."""
    weight_decay: float = 1e-3
    """Decoupled weight decay of AdamW [1/step, times the learning rate]."""
    averaging: float = 0.98
    """Share of the averaged weights that remains when they are updated, every 10 steps."""
    width: int = 256
    """W, size of the layers."""
    blocks: int = 2
    """Residual blocks of two layers each."""
    seed: int = 0
    """Seed of the initial weights and of what is drawn."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        if self.steps < 1 or self.learning_rate <= 0 or self.weight_decay < 0:
            raise ConfigError(
                "A learner needs steps >= 1, learning_rate > 0 and weight_decay >= 0."
            )
        if self.chunk < 1 or self.batch < 1 or not 0 <= self.ensemble < 1 or self.emphasis <= 0:
            raise ConfigError(
                "A learner of joint targets needs chunk >= 1, batch >= 1, 0 <= ensemble < 1 and "
                "emphasis > 0."
            )
        if self.width < 1 or self.blocks < 0 or not 0 <= self.averaging < 1:
            raise ConfigError(
                "A learner of joint targets needs width >= 1, blocks >= 0 and 0 <= averaging < 1."
            )


def descend(
    network: nn.Module, losses: Callable[[int], Tensor], config: PlanConfig
) -> tuple[float, ...]:
    """Minimise the loss and leave the averaged weights in `network`.

    Args:
        network: Its parameters are changed.
        losses: (step) -> the loss to reduce in this step.
        config: Number of steps and settings of the optimiser.

    Returns:
        The loss in equal parts of the descent, at most 200 numbers.
    """
    parameters = list(network.parameters())
    averaged = [parameter.detach().clone() for parameter in parameters]
    optimizer = torch.optim.AdamW(
        parameters, lr=config.learning_rate, weight_decay=config.weight_decay, fused=True
    )
    schedule = torch.optim.lr_scheduler.LambdaLR(optimizer, lambda step: _rate(step, config.steps))
    history = []
    with one_thread():
        for step in range(config.steps):
            optimizer.zero_grad()
            loss = losses(step)
            loss.backward()
            nn.utils.clip_grad_norm_(parameters, LARGEST_GRADIENT)
            optimizer.step()
            schedule.step()
            history.append(loss.item())
            if step % AVERAGED_EVERY == 0 or step == config.steps - 1:
                _average(averaged, parameters, min(config.averaging, step / (step + 100)))
    with torch.no_grad():
        for parameter, mean in zip(parameters, averaged, strict=True):
            parameter.copy_(mean)
    parts = np.array_split(np.array(history), min(RECORDS, len(history)))
    return tuple(float(part.mean()) for part in parts)


def _rate(step: int, steps: int) -> float:
    """Share of the largest learning rate in a step."""
    warm = max(WARM_UP * steps, 1.0)
    if step < warm:
        return (step + 1) / (warm + 1)
    return 0.5 * (1 + float(np.cos(np.pi * (step - warm) / max(steps - warm, 1.0))))


@torch.no_grad()
def _average(averaged: list[Tensor], parameters: list[nn.Parameter], keep: float) -> None:
    for mean, parameter in zip(averaged, parameters, strict=True):
        mean.lerp_(parameter, 1 - keep)
