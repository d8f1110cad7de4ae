"""Save and load a policy: RUN/policy.safetensors (weights) and RUN/policy.json (description)."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load as load_tensors
from safetensors.torch import save as save_tensors

from policies.data.samples import ObservationSpec
from policies.learners.joints.chunk_policy import ChunkPolicy
from policies.learners.joints.networks import ChunkNetwork, PlanShape
from policies.learners.joints.recurrent import RecurrentPlanNetwork
from policies.learners.motion_policy import JointPolicy, MotionPolicy
from policies.learners.networks import DecisionNetwork, Ensemble, NetworkShape, RecurrentNetwork
from policies.learners.store import DemonstrationStore, StoreShape
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.checkpoint import CheckpointKind

POLICY = CheckpointKind("policy", 2, held="trained policy", remedy="train again")

AnyPolicy = SubtaskPolicy | JointPolicy
"""A learned policy of either level."""


@dataclass(frozen=True)
class PolicyKind:
    """Classes that a saved policy is rebuilt from."""

    network: type[Any]
    """Class of the network: (shape, seed, further settings) -> network."""
    shape: type[Any]
    """Dataclass of the sizes of the network."""
    policy: type[Any]
    """Class of the policy: (network, spec, action names) -> policy."""


KINDS = {
    **{
        network.kind: PolicyKind(network, NetworkShape, SubtaskPolicy)
        for network in (DecisionNetwork, Ensemble, RecurrentNetwork)
    },
    DemonstrationStore.kind: PolicyKind(DemonstrationStore, StoreShape, MotionPolicy),
    **{
        network.kind: PolicyKind(network, PlanShape, ChunkPolicy)
        for network in (ChunkNetwork, RecurrentPlanNetwork)
    },
}
"""The networks a policy may have, by the name they are saved under."""


def save_policy(policy: AnyPolicy, run: Path, *, training: Mapping[str, Any]) -> None:
    """Write `policy` into the folder `run`; `training` (JSON-able) says how it was trained."""
    description = {
        "observation": asdict(policy.spec),
        "actions": policy.action_names,
        "kind": policy.network.kind,
        "network": asdict(policy.network.shape),
        "settings": dict(policy.network.settings),
        "training": dict(training),
    }
    POLICY.save(run, save_tensors(policy.network.state_dict()), description)


def load_policy(run: Path) -> AnyPolicy:
    """Read a policy that `save_policy` wrote.

    Raises:
        CheckpointError: `run` holds no policy, one of another version, or a damaged one.
    """
    description = POLICY.describe(run)
    weights = POLICY.weights(run, description)
    try:
        spec = _spec(description["observation"])
        actions = tuple(str(name) for name in description["actions"])
        kind = KINDS[description["kind"]]
        shape = kind.shape(**description["network"])
        network = kind.network(shape, seed=0, **description["settings"])
        if network.shape.actions != len(actions):
            raise ValueError("one action per output")
        network.load_state_dict(load_tensors(weights))
    except (KeyError, TypeError, ValueError, RuntimeError, SafetensorError) as error:
        raise POLICY.mismatch(run) from error
    policy: AnyPolicy = kind.policy(network, spec, actions)
    return policy


def _spec(fields: Mapping[str, Any]) -> ObservationSpec:
    return ObservationSpec(
        cameras=tuple(fields["cameras"]),
        height=int(fields["height"]),
        width=int(fields["width"]),
        state_names=tuple(fields["state_names"]),
        environment_names=tuple(fields["environment_names"]),
    )
