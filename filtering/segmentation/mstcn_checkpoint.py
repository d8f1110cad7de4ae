"""Save and load a segmenter: segmenter.safetensors (weights), segmenter.json (what they are)."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load as load_tensors

from filtering.determinism import seeded
from filtering.frame_features import FrameSource
from filtering.pretrained import RECIPE, weights_digest
from filtering.segmentation.mstcn import MSTCN, MSTCNShape
from filtering.segmentation.mstcn_segmenter import MSTCNSegmenter
from filtering.segmentation.mstcn_training import SCALINGS
from teasim.errors import CheckpointError, ConfigError
from teasim.pool.files import write_bytes, write_json

FORMAT = "teasim-segmenter"
VERSION = 1
WEIGHTS_FILE = "segmenter.safetensors"
DESCRIPTION_FILE = "segmenter.json"


def save_segmenter(segmenter: MSTCNSegmenter, folder: Path, record: Mapping[str, Any]) -> None:
    """Write `segmenter` into `folder`; `record` (JSON-able) says how it came about.

    Raises:
        OSError: the folder cannot be written.
    """
    weights = segmenter.weights()
    description = {
        "format": FORMAT,
        "version": VERSION,
        "subtasks": segmenter.subtasks,
        "network": asdict(segmenter.network.shape),
        "source": asdict(segmenter.source),
        "features": _feature_recipe(),
        "scaling": segmenter.scaling,
        "shortest": segmenter.shortest,
        "labelled": sorted(segmenter.labelled),
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
        "record": dict(record),
    }
    write_bytes(folder / WEIGHTS_FILE, weights)
    # Last, so that a folder with a description always holds a whole segmenter.
    write_json(folder / DESCRIPTION_FILE, description)


def load_segmenter(folder: Path) -> MSTCNSegmenter:
    """Read a segmenter that `save_segmenter` wrote.

    Raises:
        CheckpointError: `folder` holds no segmenter, one of another version or for other features,
            or a damaged one.
    """
    description = _read_description(folder)
    weights = _read(folder / WEIGHTS_FILE)
    if hashlib.sha256(weights).hexdigest() != description.get("weights_sha256"):
        raise CheckpointError(
            f"'{folder / WEIGHTS_FILE}' is damaged: it is not the file that was saved; fit again."
        )
    try:
        return _segmenter(description, weights)
    except (KeyError, TypeError, ValueError, RuntimeError, ConfigError, SafetensorError) as error:
        raise CheckpointError(
            f"'{folder / DESCRIPTION_FILE}' does not describe the weights beside it; fit again."
        ) from error


def _segmenter(description: Mapping[str, Any], weights: bytes) -> MSTCNSegmenter:
    subtasks = tuple(str(name) for name in description["subtasks"])
    with seeded(0):  # the random weights are thrown away at once
        network = MSTCN(MSTCNShape(**description["network"]))
    if network.shape.labels - len(subtasks) not in (0, 1):
        raise ValueError("one label per sub-task, and at most one for none")
    if description["scaling"] not in SCALINGS:
        raise ValueError("unknown scaling")
    network.load_state_dict(load_tensors(weights))
    source = description["source"]
    return MSTCNSegmenter(
        network=network.eval(),
        subtasks=subtasks,
        source=FrameSource(tuple(source["cameras"]), float(source["rate"])),
        scaling=description["scaling"],
        shortest=float(description["shortest"]),
        labelled=frozenset(map(str, description["labelled"])),
    )


def _read_description(folder: Path) -> dict[str, Any]:
    path = folder / DESCRIPTION_FILE
    try:
        description = json.loads(_read(path))
    except ValueError as error:
        raise CheckpointError(f"'{path}' is damaged: it is not JSON; fit again.") from error
    if not isinstance(description, dict) or description.get("format") != FORMAT:
        raise CheckpointError(f"'{path}' does not describe a segmenter of this program.")
    if description.get("version") != VERSION:
        raise CheckpointError(
            f"'{path}' has version {description.get('version')}, this program reads {VERSION}; "
            "fit again."
        )
    if description.get("features") != _feature_recipe():
        raise CheckpointError(
            f"'{path}' was fitted to other features of a frame than this program computes; "
            "fit again."
        )
    return description


def _feature_recipe() -> list[str]:
    """Return what a frame's features are computed by; changes whenever they do."""
    return [RECIPE, weights_digest()]


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise CheckpointError(
            f"'{path.parent}' holds no segmenter: {path.name} cannot be read."
        ) from error
