"""Motor commands at every update, interpolated from one target per control step."""

import mujoco
import numpy as np

from teasim.constants import ARMS, CONTROL_TIMESTEP, UPDATES_PER_CONTROL
from teasim.world.bodies.embodiments import YUMI, Embodiment
from teasim.world.state import Saved

BLOCKED_LAG = 0.004
"""A closing finger that lags its command by more than this is blocked by an object [m]."""

_S = (np.arange(UPDATES_PER_CONTROL)[:, None] + 0.5) / UPDATES_PER_CONTROL
# Hermite cubic with given slopes at both ends, and its derivative (updates, 1).
_START, _END = _S - 2 * _S**2 + _S**3, 2 * _S**2 - _S**3
_START_SLOPE, _END_SLOPE = 1 - 4 * _S + 3 * _S**2, 4 * _S - 3 * _S**2


class Controller(Saved):
    """Position control of both arms and grippers.

    Within a control step the arms follow a cubic from the last target to the new one; its final
    velocity is the mean velocity of the step. A log of targets at 10 Hz is therefore enough for a
    replay, and the velocity is continuous, which keeps carried objects from slipping.
    """

    SAVED = ("_position", "_velocity", "_fingers")

    def __init__(self, model: mujoco.MjModel, embodiment: Embodiment = YUMI) -> None:
        joints = [name for arm in ARMS for name in embodiment.joints[arm]]
        self._count = len(joints)
        self._stride = embodiment.finger_speed * CONTROL_TIMESTEP / UPDATES_PER_CONTROL
        self._arm_actuators = np.array([model.actuator(name).id for name in joints])
        self._finger_actuators = np.array([model.actuator(f"{arm}_gripper").id for arm in ARMS])
        self._joint_addresses = np.array([model.joint(name).qposadr[0] for name in joints])
        self._finger_addresses = np.array(
            [model.joint(f"{arm}_finger_a").qposadr[0] for arm in ARMS]
        )
        gain = model.actuator_gainprm[self._arm_actuators, 0]
        damping = -model.actuator_biasprm[self._arm_actuators, 2]
        self._feedforward = damping / gain  # cancels the lag of a damped position motor [s]
        self._limits = model.actuator_ctrlrange[self._arm_actuators]
        self._position = np.zeros(self._count)
        self._velocity = np.zeros(self._count)
        self._fingers = np.zeros(2)

    def reset(self, data: mujoco.MjData) -> None:
        """Hold the present joint positions and openings."""
        state = self.measured(data)
        self._position, self._velocity = state[: self._count].copy(), np.zeros(self._count)
        self._fingers = state[self._count :] / 2

    def measured(self, data: mujoco.MjData) -> np.ndarray:
        """Return the measured joint angles [rad] and gripper openings [m] (2 n + 2,).

        The order is the right arm, the left arm, both openings.
        """
        return np.concatenate(
            [data.qpos[self._joint_addresses], 2 * data.qpos[self._finger_addresses]]
        )

    def put(self, state: np.ndarray, data: mujoco.MjData) -> None:
        """Put the arms where `measured` returned `state`, without physics."""
        data.qpos[self._joint_addresses] = state[: self._count]
        data.qpos[self._finger_addresses] = state[self._count :] / 2

    def commands(self, target: np.ndarray, data: mujoco.MjData) -> "_Segment":
        """Start a control step towards `target` (2 n + 2,): angles [rad] and openings [m]."""
        goal = np.clip(target[: self._count], self._limits[:, 0], self._limits[:, 1])
        segment = _Segment(self, self._position, self._velocity, goal, target[self._count :] / 2)
        self._velocity = (goal - self._position) / CONTROL_TIMESTEP
        self._position = goal
        opening = target[self._count :] / 2 > self._fingers
        # Opening starts at the measured position: the command of a squeeze lies inside the object.
        present = data.qpos[self._finger_addresses]
        self._fingers = np.where(opening, np.maximum(self._fingers, present), self._fingers)
        return segment


class _Segment:
    """The interpolated commands of one control step."""

    def __init__(
        self,
        controller: Controller,
        start: np.ndarray,
        velocity: np.ndarray,
        goal: np.ndarray,
        fingers: np.ndarray,
    ) -> None:
        self._controller = controller
        self.fingers = fingers.tolist()
        rate, move = velocity * CONTROL_TIMESTEP, goal - start
        position = start + rate * _START + move * _END
        slope = rate * _START_SLOPE + move * _END_SLOPE
        lead = controller._feedforward * slope / CONTROL_TIMESTEP
        self._arms = np.clip(position + lead, *controller._limits.T)  # (updates, 14)

    def apply(self, update: int, data: mujoco.MjData) -> None:
        """Write the motor commands of update number `update` of this step."""
        control = self._controller
        data.ctrl[control._arm_actuators] = self._arms[update]
        # A blocked finger does not move, so its command may approach the goal faster.
        present = data.qpos[control._finger_addresses].tolist()
        for finger, (goal, at) in enumerate(zip(self.fingers, present, strict=True)):
            command = float(control._fingers[finger])
            stride = control._stride * (10 if at - command > BLOCKED_LAG else 1)
            control._fingers[finger] = command + min(max(goal - command, -stride), stride)
        data.ctrl[control._finger_actuators] = control._fingers
