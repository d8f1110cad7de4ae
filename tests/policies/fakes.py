"""A tiny stand-in for the tea station: the same seam, a picture that shows what was done."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from policies.data.samples import Observation, ObservationSpec, RecurrentState
from policies.settings import EnvironmentConfig
from teasim.constants import STATE_NAMES, SUBTASKS
from teasim.pool import EpisodeRecord, EpisodeWriter, Pool, PoolHeader, Span, finalize_pool

SEQ_1 = (0, 4, 2, 3, 6, 1, 5)
BEFORE = ((0, 6), (6, 1), (4, 5), (1, 5), (2, 5), (3, 5), (0, 1), (0, 2), (0, 3), (0, 4))
SIZE = 64
FLAGS = tuple(f"{name}_done" for name in SUBTASKS)
"""The environment state."""

KINDS = {"stove left on": ("unsafe",), "spilled": ("spilled_water", "spilled_milk")}
"""Kinds of violation, in words that are in no other file: words -> keys."""

FAKE_ID = "tests.policies.fakes:teasim-tests/Fake-v0"
FAKE_WORLD = EnvironmentConfig(FAKE_ID)


def picture(done: set[int], random: np.random.Generator) -> NDArray[np.uint8]:
    """One lit square per finished sub-task; the oven's goes out when it is off again."""
    image = random.normal(110, 2, (SIZE, SIZE, 3))
    shown = done - {0, 6} if 6 in done else done
    for place in shown:
        row, column = 4 + 20 * (place // 3), 4 + 20 * (place % 3)
        image[row : row + 14, column : column + 14] = (230, 60 + 20 * place, 200 - 25 * place)
    return image.clip(0, 255).astype(np.uint8)


def flags(done: set[int]) -> NDArray[np.float32]:
    """One number per sub-task: whether it was done."""
    return np.isin(np.arange(len(FLAGS)), list(done)).astype(np.float32)


class FakeTea(gym.Env[dict[str, Any], int]):
    """The sub-task environment without physics: every allowed action works, others do nothing."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 1, "violation_kinds": KINDS}  # noqa: RUF012

    def __init__(
        self,
        obs_type: str = "state",
        cameras: tuple[str, ...] = ("left", "cup"),
        width: int = SIZE,
        height: int = SIZE,
        render_mode: str | None = None,
        quality: str = "fast",
        randomize: bool = True,
        max_actions: int = 14,
    ) -> None:
        assert obs_type in ("state", "pixels_agent_pos")
        assert (quality, randomize, width, height) == ("fast", True, SIZE, SIZE)
        self.obs_type = obs_type
        self.cameras = cameras
        self.render_mode = render_mode
        self.max_actions = max_actions
        self.action_space = gym.spaces.Discrete(len(SUBTASKS))
        frame = gym.spaces.Box(0, 255, (SIZE, SIZE, 3), np.uint8)
        pixels = gym.spaces.Dict(dict.fromkeys(cameras, frame)) if len(cameras) > 1 else frame
        self.observation_space = gym.spaces.Dict(
            agent_pos=gym.spaces.Box(-4, 4, (len(STATE_NAMES),), np.float32),
            **(
                {"environment_state": gym.spaces.Box(0, 1, (len(FLAGS),), np.float32)}
                if obs_type == "state"
                else {"pixels": pixels}
            ),
        )

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:  # noqa: ARG002
        super().reset(seed=seed)
        self.done: list[int] = []
        self.violations: list[str] = []
        self.taken = 0
        return self._observe(), self._info()

    def step(self, action: int) -> Any:
        if action in self._allowed():
            self.done.append(action)
        else:
            self.violations.append(f"{SUBTASKS[action]} too early or again")
        self.taken += 1
        success = len(self.done) == len(SUBTASKS)
        cut = self.taken >= self.max_actions
        return self._observe(), float(success), success, cut, self._info()

    def _allowed(self) -> list[int]:
        waiting = [b for a, b in BEFORE if a not in self.done]
        return [a for a in range(len(SUBTASKS)) if a not in self.done and a not in waiting]

    def render(self) -> NDArray[np.uint8]:
        assert self.render_mode == "rgb_array"
        return picture(set(self.done), self.np_random)

    def _observe(self) -> dict[str, Any]:
        joints = self.np_random.normal(0, 1e-4, len(STATE_NAMES)).astype(np.float32)
        if self.obs_type == "state":
            return {"agent_pos": joints, "environment_state": flags(set(self.done))}
        frames = {camera: picture(set(self.done), self.np_random) for camera in self.cameras}
        seen = frames if len(frames) > 1 else frames[self.cameras[0]]
        return {"agent_pos": joints, "pixels": seen}

    def _info(self) -> dict[str, Any]:
        left = [action for action in SEQ_1 if action not in self.done]
        success = not left
        return {
            "success": success,
            "is_success": success,
            "subtasks_done": tuple(SUBTASKS[action] for action in self.done),
            "correct_action": left[0] if left else -1,
            "allowed_actions": tuple(self._allowed()),
            "violations": tuple(self.violations),
            "unsafe": 0 in self.done and 6 not in self.done,
            "subtasks": SUBTASKS,
        }


def make_fake_pool(
    path: Path, sequences: Sequence[Sequence[int]], *, seed: int = 0, joints: bool = True
) -> Pool:
    """Play `sequences` of sub-task numbers and log them: two frames of rest, then six of motion."""
    header = PoolHeader(
        fps=10,
        cameras=("left", "cup"),
        height=SIZE,
        width=SIZE,
        subtasks=SUBTASKS,
        state_names=STATE_NAMES if joints else None,
        environment_state_names=FLAGS if joints else None,
        robot_type="abb_yumi" if joints else None,
        config={"seed": seed},
    )
    for index, sequence in enumerate(sequences):
        _write_episode(path, index, header, sequence)
    return finalize_pool(path, header, len(sequences))


def _write_episode(path: Path, index: int, header: PoolHeader, sequence: Sequence[int]) -> None:
    random = np.random.default_rng([header.config["seed"], index])
    spans, done = [], set()
    with EpisodeWriter(path, index, header) as writer:
        for step, subtask in enumerate(sequence):
            spans.append(Span(SUBTASKS[subtask], 8 * step + 2, 8 * step + 8))
            for frame in range(8):
                lift = max(frame - 3, 0) * 0.1  # the robot still rests in the span's first two
                joints = random.normal(lift, 1e-4, len(STATE_NAMES)).astype(np.float32)
                logged = joints if header.state_names else None
                writer.add_frame(
                    images={camera: picture(done, random) for camera in header.cameras},
                    state=logged,
                    environment_state=flags(done) if header.state_names else None,
                    action=logged,
                    subtask_index=subtask if frame >= 2 else -1,
                )
            done.add(subtask)
        correct = tuple(sequence) == SEQ_1
        name = "seq_1" if correct else "seq_3"
        embodiment = "yumi" if header.state_names else "person"
        writer.finish(EpisodeRecord(name, correct, (), tuple(spans), "p1", embodiment, index))


class ScriptedPolicy:
    """Plays a fixed list of sub-tasks over and over, blindly; its memory is the position."""

    spec = ObservationSpec(("left", "cup"), SIZE, SIZE)
    action_names = SUBTASKS

    def __init__(self, script: tuple[int, ...] = SEQ_1) -> None:
        self.script = script

    def set_random_seed(self, seed: int) -> None:
        """Nothing here is random."""

    def predict(
        self,
        observation: Observation,  # noqa: ARG002
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,  # noqa: ARG002
    ) -> tuple[NDArray[np.int64], RecurrentState | None]:
        fresh = state is None or (episode_start is not None and episode_start.any())
        position = 0 if fresh or state is None else int(state[0])
        action = np.asarray(self.script[position % len(self.script)])
        return action, (np.array(position + 1, dtype=np.float32),)


gym.register("teasim-tests/Fake-v0", FakeTea)
