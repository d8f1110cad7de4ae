"""An ablation on the fake station: every cell once, stopped and gone on with, bad files refused."""

import csv
import json

import pytest

from policies.cli import ablate
from policies.experiments import ablation, ablation_config
from policies.experiments.ablation_config import AblationConfig
from teasim.common.errors import ConfigError
from tests.policies.conftest import WITHOUT_TEA_BAG
from tests.policies.fakes import FAKE_ID, SEQ_1, make_fake_pool

SETTINGS = f"""
learners = ["bc", "r-maxent"]
seeds = [0, 1]
observe = "state"
episodes = 2
env_id = "{FAKE_ID}"
"""
FILTERS = """
[filters.all]
use = "ignore"
[filters.norm]
use = "discard"
segmenter = "logged"
[filters.labels]
use = "labels"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("ablation")
    make_fake_pool(path / "pool", [SEQ_1] * 6 + [WITHOUT_TEA_BAG] * 2)
    (path / "plan.toml").write_text('pools = ["pool"]' + SETTINGS + FILTERS)
    return path


@pytest.fixture(scope="module")
def done(folder):
    assert ablate([str(folder / "plan.toml"), "-o", str(folder / "out"), "--jobs", "1"]) == 0
    return folder / "out"


def test_every_combination_is_a_cell(done):
    cells = {path.stem for path in (done / "cells").iterdir()}
    assert cells == {
        f"pool--{name}--{learner}--{seed}"
        for name in ("all", "norm", "labels")
        for learner in ("bc", "r-maxent")
        for seed in (0, 1)
    }


def test_the_filters_choose_what_they_say(done):
    def weights(name):
        return json.loads((done / "cells" / f"pool--{name}--bc--0.json").read_text())["weights"]

    assert weights("all") == [1] * 8
    assert weights("norm") == weights("labels") == [1] * 6 + [0] * 2


def test_the_rows_have_the_rates_of_their_cell(done):
    rows = list(csv.DictReader((done / "results.csv").read_text().splitlines()))
    assert len(rows) == 3 * 2 * 2 * 2
    cell = json.loads((done / "cells" / "pool--labels--bc--1.json").read_text())
    (row,) = (
        r
        for r in rows
        if (r["filter"], r["learner"], r["seed"], r["mode"]) == ("labels", "bc", "1", "sampled")
    )
    saved = cell["scores"]["sampled"]["policy_accuracy"]
    assert float(row["policy_accuracy"]) == pytest.approx(saved["percent"] / 100, abs=1e-4)
    assert float(row["policy_accuracy_low"]) == pytest.approx(saved["low_percent"] / 100, abs=1e-4)


def test_the_table_puts_the_training_seeds_together(done):
    table = (done / "results.md").read_text()
    assert table.count("\n| pool | ") == 2 + 2 * 6
    line = next(x for x in table.splitlines() if x.startswith("| pool | labels | r-maxent | "))
    assert "| 100.0 % (" in line
    assert "| 100.0, 100.0 |" in line
    assert "policy accuracy against 'all'" in table
    assert "| goal reached | stove left on | spilled |" in table


def test_what_is_there_is_not_done_again(folder, done, monkeypatch, capsys):
    gone = done / "cells" / "pool--all--bc--1.json"
    before = gone.read_bytes()
    table = (done / "results.md").read_text()
    gone.unlink()
    ran = []
    real = ablation._run_cell
    monkeypatch.setattr(
        ablation, "_run_cell", lambda run, *rest: ran.append(run.cell) or real(run, *rest)
    )
    capsys.readouterr()
    ablate([str(folder / "plan.toml"), "-o", str(done), "--jobs", "1"])
    assert capsys.readouterr().err == "11 of 12 runs are done; continuing.\n"
    assert [(cell.filter, cell.learner, cell.seed) for cell in ran] == [("all", "bc", 1)]
    assert gone.read_bytes() == before
    assert (done / "results.md").read_text() == table


def test_a_learner_may_have_settings_and_a_name_of_its_own(folder, tmp_path):
    table = '[learners.bc]\n[learners.tiny]\nlearner = "bc-rnn"\nhidden = 2\nsteps = 3\n'
    head = SETTINGS.replace('learners = ["bc", "r-maxent"]\n', "").replace("[0, 1]", "[0]")
    (folder / "tables.toml").write_text(
        'pools = ["pool"]' + head + table + '[filters.all]\nuse = "ignore"\n'
    )
    assert ablate([str(folder / "tables.toml"), "-o", str(tmp_path), "--jobs", "1"]) == 0
    cell = json.loads((tmp_path / "cells" / "pool--all--tiny--0.json").read_text())
    assert (cell["settings"]["hidden"], cell["settings"]["steps"]) == (2, 3)
    assert "| pool | all | tiny | " in (tmp_path / "results.md").read_text()


def test_a_finished_ablation_says_so(folder, done, capsys):
    ablate([str(folder / "plan.toml"), "-o", str(done), "--jobs", "1"])
    assert capsys.readouterr().err == "All 12 runs are done.\n"


def refused(call):
    with pytest.raises(ConfigError) as error:
        call()
    return str(error.value)


def test_a_folder_of_other_settings_is_left_alone(folder, done):
    other = folder / "other.toml"
    other.write_text((folder / "plan.toml").read_text().replace("episodes = 2", "episodes = 3"))
    said = refused(lambda: ablate([str(other), "-o", str(done)]))
    assert said == (
        f"The output folder '{done}' holds an ablation with other settings; choose a new one."
    )
    said = refused(lambda: ablate([str(other), "-o", str(folder)]))
    assert said == f"The output folder '{folder}' is in use; choose a new or empty one."


POOLS = 'pools = ["pool"]\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("pools = [", "The configuration '{path}' is not TOML: "),
        (POOLS, "The configuration '{path}' lacks 'filters'."),
        (
            POOLS + "epochs = 3\n" + FILTERS,
            "The configuration '{path}' has the unknown setting 'epochs'; choose pools, filters, "
            "learners, seeds, expert, observe, episodes, first_seed, max_actions, env_id.",
        ),
        ("pools = []\n" + FILTERS, "'pools' is empty; name one or more."),
        ('pools = ["a/p", "b/p"]\n' + FILTERS, "Two pools have the same name: p, p."),
        (POOLS + "seeds = [0, 0]\n" + FILTERS, "'seeds' has a duplicate entry."),
        (POOLS + "seeds = [true]\n" + FILTERS, "'seeds' must be a list of int."),
        (POOLS + 'episodes = "2"\n' + FILTERS, "'episodes' must be of type int."),
        (POOLS + "episodes = 0\n" + FILTERS, "episodes is 0; choose 1 or more."),
        (POOLS + 'filters = "norm"', "'filters' must be tables, [filters.NAME] each."),
        (
            POOLS + 'learners = ["sac"]\n' + FILTERS,
            "Unknown learner 'sac'; choose bc, bc-rnn, bcnd, demodice, nearest, r-maxent.",
        ),
        (
            POOLS + 'learners = ["demodice"]\n' + FILTERS,
            "The learner 'demodice' needs demonstrations known to be good; set 'expert'.",
        ),
        (
            POOLS + '[filters.a]\nuse = "drop"',
            "The filter 'a' has the unknown use 'drop'; choose discard, weight, ignore, labels.",
        ),
        (POOLS + "[filters.a]\nframes_per_segment = 'x'", "The filter 'a' has a setting of "),
        (
            POOLS + "[learners.bc]\nhidden = 2\n" + FILTERS,
            "The learner 'bc' has no setting 'hidden'; choose bottleneck, steps, ",
        ),
        (
            POOLS + "[learners.bc]\nsteps = '2'\n" + FILTERS,
            "The setting 'steps' of the learner 'bc' must be a whole number or none, not '2'.",
        ),
        (POOLS + "[learners.mine]\n" + FILTERS, "Unknown learner 'mine'; choose bc, "),
        (
            POOLS + "learners = 3\n" + FILTERS,
            "'learners' must be a list of str, or tables, [learners.NAME] each.",
        ),
        (
            POOLS + '[learners."a/b"]\nlearner = "bc"\n' + FILTERS,
            "The learner 'a/b' names files; use letters, digits, '_', '.', '+' and '-' only.",
        ),
        (POOLS + "[filters.a]\nmaximum = 1", "The filter 'a' has the unknown setting 'maximum'; "),
    ],
)
def test_a_bad_configuration_is_one_sentence(tmp_path, text, said):
    path = tmp_path / "plan.toml"
    path.write_text(text)
    assert refused(lambda: AblationConfig.read(path)).startswith(said.format(path=path))


def test_no_configuration_is_one_sentence(tmp_path):
    path = tmp_path / "none.toml"
    assert refused(lambda: AblationConfig.read(path)) == (
        f"The configuration '{path}' cannot be read."
    )


def test_the_example_of_the_manual_can_be_read(tmp_path):
    example = [line[4:] for line in ablation_config.__doc__.splitlines() if line[:4] == "    "]
    path = tmp_path / "plan.toml"
    path.write_text("\n".join(example))
    config = AblationConfig.read(path)
    assert config.pools == (tmp_path / "pools/a", tmp_path / "pools/b")
    assert [(v.name, v.learner, v.settings) for v in config.learners] == [
        ("bc", "bc", {}),
        ("large", "bc-rnn", {"hidden": 128}),
    ]
    assert [(f.name, f.use) for f in config.filters] == [
        ("all", "ignore"),
        ("norm", "discard"),
        ("equation3", "weight"),
        ("labels", "labels"),
    ]
