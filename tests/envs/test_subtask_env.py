"""Whole sub-tasks as actions."""

import pickle

import numpy as np
import pytest

from teasim.common.errors import ConfigError
from teasim.constants import SUBTASKS
from teasim.task.recipes import SEQ_1

TURN_ON, ADD_WATER, _, _, ADD_TEA_BAG, STIR, TURN_OFF = range(7)


@pytest.mark.slow
def test_following_the_correct_action_makes_tea_in_seven(make):
    env = make("TeaMakingSubtasks")
    _, info = env.reset(seed=21)
    actions, rewards = [], []
    while not info["success"] and len(actions) < 14:
        action = info["correct_action"]
        assert action in info["allowed_actions"]
        assert info["unsafe"] == ("turn_on_oven" in actions and "turn_off_oven" not in actions)
        _, reward, terminated, truncated, info = env.step(action)
        actions.append(SUBTASKS[action])
        rewards.append(reward)
    assert tuple(actions) == SEQ_1
    assert rewards == [0.0] * 6 + [1.0]
    assert (terminated, truncated) == (True, False)
    assert info["subtasks_done"] == SEQ_1
    assert (info["correct_action"], info["allowed_actions"], info["violations"]) == (-1, (), ())
    assert (info["is_success"], info["unsafe"], info["refused"]) == (True, False, "")


def test_a_second_tea_bag_is_refused_and_said_so(make):
    env = make("TeaMakingSubtasks")
    env.reset(seed=0)
    *_, first = env.step(ADD_TEA_BAG)
    observation, reward, terminated, truncated, info = env.step(ADD_TEA_BAG)
    assert first["refused"] == ""
    assert info["refused"] == "The tea bag is in the cup already; choose another sub-task."
    assert (reward, terminated, truncated) == (0, False, False)
    assert info["subtasks_done"] == ("add_tea_bag",)
    assert 1.0 <= info["time"] - first["time"] <= 1.5
    assert observation in env.observation_space


def test_a_break_of_the_precedence_is_written_down_and_the_oven_is_unsafe(make):
    env = make("TeaMakingSubtasks")
    env.reset(seed=0)
    *_, info = env.step(ADD_WATER)
    assert info["violations"] == ("add_water_before_turn_off_oven",)
    assert info["correct_action"] == TURN_ON
    *_, info = env.step(TURN_ON)
    assert info["unsafe"]
    assert TURN_OFF in info["allowed_actions"]
    assert STIR not in info["allowed_actions"]


@pytest.mark.usefixtures("quick")
def test_the_number_of_actions_is_limited(make):
    env = make("TeaMakingSubtasks", max_actions=2)
    for _ in range(2):
        env.reset(seed=0)
        *_, truncated, _ = env.step(TURN_ON)
        assert not truncated
        _, _, terminated, truncated, info = env.step(TURN_OFF)
        assert (terminated, truncated, info["success"]) == (False, True, False)


def test_the_robot_is_at_ready_and_at_rest_at_every_decision(make):
    env = make("TeaMakingSubtasks")
    start, _ = env.reset(seed=0)
    later, *_ = env.step(TURN_ON)
    assert later["agent_pos"][:14] == pytest.approx(start["agent_pos"][:14], abs=0.01)


@pytest.mark.parametrize(
    ("action", "word"),
    [
        (7, "7"),
        (-1, "-1"),
        (np.int64(9), "np.int64(9)"),
        (np.nan, "nan"),
        (2.5, "2.5"),
        ("stir", "'stir'"),
    ],
)
def test_what_is_no_sub_task_is_refused_and_harms_nothing(make, action, word):
    env = make("TeaMakingSubtasks")
    env.reset(seed=0)
    before = pickle.dumps(env.unwrapped.get_state())
    with pytest.raises(ConfigError) as error:
        env.step(action)
    assert str(error.value) == f"Unknown action {word}; choose a number from 0 to 6."
    assert pickle.dumps(env.unwrapped.get_state()) == before


def test_a_skill_goes_on_from_a_state_bit_for_bit(make):
    env = make("TeaMakingSubtasks", max_actions=2).unwrapped
    env.reset(seed=1)
    env.step(ADD_TEA_BAG)
    state = env.get_state()
    first = env.step(TURN_ON)
    env.reset(seed=2)
    env.set_state(pickle.loads(pickle.dumps(state)))
    second = env.step(TURN_ON)
    for key, values in first[0].items():
        assert values.tobytes() == second[0][key].tobytes()
    assert first[1:] == second[1:]
    assert first[3]  # the action before it was counted, too
