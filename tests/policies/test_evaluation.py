"""A policy whose every choice is known gets exactly the scores that follow from them."""

from contextlib import closing

import gymnasium as gym
import numpy as np
import pytest

from policies.data.samples import ObservationSpec
from policies.play.environments import make_environment, reported, violation_words
from policies.play.evaluation import MODES, evaluate
from policies.play.rollout import run_episode
from policies.play.video import STRIP, caption
from policies.settings import EnvironmentConfig, EvaluationConfig
from teasim.common.errors import CheckpointError, ConfigError
from teasim.common.statistics import rate
from teasim.common.workers import Workers
from teasim.constants import STATE_NAMES
from teasim.pool.clips import VideoClip, check_decodable
from tests.policies.fakes import FAKE_WORLD, FLAGS, SEQ_1, SUBTASKS, ScriptedPolicy


def config(episodes=3, **others):
    return EvaluationConfig(episodes, environment=FAKE_WORLD, **others)


def test_the_reference_order_scores_100_percent_in_both_modes():
    scores = evaluate(ScriptedPolicy(), config())
    assert tuple(scores) == MODES
    for s in scores.values():
        assert s.policy_accuracy.hits == s.policy_accuracy.trials == 21
        assert s.lenient_accuracy.value == s.success.value == 1
        assert all(done == rate(3, 3) for done in s.completion.values())
        assert s.violations == {"stove left on": rate(0, 3), "spilled": rate(0, 3)}
        assert s.violation_counts == {}
        assert [episode.seed for episode in s.episodes] == [1000, 1001, 1002]


def test_another_legal_order_is_lenient_but_not_strict():
    s = evaluate(ScriptedPolicy((0, 2, 4, 3, 6, 1, 5)), config(1))["deterministic"]
    assert s.success.value == s.lenient_accuracy.value == 1
    # Sugar first: wrong; then the tea bag, which the reference has wanted all along: right.
    assert [a.correct for a in s.episodes[0].actions] == [True, False, *[True] * 5]


def test_an_oven_left_on_is_unsafe_and_a_stuck_policy_is_cut_off():
    s = evaluate(ScriptedPolicy((0, 4, 4, 4, 4, 4, 4)), config(2))["deterministic"]
    assert s.violations["stove left on"].value == 1
    assert s.success.value == 0
    assert s.policy_accuracy.hits == 4
    assert s.policy_accuracy.trials == 28
    assert s.completion["add_tea_bag"].value == 1
    assert s.completion["stir"].value == 0
    assert s.violation_counts == {
        "add_tea_bag too early or again": 2,
        "turn_on_oven too early or again": 2,
        "unsafe": 2,
    }


def test_the_interval_counts_episodes_not_repeated_errors():
    s = evaluate(ScriptedPolicy((0, 4, 4, 4, 4, 4, 4)), config(1))["deterministic"]
    assert s.policy_accuracy.high > 0.7


def test_workers_change_nothing():
    assert evaluate(ScriptedPolicy(), config(5), workers=Workers(2)) == evaluate(
        ScriptedPolicy(), config(5)
    )


def test_every_action_is_told_from_the_reference():
    with make_environment(FAKE_WORLD, ScriptedPolicy.spec) as env:
        episode = run_episode(env, ScriptedPolicy(), 0, deterministic=True)
    assert [action.reference for action in episode.actions] == [SUBTASKS[a] for a in SEQ_1]


def test_a_policy_for_other_subtasks_is_refused():
    policy = ScriptedPolicy()
    policy.action_names = ("crack_egg",)
    with pytest.raises(CheckpointError) as error:
        evaluate(policy, config(1))
    assert str(error.value) == (
        "The policy chooses from crack_egg, but the environment's sub-tasks are "
        f"{', '.join(SUBTASKS)}."
    )


def test_a_policy_with_other_joints_is_refused():
    policy = ScriptedPolicy()
    policy.spec = type(policy.spec)(("left",), 64, 64, ("elbow",))
    with pytest.raises(CheckpointError, match=r"sees 1 joint positions, .* shows 16\.$"):
        evaluate(policy, config(1))
    policy.spec = ObservationSpec((), 0, 0, STATE_NAMES, ("kettle_x",))
    with pytest.raises(CheckpointError) as error:
        evaluate(policy, config(1))
    assert str(error.value) == (
        "The policy sees 1 numbers of the environment state, but the environment shows 7."
    )


def test_an_unknown_environment_is_named():
    world = EnvironmentConfig("nowhere/Nothing-v0")
    with pytest.raises(ConfigError, match="Cannot make the environment 'nowhere/Nothing-v0'"):
        evaluate(ScriptedPolicy(), EvaluationConfig(1, environment=world))


