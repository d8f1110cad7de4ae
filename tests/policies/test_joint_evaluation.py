"""A joint-level policy is trained, plays, and gets the scores that physics gives it."""

import json

import numpy as np
import pytest

from policies.checkpoint import load_policy
from policies.cli import evaluate, train
from policies.data.samples import ObservationSpec
from policies.play.environments import make_environment
from policies.play.evaluation import MODES
from policies.play.joint_evaluation import evaluate_motion, score_motion
from policies.play.joint_rollout import PATIENCE, MotionEpisode, run_motion
from policies.play.results import motion_summary
from policies.settings import EvaluationConfig
from teasim.common.errors import CheckpointError, ConfigError
from teasim.common.statistics import rate
from teasim.common.workers import Workers
from teasim.constants import SUBTASKS
from tests.policies.fake_joints import FAKE_JOINTS, FAKE_JOINTS_ID
from tests.policies.fakes import SEQ_1
from tests.policies.learning import ROWS, kind_of


@pytest.fixture(scope="module")
def run(joint_pool, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "joints"
    options = ["--learner", "nearest", "--level", "joint", "-o", str(folder), "--jobs", "1"]
    assert train([str(joint_pool.root), *options]) == 0
    return folder


@pytest.mark.parametrize("row", [row for row in ROWS if kind_of(row).levels == ("joint",)])
def test_every_learner_of_joints_trains_saves_and_plays(row, joint_pool, tmp_path):
    """Twice the same bits, from the command line to the episode."""
    quick = {"steps": 30, "width": 16, "batch": 16} if row != "nearest" else {}
    sets = [word for name, value in quick.items() for word in ("--set", f"{name}={value}")]
    fixed = ["--learner", row.partition("@")[0], "--level", "joint", "--jobs", "1", *sets]
    for folder in ("one", "two"):
        assert train([str(joint_pool.root), *fixed, "-o", str(tmp_path / folder)]) == 0
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert names == ["losses.csv", "policy.json", "policy.safetensors"]
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    config = EvaluationConfig(1, environment=FAKE_JOINTS)
    played = [evaluate_motion(load_policy(tmp_path / name), config) for name in ("one", "two")]
    assert played[0] == played[1]
    assert set(played[0]) == set(MODES if row == "nearest" else MODES[:1])


def try_out(run, *options):
    fixed = ["--env-id", FAKE_JOINTS_ID, "--episodes", "3", "--jobs", "1"]
    return evaluate([str(run), *fixed, *map(str, options)])


def test_a_policy_learns_the_fake_joints_from_their_pool(run, tmp_path, capsys):
    assert try_out(run, "--json", tmp_path / "s.json") == 0
    printed = capsys.readouterr().out
    assert "deterministic decisions, episodes: 3" in printed
    assert "sub-tasks done   7.00 of 7 per episode (" in printed
    assert "stopped after    nothing" in printed
    saved = json.loads((tmp_path / "s.json").read_text())
    assert saved["world"]["env_id"] == FAKE_JOINTS_ID
    for scores in saved["scores"].values():
        assert scores["subtasks_done"] == 7
        assert scores["success"]["percent"] == 100
        assert scores["stopped_after"] == {}
        assert [e["last"] for e in scores["episodes"]] == ["stir"] * 3
        assert scores["episodes"][0]["subtasks_done"] == [SUBTASKS[place] for place in SEQ_1]


def test_where_nothing_moves_the_typical_episode_is_played_once(run, capsys):
    assert try_out(run, "--no-randomize") == 0
    printed = capsys.readouterr().out
    assert "deterministic decisions, episodes: 1\n" in printed
    assert "sampled decisions, episodes: 3\n" in printed


def test_workers_change_nothing(run):
    policy = load_policy(run)
    config = EvaluationConfig(5, environment=FAKE_JOINTS)
    assert evaluate_motion(policy, config, workers=Workers(2)) == evaluate_motion(policy, config)


class Still:
    """Holds all joints at 0."""

    draws = False
    spec = ObservationSpec((), 0, 0, ("j",) * 16, ("f",) * 7)
    action_names = ("j",) * 16

    def set_random_seed(self, seed):
        """Nothing here is random."""

    def predict(self, *_given, **_options):
        return np.zeros(16), None


def test_an_episode_without_a_new_subtask_ends_after_the_patience():
    with make_environment(FAKE_JOINTS, Still.spec) as env:
        episode = run_motion(env.unwrapped, Still(), 0, deterministic=True)
        assert (episode.steps, episode.last, episode.success) == (PATIENCE, "none", False)
        assert run_motion(env, Still(), 0, deterministic=True).steps == 120


def test_a_policy_for_other_joints_or_another_state_is_refused():
    policy = Still()
    policy.action_names = ("elbow",)
    with make_environment(FAKE_JOINTS, Still.spec) as env:
        with pytest.raises(CheckpointError, match=r"^The policy controls 1 joints, but the env"):
            run_motion(env, policy, 0, deterministic=True)
        policy = Still()
        policy.spec = ObservationSpec((), 0, 0, ("elbow",))
        with pytest.raises(CheckpointError) as error:
            run_motion(env, policy, 0, deterministic=True)
    assert str(error.value) == (
        "The policy sees 1 numbers of the state, but the environment shows 23."
    )


def episode(done, *, success=False, violations=()):
    return MotionEpisode(
        seed=0,
        steps=100,
        subtasks=("a", "b", "c"),
        success=success,
        subtasks_done=done,
        violations=violations,
        kinds={"spilled": bool(violations)},
    )


def test_the_scores_of_known_episodes():
    played = [
        episode(("a", "b", "c"), success=True),
        episode(("a", "a"), violations=("spilled_milk", "spilled_milk")),
        episode(()),
    ]
    s = score_motion("sampled", played)
    assert s.mean_done == pytest.approx(4 / 3)
    assert s.success == s.violations["spilled"] == rate(1, 3)
    assert s.completion == {"a": rate(2, 3), "b": rate(1, 3), "c": rate(1, 3)}
    assert s.stopped_after == {"none": 1, "a": 1}
    assert s.violation_counts == {"spilled_milk": 1}
    text = motion_summary({"sampled": s})
    assert "  sub-tasks done   1.33 of 3 per episode (" in text
    assert text.endswith("  stopped after    none in 1, a in 1")


@pytest.mark.parametrize(
    "options",
    [
        ("--min-policy-accuracy", 90),
        ("--against", "other"),
        ("--junit", "j.xml"),
        ("--video", "seen"),
    ],
)
def test_what_is_about_choices_is_refused(run, options):
    with pytest.raises(ConfigError) as error:
        try_out(run, *options)
    assert str(error.value) == (
        "A policy at the joint level chooses no sub-tasks; leave out --min-policy-accuracy, "
        "--against, --junit and --video."
    )
