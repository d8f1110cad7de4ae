"""The environment whose sub-tasks are drawn is the physical one, but for what is drawn."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3

from teasim.common.errors import ConfigError
from teasim.constants import SUBTASKS
from teasim.envs.transitions import (
    START,
    Moment,
    Situation,
    Transitions,
    apply_change,
    change_between,
    load_transitions,
    situation,
    situations,
)
from teasim.task.recipes import SEQ_1, recognisable
from teasim.world.simulation import STATION_STATE_NAMES

AT = {name: place for place, name in enumerate(STATION_STATE_NAMES)}


@pytest.fixture
def env(make):
    return make("TeaMakingEvents")


@pytest.mark.filterwarnings("ignore:.*no render modes.*:UserWarning")
def test_the_checkers_of_gymnasium_and_stable_baselines_find_nothing(env):
    check_env(env.unwrapped)
    check_env_sb3(env.unwrapped)


def test_its_spaces_infos_and_metadata_are_those_of_the_physical_one(env, make):
    physics = make("TeaMakingSubtasks")
    assert env.observation_space == physics.observation_space
    assert env.action_space == physics.action_space
    for key in ("violations", "violation_kinds"):
        assert env.metadata[key] == physics.metadata[key]
    ours, theirs = (one.reset(seed=0)[1] for one in (env, physics))
    assert ours == theirs


def test_a_seed_gives_the_layout_of_the_physical_one(env, make):
    physics = make("TeaMakingSubtasks")
    for seed in range(3):
        ours, theirs = (one.reset(seed=seed)[0] for one in (env, physics))
        # Settling moves a thing by less than a millimetre.
        np.testing.assert_allclose(
            ours["environment_state"], theirs["environment_state"], atol=2e-3
        )
        np.testing.assert_allclose(ours["agent_pos"], theirs["agent_pos"], atol=2e-3)


@pytest.mark.slow
def test_a_sub_task_changes_what_it_changes_in_physics(env, make):
    """Every number, within what varies between scenes: 1 cm, a tenth of a quaternion, 2 ml."""
    physics = make("TeaMakingSubtasks")
    pair = (env, physics)
    for one in pair:
        one.reset(seed=3)
    for name in (*SEQ_1[:3], "add_tea_bag", *SEQ_1[3:]):
        ours, theirs = (one.step(SUBTASKS.index(name)) for one in pair)
        for key in ("subtasks_done", "violations", "refused", "correct_action", "reward_terms"):
            assert ours[4][key] == theirs[4][key]
        assert ours[1:4] == theirs[1:4]
        assert ours[4]["time"] == pytest.approx(theirs[4]["time"], abs=4)
        gaps = np.abs(ours[0]["environment_state"] - theirs[0]["environment_state"])
        amounts = gaps[AT["kettle_amount"] : AT["cup_tea"]]
        assert amounts.max() < 2
        places = gaps[[AT[f"{thing}_{axis}"] for thing in ("cup", "kettle") for axis in "xyz"]]
        assert places.max() < 0.01
    assert ours[2]


def test_following_the_correct_action_makes_tea_in_seven(env):
    for seed in range(20):
        _, info = env.reset(seed=seed)
        for _ in range(7):
            *_, terminated, truncated, info = env.step(info["correct_action"])
        assert (terminated, truncated, info["success"]) == (True, False, True)


def test_any_sequence_completes_what_the_recipes_say(env):
    random = np.random.default_rng(0)
    for seed in range(50):
        env.reset(seed=seed)
        steps = random.integers(len(SUBTASKS), size=6)
        for step in steps:
            *_, info = env.step(step)
        assert info["subtasks_done"] == recognisable(
            [
                n
                for k, n in enumerate(SUBTASKS[s] for s in steps)
                if n != "add_tea_bag" or "add_tea_bag" not in [SUBTASKS[s] for s in steps[:k]]
            ]
        )


def test_the_number_of_actions_is_limited(make):
    env = make("TeaMakingEvents", max_actions=2)
    env.reset(seed=0)
    assert not env.step(0)[3]
    assert env.step(0)[3]


def test_every_situation_was_measured_and_no_other_exists():
    measured = load_transitions().changes
    assert set(measured) == situations()
    assert min(len(found) for found in measured.values()) >= 8
    numbers = [c.things for found in measured.values() for c in found]
    assert np.isfinite(numbers).all()


def test_situations_are_all_that_random_sequences_meet():
    random = np.random.default_rng(1)
    met = {situation(START, ())}
    for _ in range(300):
        done: tuple[str, ...] = ()
        for name in random.choice(SUBTASKS, 10):
            met.add(situation(str(name), done))
            done = recognisable((*done, str(name)))
    assert met == situations()


def moments():
    random = np.random.default_rng(2)

    def draw(done):
        things = random.normal(size=len(STATION_STATE_NAMES))
        quaternions = things[: 7 * 6].reshape(6, 7)[:, 3:]
        quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
        things[AT["kettle_amount"] : AT["cup_tea"]] = random.uniform(0, 100, 6)
        things[-2:] = random.uniform(0, 0.9, 2)
        joints = random.normal(size=16).astype(np.float32)
        return Moment(joints, things, random.random(3), done, random.random())

    return draw


@pytest.mark.parametrize("subtask", [START, *SUBTASKS])
@pytest.mark.parametrize("happened", [True, False])
def test_a_change_leads_to_where_it_was_measured(subtask, happened):
    draw = moments()
    before = draw(())
    after = draw((subtask,) if happened and subtask != START else ())
    found = apply_change(before, subtask, change_between(before, after, subtask))
    np.testing.assert_allclose(found.things, after.things, atol=1e-5)
    np.testing.assert_allclose(found.spilled, after.spilled, atol=1e-6)
    np.testing.assert_array_equal(found.joints, after.joints)
    assert (found.done, found.time) == (after.done, pytest.approx(after.time))


def test_transitions_survive_a_file_bit_for_bit(tmp_path):
    measured = load_transitions().changes
    some = Transitions({here: found[:2] for here, found in list(measured.items())[:5]})
    some.save(tmp_path / "some.npz")
    again = load_transitions(tmp_path / "some.npz").changes
    assert list(again) == list(some.changes)
    for here, found in some.changes.items():
        for one, other in zip(found, again[here], strict=True):
            for name, value in vars(one).items():
                assert value.tobytes() == getattr(other, name).tobytes(), name


def test_a_situation_that_was_not_measured_is_named():
    moment = Moment(np.zeros(16), np.zeros(len(STATION_STATE_NAMES)), np.zeros(3), (), 0.0)
    with pytest.raises(ConfigError) as error:
        Transitions({}).draw(moment, "stir", np.random.default_rng(0))
    here = Situation("stir", effect=False, bag=False, water=False)
    assert str(error.value) == (
        f"No transition was measured for {here}; run 'python scripts/fit_events.py fit'."
    )


def test_pictures_are_refused():
    with pytest.raises(ConfigError) as error:
        gymnasium.make("teasim:teasim/TeaMakingEvents-v0", obs_type="pixels")
    assert str(error.value) == (
        "TeaMakingEvents-v0 has no obs_type 'pixels'; choose state, or the environment "
        "teasim/TeaMakingSubtasks-v0."
    )
