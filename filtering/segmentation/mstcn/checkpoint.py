"""Save and load a segmenter: segmenter.safetensors (weights), segmenter.json (what they are)."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load as load_tensors

from filtering.segmentation.mstcn.network import MSTCN, MSTCNShape
from filtering.segmentation.mstcn.segmenter import MSTCNSegmenter
from filtering.segmentation.scaling import SCALINGS
from filtering.vision.determinism import seeded
from filtering.vision.frame_features import FrameSource
from filtering.vision.pretrained import describe_fitted, feature_recipe
from teasim.common.checkpoint import CheckpointKind
from teasim.common.errors import ConfigError

SEGMENTER = CheckpointKind("segmenter", 2, held="segmenter", remedy="fit again")


def save_segmenter(segmenter: MSTCNSegmenter, folder: Path, record: Mapping[str, Any]) -> None:
    """Write `segmenter` into `folder`; `record` (JSON-able) says how it came about.

    Raises:
        OSError: the folder cannot be written.
    """
    description = {
        "subtasks": segmenter.subtasks,
        "network": asdict(segmenter.network.shape),
        "source": asdict(segmenter.source),
        "features": feature_recipe(),
        "scaling": segmenter.scaling,
        "shortest": segmenter.shortest,
        "labelled": sorted(segmenter.labelled),
        "record": dict(record),
    }
    SEGMENTER.save(folder, segmenter.weights(), description)


def load_segmenter(folder: Path) -> MSTCNSegmenter:
    """Read a segmenter that `save_segmenter` wrote.

    Raises:
        CheckpointError: `folder` holds no segmenter, one of another version or for other features,
            or a damaged one.
    """
    description = describe_fitted(SEGMENTER, folder)
    weights = SEGMENTER.weights(folder, description)
    try:
        return _segmenter(description, weights)
    except (KeyError, TypeError, ValueError, RuntimeError, ConfigError, SafetensorError) as error:
        raise SEGMENTER.mismatch(folder) from error


def _segmenter(description: Mapping[str, Any], weights: bytes) -> MSTCNSegmenter:
    subtasks = tuple(str(name) for name in description["subtasks"])
    with seeded(0):  # the random weights are thrown away at once
        network = MSTCN(MSTCNShape(**description["network"]))
    if network.shape.labels - len(subtasks) not in (0, 1):
        raise ValueError("one label per sub-task, and at most one for none")
    if description["scaling"] not in SCALINGS:
        raise ValueError("unknown scaling")
    shortest = tuple(float(seconds) for seconds in description["shortest"])
    if len(shortest) != network.shape.labels:
        raise ValueError("one least length per label")
    network.load_state_dict(load_tensors(weights))
    source = description["source"]
    return MSTCNSegmenter(
        network=network.eval(),
        subtasks=subtasks,
        source=FrameSource(tuple(source["cameras"]), float(source["rate"])),
        scaling=description["scaling"],
        shortest=shortest,
        labelled=frozenset(map(str, description["labelled"])),
    )
