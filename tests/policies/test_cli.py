"""train, then evaluate, as a user calls them; exit codes and sentences."""

import json
import xml.etree.ElementTree as ElementTree

import pytest

from policies.checkpoint import load_policy, save_policy
from policies.cli import evaluate, train
from policies.learners.registry import LEARNERS
from policies.play.rollout import ENVIRONMENT
from teasim.common.errors import CheckpointError, ConfigError, PoolError, TeasimError
from teasim.pool.weight_table import WeightRow, write_weight_table
from tests.policies.fakes import FAKE_ID
from tests.policies.learning import AT_SUBTASKS


@pytest.fixture(scope="module")
def run(fake_pool, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "bc"
    assert train([str(fake_pool.root), "--learner", "bc", "-o", str(folder), "--jobs", "1"]) == 0
    return folder


def try_out(run, *options):
    fixed = ["--env-id", FAKE_ID, "--episodes", "3", "--jobs", "1"]
    return evaluate([str(run), *fixed, *map(str, options)])


def test_a_policy_learns_the_fake_station_from_its_pool(run, tmp_path, capsys):
    json_file, junit = tmp_path / "s.json", tmp_path / "j.xml"
    code = try_out(run, "--min-policy-accuracy", 100, "--json", json_file, "--junit", junit)
    printed = capsys.readouterr().out
    assert code == 0, printed
    assert "policy accuracy  100.0 %" in printed
    scores = json.loads(json_file.read_text())["scores"]
    assert scores["deterministic"]["success"]["percent"] == 100
    assert ElementTree.parse(junit).getroot().find(".//failure") is None


@pytest.fixture(scope="module")
def stirrer(run, tmp_path_factory):
    """A policy that always stirs."""
    policy = load_policy(run)
    policy.network.head.bias.data[5] = 1e3
    folder = tmp_path_factory.mktemp("runs") / "stirrer"
    save_policy(policy, folder, training={})
    return folder


def test_below_the_bar_is_exit_code_1_and_a_failure(stirrer, tmp_path, capsys):
    junit = tmp_path / "j.xml"
    assert try_out(stirrer, "--min-policy-accuracy", 90, "--junit", junit) == 1
    assert "policy accuracy is below 90 %" in capsys.readouterr().out
    assert ElementTree.parse(junit).getroot().find(".//failure") is not None
    assert try_out(stirrer) == 0


def test_the_same_pool_and_seed_give_the_same_file(fake_pool, run, tmp_path):
    train([str(fake_pool.root), "-o", str(tmp_path / "again"), "--jobs", "1"])
    for name in ("policy.safetensors", "policy.json"):
        assert (tmp_path / "again" / name).read_bytes() == (run / name).read_bytes()


def test_flagged_demonstrations_are_left_out(fake_pool, tmp_path, capsys):
    rows = [
        WeightRow(e.demo_id, e.index, 1.0, 0.0, e.index == 6, 0, "") for e in fake_pool.episodes
    ]
    write_weight_table(tmp_path / "weights.csv", rows)
    weights = str(tmp_path / "weights.csv")
    train([str(fake_pool.root), "--weights", weights, "-o", str(tmp_path / "run"), "--jobs", "1"])
    assert "bc on 6 of 7 demonstrations" in capsys.readouterr().out
    training = json.loads((tmp_path / "run" / "policy.json").read_text())["training"]
    assert list(training["demo_weights"].values()) == [1, 1, 1, 1, 1, 1, 0]
    assert training["use"] == "discard"


@pytest.mark.parametrize("learner", AT_SUBTASKS)
def test_every_learner_makes_tea_from_the_state(learner, fake_pool, tmp_path, capsys):
    rows = [
        WeightRow(e.demo_id, e.index, 1.0 - e.index / 10, 0.0, False, 0, "")
        for e in fake_pool.episodes
    ]
    write_weight_table(tmp_path / "weights.csv", rows)
    run = tmp_path / "run"
    options = ["--learner", learner, "--observe", "state", "-o", str(run), "--jobs", "1"]
    options += ["--weights", str(tmp_path / "weights.csv")]
    assert train([str(fake_pool.root), *options]) == 0
    assert try_out(run, "--min-policy-accuracy", 100) == 0, capsys.readouterr().out


def test_experts_are_named_by_episode_or_have_the_largest_weights(fake_pool, tmp_path):
    rows = [
        WeightRow(e.demo_id, e.index, e.index / 10, 0.0, e.index == 6, 0, "")
        for e in fake_pool.episodes
    ]
    write_weight_table(tmp_path / "weights.csv", rows)
    common = ["--learner", "demodice", "--observe", "state", "--jobs", "1"]
    table = ["--weights", str(tmp_path / "weights.csv")]
    for name, options in (("named", ["--expert", "1", "3"]), ("default", table)):
        train([str(fake_pool.root), *common, *options, "-o", str(tmp_path / name)])
    found = [
        json.loads((tmp_path / name / "policy.json").read_text())["training"]["settings"]["experts"]
        for name in ("named", "default")
    ]
    # A quarter of seven is one: the largest weight is flagged, the next is episode 5.
    assert found == [[1, 3], [5]]


def refused(error, call):
    with pytest.raises(error) as caught:
        call()
    assert isinstance(caught.value, TeasimError)
    return str(caught.value)


def test_a_folder_in_use_is_left_alone(fake_pool, tmp_path):
    (tmp_path / "mine.txt").write_text("keep me")
    said = refused(ConfigError, lambda: train([str(fake_pool.root), "-o", str(tmp_path)]))
    assert said == f"The output folder '{tmp_path}' is in use; choose a new or empty one."
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    said = refused(
        ConfigError, lambda: train([str(fake_pool.root), "-o", str(tmp_path / "mine.txt")])
    )
    assert said.endswith("is a file; choose a new or empty folder.")
    assert (tmp_path / "mine.txt").read_text() == "keep me"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--learner", "sac"], f"Unknown learner 'sac'; choose {', '.join(LEARNERS)}."),
        (["--level", "joint"], "The learner 'bc' has no level 'joint'; choose subtask."),
        (["--use", "drop"], "Unknown use 'drop' of weights; choose discard, weight, ignore."),
        (
            ["--observe", "sound"],
            "Unknown observe 'sound'; choose auto, pixels, pixels_agent_pos, state.",
        ),
        (["--jobs", "0"], "jobs is 0; choose 1 or more."),
        (
            ["--learner", "demodice"],
            "The learner 'demodice' needs demonstrations known to be good; name their episodes "
            "with --expert, or give a weight table with --weights.",
        ),
        (
            ["--expert", "0"],
            "The learner 'bc' takes no --expert; only demodice does.",
        ),
    ],
)
def test_bad_options_make_nothing(fake_pool, tmp_path, options, said):
    out = tmp_path / "run"
    assert (
        refused(ConfigError, lambda: train([str(fake_pool.root), *options, "-o", str(out)])) == said
    )
    assert not out.exists()


