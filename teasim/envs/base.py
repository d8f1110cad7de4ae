"""The base of both environments: the station, its reset, observations and verdict."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from teasim.common.errors import ConfigError
from teasim.constants import FPS, UPDATES_PER_CONTROL
from teasim.envs.observations import observation_space, observe
from teasim.envs.reports import VIOLATION_METADATA, report
from teasim.render import StationRenderer
from teasim.task.scoring import Verdict, judge
from teasim.world.looks.look import Look, check_look_kind, fixed_look, sample_look
from teasim.world.pictures import check_cameras, check_picture
from teasim.world.simulation import Simulation
from teasim.world.state import SimulationState
from teasim.world.station import draw_layout

RENDER_SIZE = (480, 640)
"""Height and width of `render()` when the observations hold no pictures [pixels]."""

FILM = "rgb_array_list"
"""Render mode that takes pictures at every control step, also in the middle of an action."""


@dataclass(frozen=True)
class EnvState:
    """The state of an environment between two steps; it can be pickled."""

    env: str
    """Name of the environment's class."""
    simulation: SimulationState
    """State of the station."""
    random: Mapping[str, Any]
    """State of the generator from which the next resets draw."""
    look: Look
    """Look of the station."""
    progress: Any
    """What the environment itself counts."""


class StationEnv(gymnasium.Env[dict[str, Any], Any]):
    """The tea-making station; subclasses define the actions.

    `metadata["violations"]` has every violation by its key, in words: "unsafe" stands for
    `info["unsafe"]`, all other keys can occur in `info["violations"]`.
    `metadata["violation_kinds"]` has the keys that are counted together, by the words for the kind.
    """

    metadata = {  # noqa: RUF012 (as Gymnasium declares it)
        "render_modes": ["rgb_array", FILM],
        "render_fps": FPS,
        **VIOLATION_METADATA,
    }

    def __init__(
        self,
        *,
        obs_type: str = "state",
        cameras: Sequence[str] = ("left", "cup"),
        width: int = 224,
        height: int = 224,
        render_mode: str | None = None,
        quality: str = "fast",
        randomize: bool = True,
        look: str = "fixed",
    ) -> None:
        """Build the station; OpenGL starts with the first picture.

        Args:
            obs_type: state, pixels, pixels_agent_pos or pixels_state.
            cameras: Cameras of the `pixels` observation; `render()` uses the first one.
            width: Width of the pictures [pixels].
            height: Height of the pictures [pixels].
            render_mode: None, rgb_array, or rgb_array_list: `render()` then returns the pictures of
                all control steps since it was last called, `FPS` per second, all cameras side by
                side.
            quality: Quality of the pictures, fast or nice; nice renders 20 to 40 times slower.
            randomize: Move and turn the things on the table at every reset.
            look: fixed, or random: light, colours, cameras and distractors change at every reset.

        Raises:
            ConfigError: an argument is unknown or out of range.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            modes = ", ".join(self.metadata["render_modes"])
            raise ConfigError(f"Unknown render_mode '{render_mode}'; choose None, {modes}.")
        check_picture(width, height, quality)
        self.render_mode = render_mode
        self._cameras = check_cameras(cameras)
        self._size = (height, width)
        self._quality = quality
        self._randomize = randomize
        self._look_kind = check_look_kind(look)
        self._look = fixed_look()
        self._simulation = Simulation()
        names = self._simulation.embodiment.state_names
        self.observation_space = observation_space(obs_type, names, self._cameras, self._size)
        self._renderer: StationRenderer | None = None
        self._film: list[np.ndarray] = []
        self._updates = 0
        if render_mode == FILM:
            self._simulation.observers.append(self._take)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start a new episode: everything in place, both arms at READY.

        `options={"randomize": False}` puts everything in its nominal place for this episode.
        """
        super().reset(seed=seed)
        randomize = (options or {}).get("randomize", self._randomize)
        self._simulation.reset(draw_layout(self.np_random, randomize=randomize))
        if self._look_kind == "random":  # otherwise nothing is drawn, and layouts stay
            self._wear(sample_look(self.np_random))
        if self.render_mode == FILM:  # things coming to rest are no part of the episode
            self._film, self._updates = [self._side_by_side()], 0
        return self._observation(), self._info(self._verdict())

    def render(self) -> Any:
        """Return a picture (height, width, 3) uint8 of the first camera, a film, or None."""
        if self.render_mode is None:
            return None
        if self.render_mode == FILM:
            taken, self._film = self._film, []
            return taken
        return self._pictures().frames(self._cameras[:1])[self._cameras[0]]

    def masks(self) -> dict[str, np.ndarray]:
        """Return what the pixels of every camera show: (height, width) int32 of `SEGMENT_NAMES`."""
        return self._pictures().masks(self._cameras)

    def depths(self) -> dict[str, np.ndarray]:
        """Return the distance along the axis of every camera: (height, width) float32 [m]."""
        return self._pictures().depths(self._cameras)

    def close(self) -> None:
        """Close OpenGL."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def get_state(self) -> EnvState:
        """Return everything that the environment's future depends on, but the actions to come.

        The state of wrappers, such as the step count of `TimeLimit`, is not part of it.
        """
        return EnvState(
            type(self).__name__,
            self._simulation.get_state(),
            copy.deepcopy(self.np_random.bit_generator.state),
            self._look,
            self._progress(),
        )

    def set_state(self, state: EnvState) -> None:
        """Return to `state`, from which the same actions give the same bits as before.

        Raises:
            ConfigError: the state was taken from another environment; nothing has changed then.
        """
        if state.env != type(self).__name__:
            raise ConfigError(f"The state is of {state.env}; this is {type(self).__name__}.")
        self._simulation.set_state(state.simulation)
        self.np_random.bit_generator.state = copy.deepcopy(dict(state.random))
        self._wear(state.look)
        self._set_progress(state.progress)

    def _progress(self) -> Any:
        """Return what a subclass counts, for `get_state`."""
        raise NotImplementedError

    def _set_progress(self, progress: Any) -> None:
        """Return to what `_progress` gave."""
        raise NotImplementedError

    def _pictures(self) -> StationRenderer:
        if self._renderer is None:
            height, width = self._size
            self._renderer = StationRenderer(
                self._simulation,
                width=width,
                height=height,
                quality=self._quality,
                look=self._look,
            )
        return self._renderer

    def _side_by_side(self) -> np.ndarray:
        """Return the pictures of all cameras, (height, K * width, 3)."""
        return np.hstack(list(self._pictures().frames(self._cameras).values()))

    def _take(self) -> None:
        """Take a picture after the last update of a control step."""
        self._updates += 1
        if self._updates % UPDATES_PER_CONTROL == 0:
            self._film.append(self._side_by_side())

    def _wear(self, look: Look) -> None:
        self._look = look
        if self._renderer is not None:
            self._renderer.wear(look)

    def _observation(self) -> dict[str, Any]:
        seeing = "pixels" in self.observation_space.spaces  # type: ignore[attr-defined]
        renderer = self._pictures() if seeing else None
        space: Any = self.observation_space
        return observe(space, self._simulation, renderer, self._cameras)

    def _verdict(self) -> Verdict:
        simulation = self._simulation
        return judge(
            simulation.subtasks_done,
            oven_on=simulation.oven_on,
            spilled=simulation.liquids.spilled,
        )

    def _info(self, verdict: Verdict) -> dict[str, Any]:
        return report(self._simulation.subtasks_done, verdict, self._simulation.data.time)
