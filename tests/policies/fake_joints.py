"""A tiny stand-in for the joint level: sub-tasks are places to go to, one after the other."""

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from policies.settings import EnvironmentConfig
from teasim.constants import STATE_NAMES, SUBTASKS
from teasim.pool import EpisodeRecord, EpisodeWriter, Pool, PoolHeader, Span, finalize_pool
from tests.policies.fakes import FLAGS, KINDS, SEQ_1, SIZE, flags

JOINTS = len(STATE_NAMES)
PLACES = np.random.default_rng(5).uniform(-1, 1, (len(SUBTASKS), JOINTS))
NEAR = 0.15
"""How near all joints must come to the place of a sub-task."""
FAKE_JOINTS_ID = "tests.policies.fake_joints:teasim-tests/FakeJoints-v0"
FAKE_JOINTS = EnvironmentConfig(FAKE_JOINTS_ID, max_actions=None)


class FakeJoints(gym.Env[dict[str, Any], Any]):
    """Joints go where they are told; the next sub-task of Seq_1 is done where its place is."""

    metadata = {"render_modes": [], "violation_kinds": KINDS}  # noqa: RUF012

    def __init__(
        self, obs_type: str = "state", quality: str = "fast", randomize: bool = True
    ) -> None:
        assert (obs_type, quality) == ("state", "fast")
        self.randomize = randomize
        self.action_space = gym.spaces.Box(-1, 1, (JOINTS,), np.float32)
        self.observation_space = gym.spaces.Dict(
            agent_pos=gym.spaces.Box(-4, 4, (JOINTS,), np.float32),
            environment_state=gym.spaces.Box(0, 1, (len(FLAGS),), np.float32),
        )

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:  # noqa: ARG002
        super().reset(seed=seed)
        self.done: list[int] = []
        spread = 0.02 if self.randomize else 0.0
        self.joints = self.np_random.normal(0, 1, JOINTS) * spread
        return self._observe(), self._info()

    def action(self, target: Any) -> Any:
        return np.asarray(target) / 2

    def step(self, action: Any) -> Any:
        self.joints = 2 * np.asarray(action, dtype=float)
        following = SEQ_1[len(self.done)]
        if np.abs(self.joints - PLACES[following]).max() < NEAR:
            self.done.append(following)
        success = len(self.done) == len(SEQ_1)
        return self._observe(), float(success), success, False, self._info()

    def _observe(self) -> dict[str, Any]:
        joints = self.joints.astype(np.float32)
        return {"agent_pos": joints, "environment_state": flags(set(self.done))}

    def _info(self) -> dict[str, Any]:
        return {
            "success": len(self.done) == len(SEQ_1),
            "subtasks": SUBTASKS,
            "subtasks_done": tuple(SUBTASKS[place] for place in self.done),
            "violations": (),
            "unsafe": 0 in self.done and 6 not in self.done,
        }


def make_joint_pool(path: Path, count: int = 4) -> Pool:
    """Straight ways from place to place, each demonstration at a tempo of its own."""
    header = PoolHeader(
        fps=10,
        cameras=("left",),
        height=SIZE,
        width=SIZE,
        subtasks=SUBTASKS,
        state_names=STATE_NAMES,
        environment_state_names=FLAGS,
        robot_type="abb_yumi",
        config={"seed": 0},
    )
    for index in range(count):
        _write_episode(path, index, header, steps=4 + index)
    return finalize_pool(path, header, count)


def _write_episode(path: Path, index: int, header: PoolHeader, *, steps: int) -> None:
    dark = np.zeros((SIZE, SIZE, 3), dtype=np.uint8)
    here, done, spans = np.zeros(JOINTS), set[int](), []
    with EpisodeWriter(path, index, header) as writer:
        for number, subtask in enumerate(SEQ_1):
            spans.append(Span(SUBTASKS[subtask], number * steps, (number + 1) * steps))
            for target in np.linspace(here, PLACES[subtask], steps + 1)[1:]:
                writer.add_frame(
                    images={"left": dark},
                    state=here.astype(np.float32),
                    environment_state=flags(done),
                    action=target.astype(np.float32),
                    subtask_index=subtask,
                )
                here = target
                if np.abs(here - PLACES[subtask]).max() < NEAR:
                    done.add(subtask)
        writer.finish(EpisodeRecord("seq_1", True, (), tuple(spans), "p1", "yumi", index))


gym.register("teasim-tests/FakeJoints-v0", FakeJoints, max_episode_steps=120)
