"""Save and load a bottleneck: bottleneck.safetensors (weights) and bottleneck.json (what it is)."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load as load_tensors
from safetensors.torch import save as save_tensors

from filtering.features.bottleneck import Bottleneck, BottleneckNetwork
from filtering.features.config import BottleneckConfig, TrainingConfig
from teasim.errors import CheckpointError, ConfigError
from teasim.pool.files import write_atomically, write_json

FORMAT = "teasim-bottleneck"
VERSION = 1
WEIGHTS_FILE = "bottleneck.safetensors"
DESCRIPTION_FILE = "bottleneck.json"


def save_bottleneck(bottleneck: Bottleneck, folder: Path) -> None:
    """Write a fitted `bottleneck` into `folder`, which is made when it does not exist."""
    network = bottleneck.network_
    weights = save_tensors(network.state_dict())
    description = {
        "format": FORMAT,
        "version": VERSION,
        "config": asdict(bottleneck.config),
        "inputs": len(network.map_mean),
        "classes": network.head.out_features,
        "history": list(bottleneck.history_),
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
    }

    def fill(target: Path) -> None:
        target.write_bytes(weights)

    write_atomically(folder / WEIGHTS_FILE, fill)
    # Last, so that a folder with a description always holds a whole bottleneck.
    write_json(folder / DESCRIPTION_FILE, description)


def load_bottleneck(folder: Path) -> Bottleneck:
    """Read a bottleneck that `save_bottleneck` wrote.

    Raises:
        CheckpointError: `folder` holds none, one of another version, or a damaged one.
    """
    description = _read_description(folder / DESCRIPTION_FILE)
    weights = _read(folder / WEIGHTS_FILE)
    if hashlib.sha256(weights).hexdigest() != description.get("weights_sha256"):
        raise CheckpointError(
            f"'{folder / WEIGHTS_FILE}' is damaged: it is not the file that was saved; train again."
        )
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
        raise CheckpointError(
            f"'{folder / DESCRIPTION_FILE}' does not describe the weights beside it; train again."
        ) from error


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


def _read_description(path: Path) -> dict[str, Any]:
    try:
        description = json.loads(_read(path))
    except ValueError as error:
        raise CheckpointError(f"'{path}' is damaged: it is not JSON; train again.") from error
    if not isinstance(description, dict) or description.get("format") != FORMAT:
        raise CheckpointError(f"'{path}' does not describe a bottleneck of this program.")
    if description.get("version") != VERSION:
        raise CheckpointError(
            f"'{path}' has version {description.get('version')}, this program reads {VERSION}; "
            "train again."
        )
    return description


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise CheckpointError(
            f"'{path.parent}' holds no trained bottleneck: {path.name} cannot be read."
        ) from error
