"""A demonstration's log is all that is needed to see it again."""

import numpy as np
import pytest

from teasim.envs.actions import DELTA_SHARE
from teasim.generation import demo_rng
from teasim.rollout import demonstrate, replay
from teasim.skills.arm import SPEED_MARGIN
from teasim.task.mistakes import Plan
from teasim.world.simulation import Simulation

SEED = 4
SUBTASKS = ("turn_on_oven", "add_tea_bag")


def states(simulation: Simulation) -> bytes:
    physics = simulation.data.qpos.tobytes() + simulation.data.qvel.tobytes()
    return physics + simulation.joint_state().tobytes() + simulation.environment_state().tobytes()


def generator() -> np.random.Generator:
    """What `env.reset(seed=SEED)` draws its layout from."""
    return np.random.Generator(np.random.PCG64(SEED))


@pytest.fixture(scope="module")
def log():
    """Targets, all states, and the joints and the station at the end."""
    simulation = Simulation()
    targets, seen = [], []
    for step in demonstrate(simulation, Plan(SUBTASKS), generator()):
        targets.append(step.target)
        seen.append(states(simulation))
    assert simulation.subtasks_done == SUBTASKS
    end = simulation.joint_state(), simulation.environment_state()
    return np.array(targets), [*seen, states(simulation)], end


def test_a_log_is_what_a_pool_holds(log):
    targets, _, _ = log
    assert targets.dtype == np.float32


def test_a_log_gives_the_same_bits_again(log):
    targets, expected, _ = log
    simulation = Simulation()
    found = [states(simulation) for _ in replay(simulation, targets, generator())]
    assert [*found, states(simulation)] == expected
    assert simulation.subtasks_done == SUBTASKS


@pytest.mark.parametrize("control", ["position", "delta"])
def test_the_environment_replays_a_log_but_for_rounding(make, log, control):
    targets, _, (joints, station) = log
    env = make("TeaMaking", control=control)
    env.reset(seed=SEED)
    rewards = []
    for target in targets:
        action = env.unwrapped.action(target)
        assert action in env.action_space  # nothing a skill does is too fast for an action
        observation, reward, terminated, _, info = env.step(action)
        assert env.unwrapped._simulation.target == pytest.approx(target, abs=1e-6)
        rewards.append(reward)
    assert info["subtasks_done"] == SUBTASKS
    assert sum(rewards) == pytest.approx(2 / 7)
    assert rewards.count(0.0) == len(rewards) - 2
    assert not terminated
    # Actions are float32 shares of other ranges: the same motion, not the same bits.
    assert observation["agent_pos"] == pytest.approx(joints, abs=1e-3)
    assert observation["environment_state"] == pytest.approx(station, abs=0.01)


def test_every_plan_of_a_skill_can_be_told_in_deltas():
    assert DELTA_SHARE >= SPEED_MARGIN


def test_every_attempt_at_every_demonstration_has_randomness_of_its_own():
    draws = [demo_rng(*key).random() for key in [(0, 0), (1, 0), (0, 1), (0, 0, 1)]]
    assert len(set(draws)) == 4
    assert demo_rng(0, 0).random() == draws[0]
