"""Observations: joint state, environment state, and pictures."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from teasim.common.errors import ConfigError
from teasim.render import StationRenderer
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES, Simulation

OBS_TYPES = ("state", "pixels", "pixels_agent_pos", "pixels_state")
"""What observations can consist of; `pixels_state` is all that a pool logs."""
LARGEST = 1000.0
"""Bound of every state value [rad, m, ml, g]; all of them stay far below it."""


def observation_space(
    obs_type: str, names: Sequence[str], cameras: Sequence[str], size: tuple[int, int]
) -> spaces.Dict:
    """Return the space of the observations.

    Args:
        obs_type: One of `OBS_TYPES`.
        names: Dimensions of the joint state.
        cameras: Cameras of the pictures.
        size: Height and width of the pictures [pixels].

    Raises:
        ConfigError: unknown `obs_type`.
    """
    if obs_type not in OBS_TYPES:
        raise ConfigError(f"Unknown obs_type '{obs_type}'; choose {', '.join(OBS_TYPES)}.")
    parts: dict[str, spaces.Space[Any]] = {}
    if obs_type != "pixels":
        parts["agent_pos"] = _vector(len(names))
    if obs_type.endswith("state"):
        parts["environment_state"] = _vector(len(ENVIRONMENT_STATE_NAMES))
    if obs_type.startswith("pixels"):
        picture = spaces.Box(0, 255, (*size, 3), np.uint8)
        # As in PushT and ALOHA: one camera is a plain picture, several are a dict of pictures.
        several = len(cameras) > 1
        parts["pixels"] = spaces.Dict(dict.fromkeys(cameras, picture)) if several else picture
    return spaces.Dict(parts)


def observe(
    space: spaces.Dict,
    simulation: Simulation,
    renderer: StationRenderer | None,
    cameras: tuple[str, ...],
) -> dict[str, Any]:
    """Return the present observation in `space`; every array is new."""
    observation: dict[str, Any] = {}
    if "agent_pos" in space.spaces:
        observation["agent_pos"] = simulation.joint_state()
    if "environment_state" in space.spaces:
        observation["environment_state"] = simulation.environment_state()
    if "pixels" in space.spaces and renderer is not None:
        frames = renderer.frames(cameras)
        observation["pixels"] = frames if len(cameras) > 1 else frames[cameras[0]]
    return observation


def _vector(size: int) -> spaces.Box:
    return spaces.Box(-LARGEST, LARGEST, (size,), np.float32)
