"""Motions of one arm, as generators of targets, one per control step."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from mink import SE3

from teasim.common.errors import SkillError
from teasim.constants import ARMS, CONTROL_TIMESTEP
from teasim.skills.geometry import (
    EASE_PEAK,
    between,
    ease,
    flipped,
    position,
    rotation,
    shifted,
    turn_angle,
)
from teasim.skills.ik import kinematics
from teasim.skills.style import Style
from teasim.world.simulation import Simulation

Motion = Iterator[np.ndarray]
"""Targets of successive control steps: (16,) for YuMi, (2 n + 2,) for n joints per arm."""

Curve = Callable[[float], SE3]
"""Pose of the hand as a function of the share of the path in [0, 1]."""

APPROACH = 0.07
"""Length of the straight approach to a grasp and of the retreat from it [m]."""
SPEED_MARGIN = 0.85
"""Share of the largest joint speeds that a plan may use."""
SECOND_THOUGHTS = 0.8
"""Rest before a motion that is given up turns back [s]."""
_REPLANS = 10
_REHEARSAL_SAMPLES = 12
_LARGEST_TURN = 0.30  # more than this between two samples is a jump to another elbow position [rad]


class Arm:
    """Plans and times the motions of one arm; the other arm keeps its last target."""

    CARRY_SPEED = 0.35
    """Peak speed of the hand while carrying [m/s]."""
    APPROACH_SPEED = 0.14
    """Peak speed of the hand near things [m/s]."""
    TURN_SPEED = 1.2
    """Peak speed of turning and tilting [rad/s]."""

    def __init__(
        self,
        side: str,
        simulation: Simulation,
        style: Style,
        postures: Sequence[Sequence[float]] = (),
    ) -> None:
        self.simulation, self.style = simulation, style
        self._side = side
        self._body = body = simulation.embodiment
        self._kinematics = kinematics(side, body.name)
        self._postures = [np.array(posture) for posture in postures] or [body.ready[side]]
        self._prefer(self._postures[0])
        first = body.width * ARMS.index(side)
        self._joints = slice(first, first + body.width)
        self._hand = 2 * body.width + ARMS.index(side)

    @property
    def joints(self) -> np.ndarray:
        """Last target of the arm's joints (n,) [rad or m]."""
        return self.simulation.target[self._joints]

    @property
    def tcp(self) -> SE3:
        """Pose of the tool centre point at the last target."""
        return self._kinematics.pose(self.joints)

    # -- motions ---------------------------------------------------------------------------------

    def wait(self, seconds: float) -> Motion:
        """Hold still."""
        for _ in range(_steps(seconds)):
            yield self.simulation.target.copy()

    def hand(self, opening: float) -> Motion:
        """Open or close to `opening` [m] and wait for as long as the fingers need."""
        before = max(float(self.simulation.joint_state()[self._hand]), 0.0)
        travel = abs(before - max(opening, 0.0)) / 2
        target = self.simulation.target.copy()
        target[self._hand] = opening
        settle = 0.15 if opening > before else 0.3
        for _ in range(_steps(travel / self._body.finger_speed + settle)):
            yield target.copy()

    def squeeze(self) -> Motion:
        """Close on whatever is between the fingers, with full force."""
        before = float(self.simulation.joint_state()[self._hand])
        target = self.simulation.target.copy()
        target[self._hand] = self._body.openings[0]
        for _ in range(_steps(max(before, 0.0) / 2 / self._body.finger_speed + 0.4)):
            yield target.copy()

    def park(self) -> Motion:
        """Return to READY and close the hand on the way."""
        for target in self._free(self._body.ready[self._side]):
            target[self._hand] = 0.0
            yield target

    def reach(self, goal: SE3, opening: float) -> Motion:
        """Free motion, straight in joint space, to `goal`; the hand opens on the way."""
        for target in self._free(self._kinematics.solve(goal, self._posture)):
            target[self._hand] = opening
            yield target

    def line(self, goal: SE3, speed: float | None = None) -> Motion:
        """Straight motion of the hand to `goal` with a peak `speed` [m/s]."""
        start = self.tcp
        distance = float(np.linalg.norm(position(goal) - position(start)))
        turn = turn_angle(start, goal)
        peak = max(distance / (speed or self.CARRY_SPEED), turn / self.TURN_SPEED)
        yield from self.path(lambda share: between(start, goal, share), peak * EASE_PEAK)

    def path(self, curve: Curve, seconds: float, *, eased: bool = True) -> Motion:
        """Follow `curve` over [0, 1] in `seconds` at nominal tempo, slower if a joint must."""
        count = _steps(seconds / self.style.tempo)
        for _ in range(_REPLANS):
            shares = np.linspace(0, 1, count + 1)[1:]
            plan = self._solve(curve, ease(shares) if eased else shares)
            excess = self._excess_speed(plan)
            if excess <= 1:
                yield from self._play(plan)
                return
            count = int(np.ceil(count * min(max(1.05 * excess, 1.15), 3.0)))
        raise SkillError(
            f"The {self._side} arm cannot follow a path within its joint speeds; "
            "move the object nearer to its nominal place."
        )

    # -- grasps ----------------------------------------------------------------------------------

    def easier(self, grasp: SE3) -> SE3:
        """Return the grasp, or that with exchanged fingers if it is nearer to the posture."""
        other = flipped(grasp)
        return grasp if self._distance(grasp) <= self._distance(other) else other

    def before(self, grasp: SE3) -> SE3:
        """Return the pose at which the straight approach to a grasp begins."""
        return shifted(grasp, -APPROACH * rotation(grasp)[:, 2])

    def enter(self, grasp: SE3) -> Motion:
        """Approach a grasp and squeeze."""
        opening = float(self.simulation.target[self._hand])
        if self.style.hesitation:
            yield from self.wait(self.style.hesitation)
        yield from self.line(grasp, self.APPROACH_SPEED)
        yield from self.squeeze()
        if self.style.regrasp:
            yield from self.hand(opening)
            yield from self.squeeze()

    def take(self, grasp: SE3, opening: float) -> Motion:
        """Move to the start of the approach to a grasp, approach it, and squeeze."""
        yield from self.reach(self.before(grasp), opening)
        yield from self.enter(grasp)

    def release(self, opening: float, back: float = APPROACH) -> Motion:
        """Open by `opening` [m] and retreat along the tool's axis."""
        yield from self.hand(opening)
        yield from self.line(shifted(self.tcp, -back * rotation(self.tcp)[:, 2]), 0.2)

    def turn_back(self, start: SE3, goal: SE3) -> Motion:
        """Move half-way from `start` to `goal`, rest, and return to `start`."""
        yield from self.line(between(start, goal, 0.5))
        yield from self.wait(SECOND_THOUGHTS)
        yield from self.line(start)

    def choose_way(self, ways: Sequence[Sequence[Curve]]) -> int:
        """Return the number of the first way whose curves can all be followed; keep its posture.

        Raises:
            SkillError: there is none, from any of the arm's postures.
        """
        for number, curves in enumerate(ways):
            for posture in self._postures:
                self._prefer(posture)
                if self._can_follow(curves):
                    return number
        raise SkillError(
            f"The {self._side} arm has no posture from which it can follow its path; "
            "move the object nearer to its nominal place."
        )

    # -- parts -----------------------------------------------------------------------------------

    def _prefer(self, posture: np.ndarray) -> None:
        self._posture = posture
        self._kinematics.prefer(posture)

    def _can_follow(self, curves: Sequence[Curve]) -> bool:
        try:
            joints = self._kinematics.solve(curves[0](0.0), self._posture)
            for curve in curves:
                for share in np.linspace(0, 1, _REHEARSAL_SAMPLES + 1)[1:]:
                    before, joints = joints, self._kinematics.solve(curve(float(share)), joints)
                    if np.abs(joints - before).max() > _LARGEST_TURN:
                        return False
        except SkillError:
            return False
        return True

    def _distance(self, goal: SE3) -> float:
        try:
            joints = self._kinematics.solve(goal, self._posture)
            return float(np.linalg.norm(joints - self._posture))
        except SkillError:
            return np.inf

    def _solve(self, curve: Curve, shares: np.ndarray) -> np.ndarray:
        plan, seed = [], self.joints
        for share in shares:
            seed = self._kinematics.solve(curve(float(share)), seed)
            plan.append(seed)
        return np.array(plan)

    def _excess_speed(self, plan: np.ndarray) -> float:
        """Return the largest joint speed of a plan, as a share of the allowed speed.

        The controller's cubic is fastest two thirds through a step, not at its ends.
        """
        speeds = np.diff(plan, axis=0, prepend=self.joints[None]) / CONTROL_TIMESTEP
        before = np.vstack([np.zeros(self._body.width), speeds[:-1]])
        peaks = np.maximum(np.abs(speeds), np.abs(4 * speeds - before) / 3)
        return float((peaks / (SPEED_MARGIN * self._body.speeds)).max())

    def _free(self, goal: np.ndarray) -> Motion:
        start = self.joints.copy()
        span = float((np.abs(goal - start) / self._body.reach_speeds).max())  # [s] at the peak
        count = _steps(max(span * EASE_PEAK / self.style.tempo, 0.5))
        shares = np.linspace(0, 1, count + 1)[1:]
        plan = start + ease(shares)[:, None] * (goal - start)
        aside = self.style.bow * self._body.bow + self._body.arc
        plan += np.outer(np.sin(np.pi * shares) ** 2, aside)
        yield from self._play(plan)

    def _play(self, plan: np.ndarray) -> Motion:
        for joints in plan:
            target = self.simulation.target.copy()
            target[self._joints] = joints
            yield target


def _steps(seconds: float) -> int:
    """Return the number of control steps that last at least `seconds`."""
    return max(int(np.ceil(seconds / CONTROL_TIMESTEP - 1e-9)), 1)
