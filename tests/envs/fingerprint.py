"""Run as a program: print a check sum of what an environment shows for some actions."""

import hashlib
import sys

import gymnasium
import numpy as np

from teasim.envs.registration import register_envs


def fingerprint(name: str, actions: int, obs_type: str) -> str:
    """Check sum of all observations, rewards and verdicts of `actions` seeded actions."""
    register_envs()
    env = gymnasium.make(f"teasim/{name}-v0", obs_type=obs_type, width=64, height=64)
    env.action_space.seed(5)
    digest = hashlib.sha256()

    def add(observation: object) -> None:
        if isinstance(observation, dict):
            for key in sorted(observation):
                add(observation[key])
        else:
            digest.update(np.asarray(observation).tobytes())

    add(env.reset(seed=7)[0])
    for _ in range(actions):
        observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
        add(observation)
        digest.update(repr((reward, terminated, truncated, info["subtasks_done"])).encode())
    env.close()
    return digest.hexdigest()


if __name__ == "__main__":
    print(fingerprint(sys.argv[1], int(sys.argv[2]), sys.argv[3]))
