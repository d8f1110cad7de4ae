"""Policies of other programs, named on the command line as `module:attribute`.

The attribute is a policy, or a class or function without arguments that makes one. A policy needs
what `policies.data.samples.Policy` has: `predict`, the `spec` of what it sees, and the
`action_names`. With `level = "joint"` its actions are joint targets in place of sub-tasks.
"""

import os
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from policies.checkpoint import AnyPolicy, load_policy
from policies.data.samples import ObservationSpec
from policies.learners.motion_policy import JointPolicy
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError

NEEDED = ("predict", "spec", "action_names")
"""What a policy must have."""


class ForeignSubtasks(SubtaskPolicy):
    """Somebody else's policy over sub-tasks."""

    def __init__(self, policy: Any) -> None:
        """Keep the policy."""
        self.policy = policy
        self.spec, self.action_names = policy.spec, tuple(policy.action_names)

    def set_random_seed(self, seed: int) -> None:
        """Pass the seed on, if the policy takes one."""
        _seed(self.policy, seed)

    def predict(self, *seen: Any, **more: Any) -> Any:
        """Ask the policy."""
        return self.policy.predict(*seen, **more)


class ForeignJoints(JointPolicy):
    """Somebody else's policy over joint targets."""

    def __init__(self, policy: Any) -> None:
        """Keep the policy."""
        self.policy, self.draws = policy, bool(getattr(policy, "draws", False))
        self.spec, self.action_names = policy.spec, tuple(policy.action_names)

    def set_random_seed(self, seed: int) -> None:
        """Pass the seed on, if the policy takes one."""
        _seed(self.policy, seed)

    def predict(self, *seen: Any, **more: Any) -> Any:
        """Ask the policy."""
        target, state = self.policy.predict(*seen, **more)
        return np.asarray(target, dtype=np.float32), state


def policy_at(run: Path) -> AnyPolicy:
    """Return the policy in a folder, or that which `module:attribute` names.

    Raises:
        CheckpointError: the folder holds no policy, one of another version, or a damaged one.
        ConfigError: the module cannot be imported, or what it has is no policy.
    """
    name = str(run)
    module, colon, attribute = name.partition(":")
    if run.exists() or not colon:
        return load_policy(run)
    try:
        if os.getcwd() not in sys.path:  # as `python -m` does
            sys.path.insert(0, os.getcwd())
        found = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise ConfigError(
            f"Cannot import the policy '{name}': {error}; name a folder, or module:attribute."
        ) from error
    policy = found() if callable(found) and not hasattr(found, "action_names") else found
    policy = policy() if isinstance(policy, type) else policy
    missing = [part for part in NEEDED if not hasattr(policy, part)]
    if missing or not isinstance(policy.spec, ObservationSpec):
        raise ConfigError(
            f"'{name}' is no policy: it needs {', '.join(NEEDED)}, with an ObservationSpec as spec."
        )
    joint = getattr(policy, "level", "subtask") == "joint"
    return ForeignJoints(policy) if joint else ForeignSubtasks(policy)


def _seed(policy: Any, seed: int) -> None:
    if hasattr(policy, "set_random_seed"):
        policy.set_random_seed(seed)
