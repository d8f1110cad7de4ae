"""Joint targets as actions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.constants import GRIPPER_OPEN, GRIPPER_SQUEEZE, STATE_NAMES
from teasim.envs.actions import DELTA_SHARE
from teasim.envs.joint_env import TeaMakingEnv
from teasim.world.bodies.yumi import JOINT_SPEEDS

ENV = TeaMakingEnv()
DELTA = TeaMakingEnv(control="delta")
for env in (ENV, DELTA):
    env.reset(seed=0)


@given(st.lists(st.floats(-1, 1, width=32), min_size=16, max_size=16))
def test_actions_and_targets_are_two_ways_to_say_the_same(values):
    action = np.array(values, dtype=np.float32)
    assert DELTA.action(DELTA.target(action.astype(np.float64))) == pytest.approx(action, abs=1e-6)
    assert ENV.action(ENV.target(action.astype(np.float64))) == pytest.approx(action, abs=1e-6)


def test_actions_span_the_joints_ranges_and_the_grippers():
    low, high = ENV.target(np.full(16, -1.0)), ENV.target(np.full(16, 1.0))
    model = ENV.unwrapped._simulation.model
    assert (low[0], high[0]) == pytest.approx(tuple(model.joint("right_joint_1").range))
    assert (low[11], high[11]) == pytest.approx(tuple(model.joint("left_joint_4").range))
    assert (low[14:], high[14:]) == (
        pytest.approx([GRIPPER_SQUEEZE] * 2),
        pytest.approx([GRIPPER_OPEN] * 2),
    )
    assert ENV.target(np.full(16, 9.0)) == pytest.approx(high)


def test_a_full_delta_is_a_share_of_what_the_joints_largest_speed_covers(make):
    env = make("TeaMaking", control="delta")
    env.reset(seed=0)
    last = env.unwrapped._simulation.target.copy()
    full = np.r_[np.full(14, -1.0), 1.0, -1.0]
    expected = last[:14] - 0.1 * DELTA_SHARE * np.tile(JOINT_SPEEDS, 2)
    low = [env.unwrapped._simulation.model.joint(name).range[0] for name in STATE_NAMES[:14]]
    for _ in range(2):
        target = env.unwrapped.target(full)
        assert target[:14] == pytest.approx(np.maximum(expected, low))
        assert target[14:] == pytest.approx([GRIPPER_OPEN, GRIPPER_SQUEEZE])
        env.step(full)
        assert env.unwrapped._simulation.target == pytest.approx(target)
        expected = target[:14] - 0.1 * DELTA_SHARE * np.tile(JOINT_SPEEDS, 2)


def test_a_delta_of_nothing_is_holding_still(make):
    env = make("TeaMaking", control="delta")
    env.reset(seed=0)
    last = env.unwrapped._simulation.target.copy()
    env.step(env.unwrapped.action(last))
    assert (env.unwrapped._simulation.target[:14] == last[:14]).all()


def test_an_episode_ends_after_three_minutes(make):
    assert make("TeaMaking").spec.max_episode_steps == 1800


def test_holding_still_changes_nothing(make):
    env = make("TeaMaking")
    start, _ = env.reset(seed=0)
    hold = env.unwrapped.action(start["agent_pos"].astype(np.float64))
    after, reward, terminated, truncated, info = env.step(hold)
    assert after["agent_pos"] == pytest.approx(start["agent_pos"], abs=1e-3)
    assert (reward, terminated, truncated, info["subtasks_done"]) == (0, False, False, ())
    assert info["time"] == pytest.approx(0.1)
