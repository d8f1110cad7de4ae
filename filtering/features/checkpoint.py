"""Save and load a bottleneck: bottleneck.safetensors (weights) and bottleneck.json (what it is)."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load as load_tensors
from safetensors.torch import save as save_tensors

from filtering.features.bottleneck import Bottleneck, BottleneckNetwork
from filtering.features.config import BottleneckConfig, TrainingConfig
from teasim.errors import ConfigError
from teasim.pool.checkpoint import CheckpointKind

BOTTLENECK = CheckpointKind("bottleneck", 1, held="trained bottleneck", remedy="train again")


def save_bottleneck(bottleneck: Bottleneck, folder: Path) -> None:
    """Write a fitted `bottleneck` into `folder`, which is made when it does not exist."""
    network = bottleneck.network_
    description = {
        "config": asdict(bottleneck.config),
        "inputs": len(network.map_mean),
        "classes": network.head.out_features,
        "history": list(bottleneck.history_),
    }
    BOTTLENECK.save(folder, save_tensors(network.state_dict()), description)


def load_bottleneck(folder: Path) -> Bottleneck:
    """Read a bottleneck that `save_bottleneck` wrote.

    Raises:
        CheckpointError: `folder` holds none, one of another version, or a damaged one.
    """
    description = BOTTLENECK.describe(folder)
    weights = BOTTLENECK.weights(folder, description)
    try:
        return _restore(description, weights)
    except (
        ConfigError,
        KeyError,
        TypeError,
        ValueError,
        RuntimeError,
        SafetensorError,
    ) as error:
        raise BOTTLENECK.mismatch(folder) from error


def _restore(description: dict[str, Any], weights: bytes) -> Bottleneck:
    training = TrainingConfig(**description["config"]["training"])
    config = BottleneckConfig(description["config"]["channels"], training)
    network = BottleneckNetwork(
        description["inputs"], config.channels, description["classes"], training.seed
    )
    network.load_state_dict(load_tensors(weights))
    bottleneck = Bottleneck(config)
    bottleneck.network_ = network.eval()
    bottleneck.history_ = tuple(description["history"])
    return bottleneck
