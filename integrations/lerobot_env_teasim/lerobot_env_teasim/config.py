"""The configuration that `--env.type=teasim` selects in LeRobot's commands."""

from dataclasses import dataclass, field
from typing import Any

from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE

from lerobot_env_teasim.environment import NAMESPACE, TASK
from teasim.constants import FPS, STATE_NAMES
from teasim.envs.registration import MAX_SECONDS
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES


@EnvConfig.register_subclass("teasim")
@dataclass
class TeasimEnv(EnvConfig):
    """The tea station, driven by joint targets at 10 Hz.

    The defaults are those of `teasim generate`: a policy that was trained on all features of a pool
    finds all of them.
    """

    task: str | None = TASK
    """Name of the environment."""
    fps: int = FPS
    """Control steps and frames per second; the station knows no other rate."""
    episode_length: int = MAX_SECONDS * FPS
    """Control steps after which an episode is truncated."""
    obs_type: str = "pixels_state"
    """What is seen: state, pixels, pixels_agent_pos or pixels_state."""
    cameras: list[str] = field(default_factory=lambda: ["left", "cup"])
    """Cameras of the pictures."""
    observation_height: int = 224
    """Height of the pictures [pixels]."""
    observation_width: int = 224
    """Width of the pictures [pixels]."""
    render_mode: str = "rgb_array"
    """How the films of an evaluation are made."""
    quality: str = "fast"
    """Quality of the pictures, fast or nice; use that of the pool."""
    look: str = "fixed"
    """Look of the station, fixed or random; use that of the pool."""
    randomize: bool = True
    """Move and turn the things on the table at every reset."""
    features: dict[str, PolicyFeature] = field(default_factory=dict)
    """Shape of the actions and of all that is seen; filled in from the other settings."""
    features_map: dict[str, str] = field(default_factory=dict)
    """Names of the features in LeRobot's data sets; filled in."""

    def __post_init__(self) -> None:
        """Fill in the features; those of a stored configuration may be of other settings."""
        self.features, self.features_map = {}, {}
        size = (self.observation_height, self.observation_width, 3)
        joints, station = (len(STATE_NAMES),), (len(ENVIRONMENT_STATE_NAMES),)
        self._add(ACTION, ACTION, FeatureType.ACTION, joints)
        if self.obs_type != "pixels":
            self._add("agent_pos", OBS_STATE, FeatureType.STATE, joints)
        if self.obs_type.endswith("state"):
            self._add("environment_state", OBS_ENV_STATE, FeatureType.ENV, station)
        if self.obs_type.startswith("pixels"):
            for camera in self.cameras:  # the recorder of LeRobot looks for pictures by these names
                name = f"{OBS_IMAGES}.{camera}"
                self._add(name, name, FeatureType.VISUAL, size)

    def _add(self, key: str, name: str, kind: FeatureType, shape: tuple[int, ...]) -> None:
        self.features[key] = PolicyFeature(type=kind, shape=shape)
        self.features_map[key] = name

    @property
    def package_name(self) -> str:
        """Package that registers the environment with Gymnasium."""
        return NAMESPACE

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """Arguments of `gymnasium.make`."""
        return {
            "obs_type": self.obs_type,
            "cameras": tuple(self.cameras),
            "height": self.observation_height,
            "width": self.observation_width,
            "render_mode": self.render_mode,
            "quality": self.quality,
            "look": self.look,
            "randomize": self.randomize,
            "max_episode_steps": self.episode_length,
        }
