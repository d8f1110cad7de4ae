"""Save and load an effect reader: effects.safetensors (weights), effects.json (what they are)."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.numpy import load as load_arrays
from safetensors.numpy import save as save_arrays

from filtering.effects.reader import Effect, EffectReader
from filtering.vision.frame_features import FrameSource
from filtering.vision.pretrained import describe_fitted, feature_recipe
from teasim.common.checkpoint import CheckpointKind
from teasim.common.errors import ConfigError

EFFECTS = CheckpointKind("effects", 1, held="effect reader", remedy="fit again")
PER_EFFECT = ("errors", "accuracies", "certainties")
"""What the description says of each effect."""


def save_effects(reader: EffectReader, folder: Path) -> None:
    """Write `reader` into `folder`, which may hold a segmenter too.

    Raises:
        OSError: the folder cannot be written.
    """
    description = {
        "effects": [asdict(effect) for effect in reader.effects],
        "source": asdict(reader.source),
        "features": feature_recipe(),
        **{name: list(getattr(reader, name)) for name in PER_EFFECT},
    }
    EFFECTS.save(folder, save_arrays({"weights": reader.weights}), description)


def load_effects(folder: Path) -> EffectReader:
    """Read an effect reader that `save_effects` wrote.

    Raises:
        CheckpointError: `folder` holds none, one of another version or for other features, or a
            damaged one.
    """
    description = describe_fitted(EFFECTS, folder)
    weights = EFFECTS.weights(folder, description)
    try:
        return _reader(description, weights)
    except (AttributeError, KeyError, TypeError, ValueError, ConfigError, SafetensorError) as error:
        raise EFFECTS.mismatch(folder) from error


def _reader(description: Mapping[str, Any], weights: bytes) -> EffectReader:
    effects = tuple(Effect(**stored) for stored in description["effects"])
    source = description["source"]
    numbers = {name: tuple(map(float, description[name])) for name in PER_EFFECT}
    array = load_arrays(weights)["weights"]
    if array.ndim != 2 or {len(array), *map(len, numbers.values())} != {len(effects)}:
        raise ValueError("one row of weights and one of each number per effect")
    return EffectReader(
        effects=effects,
        weights=array,
        source=FrameSource(tuple(source["cameras"]), float(source["rate"])),
        **numbers,
    )
