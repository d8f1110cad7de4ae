"""Registers the environments with Gymnasium."""

import gymnasium

JOINT_ENV = "teasim/TeaMaking-v0"
SUBTASK_ENV = "teasim/TeaMakingSubtasks-v0"
EVENTS_ENV = "teasim/TeaMakingEvents-v0"

MAX_SECONDS = 180
"""Longest episode of the joint-level environment [s]."""


def register_envs() -> None:
    """Register all environments; doing it twice changes nothing."""
    if JOINT_ENV not in gymnasium.registry:
        gymnasium.register(
            JOINT_ENV,
            entry_point="teasim.envs.joint_env:TeaMakingEnv",
            max_episode_steps=10 * MAX_SECONDS,
        )
    if SUBTASK_ENV not in gymnasium.registry:
        gymnasium.register(SUBTASK_ENV, entry_point="teasim.envs.subtask_env:TeaMakingSubtasksEnv")
    if EVENTS_ENV not in gymnasium.registry:
        gymnasium.register(EVENTS_ENV, entry_point="teasim.envs.events_env:TeaMakingEventsEnv")
