"""From one target per control step to smooth motor commands at every update."""

import mujoco
import numpy as np

from teasim.constants import ARMS, CONTROL_TIMESTEP, UPDATES_PER_CONTROL
from teasim.world.embodiments import YUMI, Embodiment

BLOCKED_LAG = 0.004
"""A closing finger this far behind its command is held by something [m]."""


class Controller:
    """Position control of both arms and grippers.

    Within a control step the arms follow a cubic from the last target to the new one whose end
    velocity is the step's mean velocity. So a log of targets at 10 Hz is all there is to replay,
    and the motors still see a continuous velocity, which they need to carry things without jerks.
    """

    def __init__(self, model: mujoco.MjModel, embodiment: Embodiment = YUMI) -> None:
        joints = [name for arm in ARMS for name in embodiment.joints[arm]]
        self._count = len(joints)
        self._finger_speed = embodiment.finger_speed
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
        """Hold the present positions."""
        state = self.measured(data)
        self._position, self._velocity = state[: self._count].copy(), np.zeros(self._count)
        self._fingers = state[self._count :] / 2

    def measured(self, data: mujoco.MjData) -> np.ndarray:
        """Joint angles [rad] and gripper openings [m] (2 n + 2,): right, left, openings."""
        return np.concatenate(
            [data.qpos[self._joint_addresses], 2 * data.qpos[self._finger_addresses]]
        )

    def commands(self, target: np.ndarray, data: mujoco.MjData) -> "_Segment":
        """Start the control step towards `target` (2 n + 2,)."""
        goal = np.clip(target[: self._count], self._limits[:, 0], self._limits[:, 1])
        segment = _Segment(self, self._position, self._velocity, goal, target[self._count :] / 2)
        self._velocity = (goal - self._position) / CONTROL_TIMESTEP
        self._position = goal
        opening = segment.fingers > self._fingers
        # An opening hand starts from where its fingers are, not from the squeeze far inside.
        present = data.qpos[self._finger_addresses]
        self._fingers = np.where(opening, np.maximum(self._fingers, present), self._fingers)
        return segment


class _Segment:
    """The cubic of one control step."""

    def __init__(
        self,
        controller: Controller,
        start: np.ndarray,
        velocity: np.ndarray,
        goal: np.ndarray,
        fingers: np.ndarray,
    ) -> None:
        self._controller = controller
        self._start, self._rate, self._move = start, velocity * CONTROL_TIMESTEP, goal - start
        self.fingers = fingers

    def apply(self, update: int, data: mujoco.MjData) -> None:
        """Write the motor commands of one of the step's updates."""
        control = self._controller
        s = (update + 0.5) / UPDATES_PER_CONTROL
        # Hermite cubic with end slopes `rate` and `move`, and its derivative.
        position = self._start + self._rate * (s - 2 * s**2 + s**3) + self._move * (2 * s**2 - s**3)
        slope = self._rate * (1 - 4 * s + 3 * s**2) + self._move * (4 * s - 3 * s**2)
        lead = control._feedforward * slope / CONTROL_TIMESTEP
        data.ctrl[control._arm_actuators] = np.clip(position + lead, *control._limits.T)
        # Blocked fingers do not move, so nothing keeps the force from building up at once.
        lag = data.qpos[control._finger_addresses] - control._fingers
        speed = control._finger_speed * np.where(lag > BLOCKED_LAG, 10, 1)
        stride = speed * CONTROL_TIMESTEP / UPDATES_PER_CONTROL
        control._fingers += np.clip(self.fingers - control._fingers, -stride, stride)
        data.ctrl[control._finger_actuators] = control._fingers