def test_no_episode_is_no_evaluation():
    with pytest.raises(ConfigError, match=r"^episodes is 0; choose 1 or more\.$"):
        EvaluationConfig(0)


def test_the_video_has_one_frame_per_decision_and_the_last(tmp_path):
    evaluate(ScriptedPolicy(), config(1, video=tmp_path / "seen"))
    assert [path.name for path in (tmp_path / "seen").iterdir()] == ["episode_1000.mp4"]
    clip = VideoClip.whole(tmp_path / "seen" / "episode_1000.mp4")
    assert check_decodable(clip.path) == 8
    frames = clip.frames(range(8))
    assert frames.shape == (8, 64 + STRIP, 128, 3)
    pictures, strips = frames[:, :64], frames[:, 64:]
    assert np.ptp(pictures[0].mean(axis=(1, 2))) < 3
    assert np.ptp(pictures[-1].mean(axis=(1, 2))) > 10
    assert (strips.max(axis=(1, 2, 3)) > 150).all()  # every strip holds a text


@pytest.mark.slow
def test_the_video_of_the_station_shows_motion(tmp_path):
    policy = ScriptedPolicy()
    policy.spec = ObservationSpec(("left",), 64, 64, STATE_NAMES)
    world = EnvironmentConfig(max_actions=2)
    filmed = EvaluationConfig(1, environment=world, video=tmp_path / "seen")
    played = evaluate(policy, filmed)
    assert played == evaluate(policy, EvaluationConfig(1, environment=world))
    clip = VideoClip.whole(tmp_path / "seen" / "episode_1000.mp4")
    count = check_decodable(clip.path)
    assert count > 100  # two sub-tasks of several seconds, ten pictures a second
    frames = clip.frames(range(count)).astype(float)[:-20, :64]
    moved = np.abs(np.diff(frames, axis=0)).mean(axis=(1, 2, 3))
    assert (moved > 0.05).mean() > 0.5


def test_a_policy_without_cameras_can_be_filmed_and_sees_no_picture(tmp_path):
    policy = ScriptedPolicy()
    policy.spec = ObservationSpec((), 0, 0, STATE_NAMES, FLAGS)
    s = evaluate(policy, config(1, video=tmp_path / "seen"))["deterministic"]
    assert s.success.value == 1
    assert check_decodable(tmp_path / "seen" / "episode_1000.mp4") == 8


def test_a_caption_leaves_the_picture_alone_and_fits():
    frame = np.full((64, 64, 3), 90, dtype=np.uint8)
    captioned = caption(frame, "5 turn_off_oven")
    np.testing.assert_array_equal(captioned[:64], frame)
    lit = captioned[64:].any(axis=(0, 2))
    assert lit[:50].any()
    assert not lit[-2:].any()


class Reports(gym.Env):
    """An environment of which only what it says at the end matters."""

    def __init__(self, **named):
        self.metadata = {"render_modes": [], **named}


def kinds_of(env, violations, *, unsafe=False):
    info = {"success": False, "subtasks_done": (), "violations": violations, "unsafe": unsafe}
    return reported(env, 0, info)["kinds"]


def test_keys_of_one_kind_are_counted_together_and_a_kind_that_did_not_occur_is_listed():
    env = Reports(violation_kinds={"wet": ("spilled_a", "spilled_b"), "hot": ("unsafe",)})
    assert violation_words(env) == {"spilled_a": "wet", "spilled_b": "wet", "unsafe": "hot"}
    assert kinds_of(env, ("spilled_a", "spilled_b")) == {"wet": True, "hot": False}
    assert kinds_of(env, (), unsafe=True) == {"wet": False, "hot": True}
    assert kinds_of(env, ("unsafe",), unsafe=True) == {"wet": False, "hot": True}


def test_a_violation_without_words_is_listed_by_its_key():
    assert kinds_of(Reports(), ("too_fast",), unsafe=True) == {"too fast": True, "unsafe": True}
    assert kinds_of(Reports(violations={"x": "broken cup"}), ()) == {"broken cup": False}


@pytest.mark.parametrize("look", ["fixed", "random"])
def test_a_policy_that_sees_pictures_sees_the_look_that_was_asked_for(look):
    spec = ObservationSpec(("left",), 32, 32)
    with closing(make_environment(EnvironmentConfig(look=look), spec)) as env:
        first, other = (env.reset(seed=seed, options={"randomize": False})[0] for seed in (0, 1))
    assert np.array_equal(first["pixels"], other["pixels"]) == (look == "fixed")
