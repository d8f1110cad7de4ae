"""train, then evaluate, as a user calls them; exit codes and sentences."""

import json
import shlex
import xml.etree.ElementTree as ElementTree

import pytest
import tyro

import policies
from policies import cli, settings
from policies.checkpoint import load_policy, save_policy
from policies.cli import evaluate, train
from policies.learners.registry import LEARNERS
from policies.settings import EnvironmentConfig, TrainSettings
from teasim.common.errors import CheckpointError, ConfigError, PoolError, TeasimError
from teasim.common.workers import IN_PROCESS
from teasim.pool.weight_table import WeightRow, write_weight_table
from tests.policies.fakes import FAKE_ID
from tests.policies.learning import AT_SUBTASKS

SETTINGS = {verb: getattr(settings, f"{verb.title()}Settings") for verb in cli.EXAMPLES}


@pytest.fixture(scope="module")
def run(fake_pool, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "bc"
    assert train([str(fake_pool.root), "--learner", "bc", "-o", str(folder), "--jobs", "1"]) == 0
    return folder


def try_out(run, *options):
    fixed = ["--env-id", FAKE_ID, "--episodes", "3", "--jobs", "1"]
    return evaluate([str(run), *fixed, *map(str, options)])


def test_the_losses_of_training_can_be_drawn(fake_pool, tmp_path):
    folder = tmp_path / "figures"
    options = ["-o", str(tmp_path / "run"), "--jobs", "1", "--figures", str(folder)]
    assert train([str(fake_pool.root), *options]) == 0
    assert {path.name for path in folder.iterdir()} == {"training.svg", "training.png"}


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


def settings_of(run):
    return json.loads((run / "policy.json").read_text())["training"]["settings"]


def test_settings_of_the_learner_are_used_and_stored(fake_pool, tmp_path):
    options = ["--observe", "state", "--jobs", "1", "--learner", "bc-rnn"]
    options += ["--set", "hidden=3", "--set", "learning-rate=1", "--set", "steps=2"]
    assert train([str(fake_pool.root), *options, "-o", str(tmp_path / "run")]) == 0
    used = settings_of(tmp_path / "run")
    assert (used["hidden"], used["learning_rate"], used["steps"]) == (3, 1.0, 2)
    network = load_policy(tmp_path / "run").network
    assert network.settings == {"hidden": 3, "layers": 1, "horizon": 0}


def test_cameras_may_be_repeated(fake_pool, tmp_path):
    options = ["--camera", "cup", "--camera", "left", "--set", "steps=1", "--jobs", "1"]
    assert train([str(fake_pool.root), *options, "-o", str(tmp_path / "run")]) == 0
    assert load_policy(tmp_path / "run").spec.cameras == ("cup", "left")


@pytest.mark.parametrize("verb", cli.EXAMPLES)
def test_the_help_ends_with_examples_that_can_be_parsed(verb, capsys):
    with pytest.raises(SystemExit) as leave:
        getattr(cli, verb)(["--help"])
    assert leave.value.code == 0
    examples = capsys.readouterr().out.partition("examples:\n")[2].splitlines()
    assert [line.strip() for line in examples] == list(cli.EXAMPLES[verb])
    assert len(examples) >= 2
    for line in examples:
        program, name, *words = shlex.split(line)
        assert (program, name) == ("teasim", verb)
        tyro.cli(SETTINGS[verb], args=words)


def test_the_help_names_every_learner(capsys):
    with pytest.raises(SystemExit):
        train(["--help"])
    printed = capsys.readouterr().out
    assert [name for name in LEARNERS if name not in printed] == []


def test_python_trains_what_the_command_line_trains(fake_pool, run, tmp_path):
    done = policies.train(TrainSettings(fake_pool.root, tmp_path / "run", workers=IN_PROCESS))
    assert str(done).startswith("bc on 7 of 7 demonstrations, 48 decisions, loss ")
    for name in ("policy.safetensors", "policy.json"):
        assert (tmp_path / "run" / name).read_bytes() == (run / name).read_bytes()
    assert policies.load_policy(tmp_path / "run").action_names == done.policy.action_names


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
        (
            ["--learner", "bcnd", "--level", "joint"],
            "The learner 'bcnd' has no level 'joint'; choose subtask.",
        ),
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
        (
            ["--set", "hidden=3"],
            "The learner 'bc' has no setting 'hidden'; "
            "choose bottleneck, steps, learning_rate, weight_decay.",
        ),
        (["--set", "steps"], "--set 'steps' is not name=value; write --set steps=200."),
        (
            ["--set", "steps=1", "--set", "steps=2"],
            "--set gives 'steps' twice; give it once.",
        ),
        (
            ["--set", "bottleneck=1.5"],
            "The setting 'bottleneck' of the learner 'bc' must be a whole number, not 1.5.",
        ),
        (
            ["--set", "steps=many"],
            "The setting 'steps' of the learner 'bc' must be a whole number or none, not 'many'.",
        ),
        (
            ["--set", "learning_rate=nan"],
            "The setting 'learning_rate' of the learner 'bc' must be a number, not nan.",
        ),
        (["--set", "bottleneck=0"], "bottleneck is 0; choose 1 or more."),
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


@pytest.mark.parametrize(
    ("level", "env_id", "max_actions"),
    [
        ("subtask", "teasim:teasim/TeaMakingSubtasks-v0", 14),
        ("joint", "teasim:teasim/TeaMaking-v0", None),
    ],
)
def test_the_default_environment_is_the_tea_station(level, env_id, max_actions):
    config = EnvironmentConfig().at_level(level)
    assert (config.env_id, config.max_actions) == (env_id, max_actions)
    assert EnvironmentConfig("mine").at_level(level).env_id == "mine"


def test_two_policies_are_compared_on_the_same_episodes(run, stirrer, tmp_path, capsys):
    assert try_out(run, "--against", stirrer, "--json", tmp_path / "s.json") == 0
    assert f"against {stirrer} on the same 3 episodes" in capsys.readouterr().out
    saved = json.loads((tmp_path / "s.json").read_text())
    assert saved["against"] == str(stirrer)
    assert saved["comparison"]["deterministic"]["success"] == {
        "first": 3,
        "second": 0,
        "p_value": 0.25,
    }
