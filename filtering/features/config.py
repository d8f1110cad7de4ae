"""Settings of the learned features (paper section 3.2); here, so that they need no torch."""

from dataclasses import dataclass, field

from teasim.common.errors import ConfigError

POOLED = "pooled"
"""Name of the features without learning: mean and maximum over time of the pretrained network."""
LAYERS = ("relations", "nodes")
"""Kinds of graph layers: relational ones, or ones that see each node alone."""


@dataclass(frozen=True)
class TrainingConfig:
    """How a network is trained: AdamW on the cross-entropy of shuffled mini-batches."""

    epochs: int = 40
    """Times that every clip is used."""
    batch: int = 8
    """Clips per gradient step."""
    learning_rate: float = 1e-3
    """Step size of AdamW."""
    weight_decay: float = 1e-2
    """Decoupled weight decay of AdamW [1/step, times the learning rate]."""
    seed: int = 0
    """Seed of the initial weights and of the order of the clips."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        if self.epochs < 1 or self.batch < 1:
            raise ConfigError(
                f"epochs is {self.epochs} and batch is {self.batch}; choose 1 or more for both."
            )
        if not self.learning_rate > 0:
            raise ConfigError(f"learning_rate is {self.learning_rate}; choose a number above 0.")
        if not self.weight_decay >= 0:
            raise ConfigError(f"weight_decay is {self.weight_decay}; choose 0 or more.")


@dataclass(frozen=True)
class BottleneckConfig:
    """Settings of the bottleneck that turns feature maps into activations."""

    channels: int = 32
    """N, channels behind the 1x1 convolution."""
    training: TrainingConfig = field(default=TrainingConfig(epochs=20, learning_rate=1e-2))
    """How it is trained."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a bottleneck without channels."""
        if self.channels < 1:
            raise ConfigError(f"channels is {self.channels}; choose 1 or more.")


@dataclass(frozen=True)
class ClassifierConfig:
    """Settings of the network that names the sub-task of a graph of intervals."""

    layers: str = "relations"
    """Kind of layers: relations (R-GCN), or nodes (without edges, for comparison)."""
    hidden: int = 512
    """Width of both layers."""
    training: TrainingConfig = field(default=TrainingConfig())
    """How it is trained."""

    def __post_init__(self) -> None:
        """Raise ConfigError for unknown layers or ones without width."""
        if self.layers not in LAYERS:
            raise ConfigError(f"Unknown layers '{self.layers}'; choose {', '.join(LAYERS)}.")
        if self.hidden < 1:
            raise ConfigError(f"hidden is {self.hidden}; choose 1 or more.")


@dataclass(frozen=True)
class GeneratorConfig:
    """Settings of the feature generator."""

    structure: int = 3
    """Length of the structuring element: shorter gaps are closed, shorter intervals dropped
    [activation frames]."""
    kept_channels: int = 16
    """Channels that stay in the features, those of the highest importance."""
    classifier: ClassifierConfig = field(default=ClassifierConfig())
    """The network whose decisions say which channels matter."""

    def __post_init__(self) -> None:
        """Raise ConfigError for lengths or counts below 1."""
        if self.structure < 1:
            raise ConfigError(f"structure is {self.structure}; choose 1 or more frames.")
        if self.kept_channels < 1:
            raise ConfigError(f"kept_channels is {self.kept_channels}; choose 1 or more.")
