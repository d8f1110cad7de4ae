"""Save and load a policy: RUN/policy.safetensors (weights) and RUN/policy.json (what they are)."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load as load_tensors
from safetensors.torch import save as save_tensors

from policies.base import ObservationSpec
from policies.networks import DecisionNetwork, NetworkShape
from policies.subtask_policy import SubtaskPolicy
from teasim.errors import CheckpointError
from teasim.pool.files import write_bytes, write_json

FORMAT = "teasim-policy"
VERSION = 1
WEIGHTS_FILE = "policy.safetensors"
DESCRIPTION_FILE = "policy.json"


def save_policy(policy: SubtaskPolicy, run: Path, *, training: Mapping[str, Any]) -> None:
    """Write `policy` into the folder `run`; `training` (JSON-able) says how it came about."""
    weights = save_tensors(policy.network.state_dict())
    description = {
        "format": FORMAT,
        "version": VERSION,
        "observation": asdict(policy.spec),
        "actions": policy.action_names,
        "network": asdict(policy.network.shape),
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
        "training": dict(training),
    }
    write_bytes(run / WEIGHTS_FILE, weights)
    # Last, so that a folder with a description always holds a whole policy.
    write_json(run / DESCRIPTION_FILE, description)


def load_policy(run: Path) -> SubtaskPolicy:
    """Read a policy that `save_policy` wrote.

    Raises:
        CheckpointError: `run` holds no policy, one of another version, or a damaged one.
    """
    description = _read_description(run)
    weights = _read(run / WEIGHTS_FILE)
    if hashlib.sha256(weights).hexdigest() != description.get("weights_sha256"):
        raise CheckpointError(
            f"'{run / WEIGHTS_FILE}' is damaged: it is not the file that was saved; train again."
        )
    try:
        spec = _spec(description["observation"])
        actions = tuple(str(name) for name in description["actions"])
        network = DecisionNetwork(NetworkShape(**description["network"]), seed=0)
        if network.shape.actions != len(actions):
            raise ValueError("one action per output")
        network.load_state_dict(load_tensors(weights))
    except (KeyError, TypeError, ValueError, RuntimeError, SafetensorError) as error:
        raise CheckpointError(
            f"'{run / DESCRIPTION_FILE}' does not describe the weights beside it; train again."
        ) from error
    return SubtaskPolicy(network, spec, actions)


def _read_description(run: Path) -> dict[str, Any]:
    path = run / DESCRIPTION_FILE
    try:
        description = json.loads(_read(path))
    except ValueError as error:
        raise CheckpointError(f"'{path}' is damaged: it is not JSON; train again.") from error
    if not isinstance(description, dict) or description.get("format") != FORMAT:
        raise CheckpointError(f"'{path}' does not describe a policy of this program.")
    if description.get("version") != VERSION:
        raise CheckpointError(
            f"'{path}' has version {description.get('version')}, this program reads {VERSION}; "
            "train again."
        )
    return description


def _spec(fields: Mapping[str, Any]) -> ObservationSpec:
    return ObservationSpec(
        cameras=tuple(fields["cameras"]),
        height=int(fields["height"]),
        width=int(fields["width"]),
        state_names=tuple(fields["state_names"]),
    )


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise CheckpointError(
            f"'{path.parent}' holds no trained policy: {path.name} cannot be read."
        ) from error
