"""A running station: physics, liquids and events, advanced one control step at a time."""

from collections.abc import Callable

import mujoco
import numpy as np

from teasim.constants import (
    ARMS,
    PHYSICS_TIMESTEP,
    STEPS_PER_UPDATE,
    UPDATES_PER_CONTROL,
)
from teasim.world.bodies.embodiments import find_embodiment
from teasim.world.bodies.hand_view import HandView, hand_view_names
from teasim.world.bodies.person import Appearance, wear
from teasim.world.control import Controller
from teasim.world.events import Event, Recogniser
from teasim.world.liquids import CONTENTS, VESSELS, Liquids, Stream
from teasim.world.state import PhysicsState, SimulationState
from teasim.world.station import FREE_BODIES, Layout, body_name, place, station_model

SETTLE_TIME = 0.8
"""Time in which objects come to rest before an episode starts [s]."""
_UPDATE = PHYSICS_TIMESTEP * STEPS_PER_UPDATE
_SEEN_BY_HANDS = (*FREE_BODIES, "knob")

STATION_STATE_NAMES = (
    *(f"{body}_{part}" for body in FREE_BODIES for part in ("x", "y", "z", "qw", "qx", "qy", "qz")),
    "knob_x",
    "knob_y",
    "knob_angle",
    *(f"{vessel}_amount" for vessel in VESSELS),
    *(f"cup_{content}" for content in CONTENTS),
    "cup_tea",
    "cup_mixed",
)
"""Names of the state of all objects: poses in the world [m, wxyz], knob [m, rad], amounts [ml or
g], shares."""
ENVIRONMENT_STATE_NAMES = (*STATION_STATE_NAMES, *hand_view_names(_SEEN_BY_HANDS))
"""Names of the environment state: those of the station, poses of both hands in the world, and poses
of all things in the frames of the hands (`teasim.world.bodies.hand_view`) [m, wxyz]."""


