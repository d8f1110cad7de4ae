"""How the networks of the features are trained: one thread, own random numbers, cross-entropy."""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import cross_entropy

from filtering.features.config import TrainingConfig
from filtering.vision.determinism import one_thread
from teasim.common.errors import ConfigError

Forward = Callable[[Sequence[int]], Tensor]
"""Logits (b, T) of the clips with the given numbers."""


def class_labels(labels: Sequence[int], clips: int) -> tuple[NDArray[np.int64], int]:
    """Return the labels (S,) of `clips` clips and T, one more than the largest.

    Raises:
        ConfigError: there is no choice to learn, or labels and clips differ in number.
    """
    numbers = np.asarray(labels, dtype=np.int64)
    if len(numbers) != clips:
        raise ConfigError(f"There are {clips} clips but {len(numbers)} labels; give one for each.")
    if len(np.unique(numbers)) < 2:
        raise ConfigError(
            "The features are learned by telling sub-tasks apart; "
            f"give clips of at least 2, not {len(np.unique(numbers))}."
        )
    if numbers.min() < 0:
        raise ConfigError(f"A label is {numbers.min()}; choose 0 or more.")
    return numbers, int(numbers.max()) + 1


def train(
    network: nn.Module, forward: Forward, labels: NDArray[np.int64], config: TrainingConfig
) -> tuple[float, ...]:
    """Minimise the cross-entropy of `labels` (S,); return its mean in each epoch [nats].

    The same seed, clips and labels give the same bits.
    """
    targets = torch.from_numpy(labels)
    order = np.random.default_rng(config.seed)
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay
    )
    history = []
    network.train()
    with one_thread():
        for _ in range(config.epochs):
            total = 0.0
            shuffled = order.permutation(len(labels)).tolist()
            for chosen in batches(shuffled, config.batch):
                optimizer.zero_grad()
                loss = cross_entropy(forward(chosen), targets[chosen])
                loss.backward()
                optimizer.step()
                total += loss.item() * len(chosen)
            history.append(total / len(labels))
    network.eval()
    return tuple(history)


def predict_logits(
    network: nn.Module, forward: Forward, clips: int, batch: int
) -> NDArray[np.float64]:
    """Return the logits (S, T) of `clips` clips."""
    network.eval()
    with one_thread(), torch.inference_mode():
        parts = [forward(chosen) for chosen in batches(range(clips), batch)]
    logits: NDArray[np.float64] = torch.cat(parts).double().numpy()
    return logits


def batches(numbers: Sequence[int], size: int) -> list[list[int]]:
    """Cut `numbers` into lists of `size`; the last may be shorter."""
    return [list(numbers[first : first + size]) for first in range(0, len(numbers), size)]
