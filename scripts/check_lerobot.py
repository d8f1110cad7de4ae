"""LeRobot itself evaluates in the tea station: run this in a Python that has LeRobot.

The plug-in is found, the observations have the names and shapes that its configuration declares,
and LeRobot's own rollout scores a demonstration, replayed from its log, as a success: in this
process and in others. docs/policies.md says how to install both.
"""

import argparse
import importlib.metadata
import sys
from typing import Any

import numpy as np
import torch
from lerobot.envs import (
    close_envs,
    env_to_policy_features,
    make_env,
    make_env_config,
    preprocess_observation,
)
from lerobot.scripts.lerobot_eval import rollout
from lerobot.utils.import_utils import register_third_party_plugins

from teasim.rollout import demonstrate
from teasim.task.mistakes import Plan
from teasim.task.recipes import SEQ_1
from teasim.world.simulation import Simulation

COPIES = 2
"""Environments at once."""
SIZE = 64
"""Height and width of the pictures [pixels]."""


class Replay(torch.nn.Module):
    """Repeats logged targets (T, 16), the same for all environments."""

    def __init__(self, targets: np.ndarray) -> None:
        """Begin with the first target."""
        super().__init__()
        self.targets = torch.from_numpy(targets)
        self.reset()

    def reset(self) -> None:
        """Begin again."""
        self.steps = 0

    def select_action(self, observation: dict[str, Any]) -> torch.Tensor:
        """Return the next target for every environment, (n, 16); at the end the last one."""
        target = self.targets[min(self.steps, len(self.targets) - 1)]
        self.steps += 1
        return target.repeat(len(observation["task"]), 1)


def logged_targets(seed: int) -> np.ndarray:
    """Return the targets (T, 16) of a correct demonstration where `reset(seed=seed)` starts."""
    rng = np.random.Generator(np.random.PCG64(seed))
    simulation = Simulation()
    return np.array([step.target for step in demonstrate(simulation, Plan(SEQ_1), rng)])


def check(targets: np.ndarray, seed: int, *, apart: bool) -> bool:
    """Whether features and outcomes are as they should be; `apart` uses other processes."""
    config = make_env_config("teasim", observation_height=SIZE, observation_width=SIZE)
    envs = make_env(config, n_envs=COPIES, use_async_envs=apart)
    env = envs["teasim"][0]
    seen = preprocess_observation(env.reset(seed=[seed] * COPIES)[0])
    declared = env_to_policy_features(config)
    del declared["action"]
    fits = {name: tuple(part.shape[1:]) for name, part in seen.items()} == {
        name: feature.shape for name, feature in declared.items()
    }
    policy = Replay(targets)
    same: Any = [lambda value: value] * 4
    played = rollout(env, policy, *same, seeds=[seed] * COPIES)
    close_envs(envs)
    made = played["success"].any(dim=1)
    where = "other processes" if apart else "this process"
    print(f"{where}: {len(seen)} features {'fit' if fits else 'DIFFER'}, ", end="")
    print(f"tea made in {int(made.sum())} of {COPIES}, {policy.steps} steps")
    return fits and bool(made.all())


def main() -> int:
    """Check both kinds of vector environments; 1 if something is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=4, help="seed of the scene")
    arguments = parser.parse_args()
    register_third_party_plugins()
    versions = [f"{name} {importlib.metadata.version(name)}" for name in ("lerobot", "gymnasium")]
    print(", ".join(versions))
    targets = logged_targets(arguments.seed)
    found = [check(targets, arguments.seed, apart=apart) for apart in (False, True)]
    return 0 if all(found) else 1


if __name__ == "__main__":
    sys.exit(main())
