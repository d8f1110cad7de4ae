"""Learning curves of PPO in the sub-task environment: from a cloned policy, and from scratch.

POLICY is a folder made by `teasim train --observe state`. Both learn in the same few scenes, and a
sequence of decisions in a scene is simulated once. The reward of an episode is 1 if tea was made.
"""

import argparse
import sys
from itertools import cycle
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor

from filtering.vision.determinism import one_thread
from policies import EnvironmentConfig, load_policy
from policies.learners.subtask_policy import SubtaskPolicy
from policies.play.environments import make_environment
from policies.play.remembering import Remembering
from policies.sb3 import as_ppo

SETTINGS: dict[str, Any] = {"n_steps": 128, "batch_size": 64, "seed": 0}


class Scenes(gym.Wrapper[Any, Any, Any, Any]):
    """Resets to a few scenes in turn, whatever seed is given."""

    def __init__(self, env: gym.Env[Any, Any], count: int) -> None:
        super().__init__(env)
        self._seeds = cycle(range(count))

    def reset(self, **_: Any) -> tuple[Any, dict[str, Any]]:
        """Start the next scene."""
        return self.env.reset(seed=next(self._seeds))


def main() -> int:
    """Print the mean reward and the mean length of each tenth of the episodes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policy", type=Path, help="folder of a cloned policy that sees the state")
    parser.add_argument(
        "--actions", type=int, default=2000, help="actions (sub-tasks) per learning curve"
    )
    parser.add_argument("--scenes", type=int, default=4, help="number of scenes")
    parser.add_argument("--learning-rate", type=float, default=1e-4, help="step size of PPO")
    arguments = parser.parse_args()
    settings = SETTINGS | {"learning_rate": arguments.learning_rate}
    policy = load_policy(arguments.policy)
    if not isinstance(policy, SubtaskPolicy):
        parser.error(f"'{arguments.policy}' holds no policy over sub-tasks.")
    for name in ("cloned", "from scratch"):
        world = make_environment(EnvironmentConfig(), policy.spec)
        env = Monitor(Scenes(Remembering(world), arguments.scenes))
        with one_thread():
            if name == "cloned":
                model = as_ppo(policy, env, **settings)
            else:
                model = PPO("MultiInputPolicy", env, device="cpu", **settings)
            model.learn(arguments.actions)
        print(f"{name}: {len(env.get_episode_rewards())} episodes")
        parts = zip(
            np.array_split(env.get_episode_rewards(), 10),
            np.array_split(env.get_episode_lengths(), 10),
            strict=True,
        )
        for number, (rewards, lengths) in enumerate(parts, start=1):
            print(
                f"  tenth {number:2}: tea made in {100 * np.mean(rewards):5.1f} %, "
                f"{np.mean(lengths):.1f} actions an episode",
                flush=True,
            )
        env.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
