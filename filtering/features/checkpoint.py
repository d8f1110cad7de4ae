"""Save and load learned features: a bottleneck, and the generator that goes with it.

Two files each, bottleneck.safetensors (weights) and bottleneck.json (what it is), and generator.*.
"""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load as load_tensors
from safetensors.torch import save as save_tensors

from filtering.features.bottleneck import Bottleneck, BottleneckNetwork
from filtering.features.config import (
    BottleneckConfig,
    ClassifierConfig,
    GeneratorConfig,
    TrainingConfig,
)
from filtering.features.generator import FeatureGenerator
from filtering.features.learned import LearnedFeatures, LookConfig
from filtering.vision.background import subtraction_named
from filtering.vision.pretrained import Backbone, describe_fitted
from teasim.common.checkpoint import CheckpointKind
from teasim.common.errors import ConfigError

BOTTLENECK = CheckpointKind("bottleneck", 1, held="trained bottleneck", remedy="train again")
GENERATOR = CheckpointKind("generator", 1, held="learned features", remedy="train again")
DAMAGED = (
    AttributeError,
    ConfigError,
    KeyError,
    TypeError,
    ValueError,
    RuntimeError,
    SafetensorError,
)
"""What a description of other weights than those beside it leads to."""


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
    except DAMAGED as error:
        raise BOTTLENECK.mismatch(folder) from error


def save_features(learned: LearnedFeatures, folder: Path) -> None:
    """Write `learned` into `folder`, which may hold a segmenter too."""
    save_bottleneck(learned.bottleneck, folder)
    generator = learned.generator
    network = generator.classifier_.network_
    fitted = {
        "thresholds": torch.from_numpy(generator.thresholds_),
        "importance": torch.from_numpy(generator.importance_),
        "kept": torch.from_numpy(generator.kept_),
    }
    weights = {f"classifier.{name}": value for name, value in network.state_dict().items()}
    description = {
        "config": asdict(generator.config),
        "look": asdict(learned.look),
        "features": learned.look.backbone.recipe(),
        "history": list(generator.classifier_.history_),
    }
    GENERATOR.save(folder, save_tensors(fitted | weights), description)


def load_features(folder: Path) -> LearnedFeatures:
    """Read learned features that `save_features` wrote.

    Raises:
        CheckpointError: `folder` holds none, some of another version or for other feature maps, or
            damaged ones.
    """
    description = describe_fitted(GENERATOR, folder, "feature maps", _backbone)
    weights = GENERATOR.weights(folder, description)
    bottleneck = load_bottleneck(folder)
    try:
        generator = _restore_generator(description, weights)
        look = LookConfig(**description["look"] | {"backbone": _backbone(description)})
        subtraction_named(look.background)
    except DAMAGED as error:
        raise GENERATOR.mismatch(folder) from error
    if bottleneck.config.channels != len(generator.thresholds_):
        raise GENERATOR.mismatch(folder)
    return LearnedFeatures(look, bottleneck, generator)


def _backbone(description: dict[str, Any]) -> Backbone:
    """Return the network of a description; one that names none used the usual one."""
    look = description.get("look")
    named = look.get("backbone") if isinstance(look, dict) else None
    if not isinstance(named, dict):
        return Backbone()
    return Backbone(str(named.get("name")), str(named.get("weights")))


def _restore_generator(description: dict[str, Any], weights: bytes) -> FeatureGenerator:
    from filtering.features.graphs.rgcn import GraphClassifier, GraphNetwork

    stored = description["config"]
    classifier = stored["classifier"]
    training = TrainingConfig(**classifier["training"])
    config = GeneratorConfig(
        **stored | {"classifier": ClassifierConfig(**classifier | {"training": training})}
    )
    tensors = load_tensors(weights)
    generator = FeatureGenerator(config)
    generator.thresholds_ = tensors.pop("thresholds").numpy()
    generator.importance_ = tensors.pop("importance").numpy()
    generator.kept_ = tensors.pop("kept").numpy()
    classes, channels = generator.importance_.shape
    network = GraphNetwork(channels, classes, config.classifier)
    network.load_state_dict(
        {name.removeprefix("classifier."): value for name, value in tensors.items()}
    )
    generator.classifier_ = GraphClassifier(config.classifier)
    generator.classifier_.network_ = network.eval()
    generator.classifier_.history_ = tuple(description["history"])
    return generator


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
