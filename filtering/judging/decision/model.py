"""The fitted decision: networks whose logits are averaged and calibrated, in one checkpoint."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.torch import load as load_tensors
from safetensors.torch import save as save_tensors

from filtering.judging.decision.description import Description
from filtering.judging.decision.network import DecisionNetwork, Shape, squash
from filtering.vision.determinism import one_thread
from teasim.common.arrays import Array
from teasim.common.checkpoint import CheckpointKind

CHECKPOINT = CheckpointKind("decision", 3, held="fitted decision", remedy="fit it again")
SHIPPED = Path(__file__).parent / "fitted"
"""Folder of the checkpoint that is part of the package."""
DAMAGED = (KeyError, TypeError, ValueError, RuntimeError, SafetensorError)
"""What a description of other weights than those beside it leads to."""

Line = tuple[float, float]
"""Slope and offset of a logit."""


@dataclass(frozen=True)
class DecisionModel:
    """Fitted networks and their calibration."""

    networks: tuple[DecisionNetwork, ...]
    """Networks of one shape, in evaluation mode."""
    demo: Line
    """Calibration of the mean logit of a demonstration."""
    facts: Mapping[str, Line]
    """Calibration of the mean logit of each fact about a pool."""
    card: Mapping[str, Any]
    """How the model was fitted, and what it reached on pools that were held back."""
    sha256: str = ""
    """Hash of the weights; empty before they are saved."""

    def logits(self, found: Description) -> tuple[Array, Array]:
        """Return the calibrated logits of the demonstrations (D,) and of the facts (4,)."""
        rows = squash(torch.from_numpy(found.rows))[None]
        pairs = torch.from_numpy(found.pairs)[None]
        demos, facts = self.mean_logits(rows, pairs, torch.ones(rows.shape[:2], dtype=torch.bool))
        lines = np.array(list(self.facts.values()))
        return self.demo[0] * demos[0] + self.demo[1], lines[:, 0] * facts[0] + lines[:, 1]

    def mean_logits(
        self, rows: torch.Tensor, pairs: torch.Tensor, mask: torch.Tensor
    ) -> tuple[Array, Array]:
        """Return the mean logits of the networks for a batch, (B, D) and (B, 4), uncalibrated."""
        with one_thread(), torch.no_grad():
            found = [network(rows, pairs, mask) for network in self.networks]
        demos, facts = (
            torch.stack(part).double().mean(0).numpy() for part in zip(*found, strict=True)
        )
        return demos, facts


def save_model(model: DecisionModel, folder: Path) -> None:
    """Write a model; its weights are stored with half precision."""
    weights = {
        f"{number}.{name}": value.half()
        for number, network in enumerate(model.networks)
        for name, value in network.state_dict().items()
    }
    description = {
        "shape": asdict(model.networks[0].shape),
        "networks": len(model.networks),
        "demo": list(model.demo),
        "facts": {name: list(line) for name, line in model.facts.items()},
        "card": dict(model.card),
    }
    CHECKPOINT.save(folder, save_tensors(weights), description)


def load_model(folder: Path) -> DecisionModel:
    """Read a model that `save_model` wrote.

    Raises:
        CheckpointError: the folder holds none, one of another version, or a damaged one.
    """
    description = CHECKPOINT.describe(folder)
    weights = CHECKPOINT.weights(folder, description)
    try:
        return _restored(description, load_tensors(weights))
    except DAMAGED as error:
        raise CHECKPOINT.mismatch(folder) from error


@cache
def shipped_model() -> DecisionModel:
    """Return the model that is part of the package; it is never changed."""
    return load_model(SHIPPED)


def rounded(network: DecisionNetwork) -> DecisionNetwork:
    """Return the network with the precision of the file, in evaluation mode."""
    network.load_state_dict({k: v.half().float() for k, v in network.state_dict().items()})
    return network.eval()


def _restored(description: dict[str, Any], weights: dict[str, torch.Tensor]) -> DecisionModel:
    networks = []
    for number in range(int(description["networks"])):
        network = DecisionNetwork(Shape(**description["shape"]))
        start = f"{number}."
        network.load_state_dict(
            {k.removeprefix(start): v.float() for k, v in weights.items() if k.startswith(start)}
        )
        networks.append(network.eval())
    slope, offset = description["demo"]
    facts = {name: (float(a), float(b)) for name, (a, b) in description["facts"].items()}
    return DecisionModel(
        tuple(networks),
        (float(slope), float(offset)),
        facts,
        description["card"],
        description["weights_sha256"],
    )
