"""Joint targets as actions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.constants import GRIPPER_OPEN, GRIPPER_SQUEEZE
from teasim.envs.joint_env import TeaMakingEnv
from teasim.skills.arm import Style
from teasim.skills.library import perform
from teasim.world.simulation import Simulation
from teasim.world.station import sample_layout

ENV = TeaMakingEnv()


@given(st.lists(st.floats(-1, 1, width=32), min_size=16, max_size=16))
def test_actions_and_targets_are_two_ways_to_say_the_same(values):
    action = np.array(values, dtype=np.float32)
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


@pytest.mark.parametrize("subtask", ["turn_on_oven", "add_tea_bag"])
def test_replaying_a_skills_log_does_the_sub_task_again(make, subtask):
    env = make("TeaMaking")
    env.reset(seed=4)
    simulation = Simulation()
    simulation.reset(sample_layout(np.random.Generator(np.random.PCG64(4))))
    rewards, done = [], ()
    for target in perform(subtask, simulation, Style()):
        simulation.step(target)
        observation, reward, terminated, _, info = env.step(env.unwrapped.action(target))
        rewards.append(reward)
        assert info["subtasks_done"] == simulation.subtasks_done
    done = simulation.subtasks_done
    assert done == (subtask,)
    assert sum(rewards) == pytest.approx(1 / 7)
    assert rewards.count(0.0) == len(rewards) - 1
    assert not terminated
    # The log is float32, so it is the same motion and not the same bits.
    assert observation["agent_pos"] == pytest.approx(simulation.joint_state(), abs=1e-3)
    assert observation["environment_state"] == pytest.approx(
        simulation.environment_state(), abs=0.01
    )


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