def test_an_expert_of_another_pool_makes_nothing(fake_pool, tmp_path):
    options = ["--learner", "demodice", "--expert", "7", "-o", str(tmp_path / "run")]
    said = refused(ConfigError, lambda: train([str(fake_pool.root), *options]))
    assert said == f"'{fake_pool.root}' has no episode 7; choose from 0 to 6."
    assert not (tmp_path / "run").exists()


def test_no_pool_makes_nothing(tmp_path):
    refused(PoolError, lambda: train([str(tmp_path / "none"), "-o", str(tmp_path / "run")]))
    assert not (tmp_path / "run").exists()


def test_no_policy_is_one_sentence(tmp_path):
    said = refused(CheckpointError, lambda: try_out(tmp_path / "none"))
    assert "holds no trained policy" in said


def test_a_result_file_that_is_a_folder_is_found_before_the_work(run, tmp_path):
    said = refused(ConfigError, lambda: try_out(run, "--json", tmp_path))
    assert said == f"The output file '{tmp_path}' is a folder; name a file in it."


def test_the_usual_environment_is_the_tea_station():
    assert ENVIRONMENT == "teasim:teasim/TeaMakingSubtasks-v0"


def test_two_policies_are_compared_on_the_same_episodes(run, stirrer, tmp_path, capsys):
    assert try_out(run, "--against", stirrer, "--json", tmp_path / "s.json") == 0
    assert f"beside {stirrer} on the same 3 episodes" in capsys.readouterr().out
    saved = json.loads((tmp_path / "s.json").read_text())
    assert saved["against"] == str(stirrer)
    assert saved["comparison"]["deterministic"]["success"] == {
        "first": 3,
        "second": 0,
        "p_value": 0.25,
    }