class Simulation:
    """The tea-making station.

    `model` and `data` may be read and must not be written.
    """

    def __init__(self, embodiment: str = "yumi") -> None:
        """Build the station.

        Raises:
            ConfigError: the embodiment is unknown.
        """
        self.embodiment = find_embodiment(embodiment)
        self.model = station_model(embodiment)
        self.data = mujoco.MjData(self.model)
        self.liquids = Liquids(self.model)
        self.recogniser = Recogniser(self.model)
        self._controller = Controller(self.model, self.embodiment)
        self._paint_body = self.embodiment.painter(self.model)
        free = [self.model.joint(body_name(name)).qposadr[0] for name in FREE_BODIES]
        self._knob = self.model.joint("knob").qposadr[0]
        self._knob_body = self.model.body("knob").id
        self._hand_view = HandView(self.model, [body_name(name) for name in _SEEN_BY_HANDS])
        self._poses = (np.array(free)[:, None] + np.arange(7)).ravel()
        self._glow = [self.model.geom("plate").id, self.model.geom("pilot").id]
        self.target = np.zeros(2 * self.embodiment.width + 2)
        self.observers: list[Callable[[], None]] = []
        """Functions that are called after every update; they must not change the station."""

    def reset(self, layout: Layout) -> None:
        """Set objects to `layout` and arms to their start pose, and let everything come to rest."""
        mujoco.mj_resetData(self.model, self.data)
        place(self.model, self.data, layout)
        body = self.embodiment
        for arm in ARMS:
            for name, angle in zip(body.joints[arm], body.ready[arm], strict=True):
                self.data.joint(name).qpos = angle
        mujoco.mj_forward(self.model, self.data)
        self.liquids.reset()
        self.recogniser.reset()
        self._controller.reset(self.data)
        self.target = self._controller.measured(self.data)
        for _ in range(round(SETTLE_TIME / _UPDATE / UPDATES_PER_CONTROL)):
            self.step(self.target)
        self.recogniser.reset()
        self.data.time = 0.0

    def dress(self, appearance: Appearance) -> None:
        """Give the person at the station the colours of `appearance`."""
        wear(self.model, appearance)

    def step(self, target: np.ndarray, offset: np.ndarray | None = None) -> None:
        """Advance one control step towards `target`.

        Args:
            target: Joint angles [rad] and openings [m] (2 n + 2,), n joints per arm; YuMi has 7.
            offset: Disturbance of the same shape that is added to what the motors follow, and not
                to `self.target`, from which the skills plan.
        """
        self.target = np.array(target, dtype=float)
        followed = self.target if offset is None else self.target + offset
        segment = self._controller.commands(followed, self.data)
        for update in range(UPDATES_PER_CONTROL):
            segment.apply(update, self.data)
            mujoco.mj_step(self.model, self.data, nstep=STEPS_PER_UPDATE)
            self.recogniser.update(self.data, self.liquids)
            self.liquids.update(
                self.data,
                _UPDATE,
                brewing=self.recogniser.bag_in_cup,
                stirring=self.recogniser.stirring,
            )
            for observer in self.observers:
                observer()

    def get_state(self) -> SimulationState:
        """Return everything that the future of the station depends on, apart from targets."""
        return SimulationState(
            PhysicsState.of(self.model, self.data),
            self.target.copy(),
            self._controller.state(),
            self.liquids.state(),
            self.recogniser.state(),
        )

    def set_state(self, state: SimulationState) -> None:
        """Restore `state`; the same targets then give the same bits as before.

        Raises:
            ConfigError: the state belongs to another kind of station.
        """
        state.physics.restore(self.model, self.data)
        self.target = state.target.copy()
        self._controller.restore(state.controller)
        self.liquids.restore(state.liquids)
        self.recogniser.restore(state.recogniser)

    @property
    def events(self) -> tuple[Event, ...]:
        """Recognised sub-tasks in order of time."""
        return tuple(self.recogniser.events)

    @property
    def subtasks_done(self) -> tuple[str, ...]:
        """Names of the recognised sub-tasks in order of time."""
        return tuple(event.subtask for event in self.recogniser.events)

    @property
    def oven_on(self) -> bool:
        """Whether the oven is on."""
        return self.recogniser.oven_on

    @property
    def streams(self) -> tuple[Stream, ...]:
        """Present streams in the air."""
        return self.liquids.streams

    def joint_state(self) -> np.ndarray:
        """Return the measured joint angles [rad] and openings [m] (2 n + 2,) float32."""
        return self._controller.measured(self.data).astype(np.float32)

    def environment_state(self) -> np.ndarray:
        """Return the state of all objects (n,) float32; see `ENVIRONMENT_STATE_NAMES`."""
        place = self.model.body_pos[self._knob_body].tolist()
        liquids = self.liquids
        amounts = [*liquids.amounts.values(), *liquids.cup.values(), liquids.tea, liquids.mixed]
        rest = [*place[:2], self.data.qpos[self._knob], *amounts]
        seen = self._hand_view.read(self.data)
        return np.concatenate([self.data.qpos[self._poses], rest, seen]).astype(np.float32)

    def seen_by_hands(self, joints: np.ndarray, things: np.ndarray) -> np.ndarray:
        """Put arms and objects somewhere without physics; return what follows from it.

        Use it on a station that is never stepped.

        Args:
            joints: joint angles [rad] and openings [m] (2 n + 2,), as `joint_state` returns them.
            things: state of the objects, see `STATION_STATE_NAMES`.

        Returns:
            The part of the environment state after `STATION_STATE_NAMES`, float32.
        """
        named = dict(zip(STATION_STATE_NAMES, things.tolist(), strict=True))
        self._controller.put(joints, self.data)
        self.data.qpos[self._poses] = things[: len(self._poses)]
        self.data.qpos[self._knob] = named["knob_angle"]
        self.model.body_pos[self._knob_body][:2] = named["knob_x"], named["knob_y"]
        mujoco.mj_kinematics(self.model, self.data)
        return self._hand_view.read(self.data).astype(np.float32)

    def paint(self) -> None:
        """Update what pictures show: levels, puddles, limbs, and the glow of the hob."""
        self.liquids.paint(self.model, self.data)
        self._paint_body(self.data)
        plate, pilot = self._glow
        on = self.oven_on
        self.model.geom_matid[plate] = -1
        self.model.geom_rgba[plate] = (0.95, 0.25, 0.08, 1) if on else (0.26, 0.26, 0.28, 1)
        self.model.geom_rgba[pilot] = (1.0, 0.15, 0.10, 1) if on else (0.25, 0.05, 0.05, 1)
