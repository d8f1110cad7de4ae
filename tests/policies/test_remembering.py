"""What is remembered is what would have happened, and it happens once."""

import copy

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from policies.play import remembering
from policies.play.environments import make_environment
from policies.play.evaluation import evaluate, evaluate_all
from policies.play.remembering import Remembering, can_remember
from policies.settings import EnvironmentConfig, EvaluationConfig
from teasim.common.workers import Workers
from tests.policies.fakes import FAKE_WORLD, SEQ_1, FakeTea, ScriptedPolicy


class GoingBack(FakeTea):
    """The fake station with the states of the real one."""

    steps = 0

    def get_state(self):
        random = self.np_random.bit_generator.state
        return copy.deepcopy((self.done, self.violations, self.taken, random))

    def set_state(self, state):
        self.done, self.violations, self.taken, random = copy.deepcopy(state)
        self.np_random.bit_generator.state = random

    def step(self, action):
        self.steps += 1
        return super().step(action)


def played(env, seed, actions):
    seen = [env.reset(seed=seed), *(env.step(action) for action in actions)]
    return [_plain(part) for part in seen]


def _plain(part):
    if isinstance(part, dict):
        return {name: _plain(value) for name, value in part.items()}
    if isinstance(part, tuple):
        return tuple(_plain(value) for value in part)
    return part.tolist() if isinstance(part, np.ndarray) else part


scenes = st.lists(
    st.tuples(st.integers(0, 2), st.lists(st.integers(0, 6), max_size=6)), min_size=1, max_size=6
)


@settings(max_examples=50, deadline=None)
@given(scenes)
def test_every_scene_goes_as_it_would_without_memory(scenes):
    env = Remembering(GoingBack())
    for seed, actions in scenes:
        assert played(env, seed, actions) == played(GoingBack(), seed, actions)


def test_what_was_done_is_not_done_again():
    env = Remembering(world := GoingBack())
    played(env, 0, SEQ_1)
    played(env, 0, SEQ_1)
    assert world.steps == 7
    played(env, 0, (*SEQ_1[:4], 5))
    assert world.steps == 8
    played(env, 1, SEQ_1[:2])
    assert world.steps == 10


def test_the_picture_is_that_of_the_scene_as_it_is():
    env = Remembering(GoingBack(render_mode="rgb_array"))
    played(env, 0, SEQ_1)
    played(env, 0, SEQ_1[:2])
    fresh = GoingBack(render_mode="rgb_array")
    played(fresh, 0, SEQ_1[:2])
    assert (env.render() == fresh.render()).all()


def test_scenes_not_played_for_long_are_forgotten(monkeypatch):
    monkeypatch.setattr(remembering, "SCENES", 2)
    env = Remembering(world := GoingBack())
    for seed in (0, 1, 0, 2, 0):
        played(env, seed, (0,))
    assert world.steps == 3
    played(env, 1, (0,))
    assert world.steps == 4


@pytest.mark.parametrize("given", [{}, {"seed": 0, "options": {"randomize": False}}])
def test_a_scene_that_its_seed_does_not_tell_is_refused(given):
    with pytest.raises(ValueError, match="give one, and no options"):
        Remembering(GoingBack()).reset(**given)


def test_worlds_that_cannot_go_back_are_left_as_they_are():
    assert can_remember(GoingBack())
    assert not can_remember(FakeTea())
    assert not can_remember(gym.make("tests.policies.fakes:teasim-tests/Fake-v0"))


def test_the_tea_station_can_be_remembered():
    env = make_environment(EnvironmentConfig(), ScriptedPolicy.spec)
    assert can_remember(env)
    env.close()


def test_several_policies_score_as_they_do_alone():
    others = ScriptedPolicy(), ScriptedPolicy((0, 4, 4, 2, 3, 6, 1, 5))
    config = EvaluationConfig(5, environment=FAKE_WORLD)
    assert evaluate_all(others, config, workers=Workers(2)) == [
        evaluate(each, config) for each in others
    ]
