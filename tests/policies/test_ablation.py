"""An ablation on the fake station: every cell once, stopped and gone on with, bad files refused."""

import contextlib
import csv
import json
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest

from policies.cli import ablate
from policies.experiments import ablation, ablation_config
from policies.experiments.ablation_config import AblationConfig
from policies.experiments.choosing import Chooser, by_chance
from policies.experiments.variants import FilterVariant
from teasim.common import files
from teasim.common.errors import ConfigError
from teasim.common.workers import Workers
from teasim.pool import Pool
from teasim.pool.weight_table import read_weight_table
from tests.policies.conftest import WITHOUT_TEA_BAG
from tests.policies.fake_joints import FAKE_JOINTS_ID, make_joint_pool
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
    assert table.count("\n| pool | ") == 2 + 2 * 6 + 1 + 2  # and what two filters flagged
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


def test_the_figures_of_a_finished_ablation_can_be_drawn(folder, done, tmp_path):
    options = ["-o", str(done), "--jobs", "1", "--figures", str(tmp_path)]
    assert ablate([str(folder / "plan.toml"), *options]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {
        f"accuracy_{mode}.{ending}"
        for mode in ("deterministic", "sampled")
        for ending in ("svg", "png")
    }


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
            "learners, seeds, expert, experts, segmenter, observe, episodes, first_seed, "
            "max_actions, env_id, joint_env_id.",
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
            "Unknown learner 'sac'; choose act, bc, bc-rnn, bcnd, demodice, nearest, r-maxent.",
        ),
        (
            POOLS + 'learners = ["demodice"]\n' + FILTERS,
            "The learner 'demodice' needs demonstrations known to be good; set 'expert' (their "
            "episodes) or 'experts' (how many of those labelled correct).",
        ),
        (
            POOLS + '[filters.a]\nuse = "drop"',
            "The filter 'a' has the unknown use 'drop'; choose discard, weight, ignore, labels, "
            "random, length.",
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
        (POOLS + "[learners.mine]\n" + FILTERS, "Unknown learner 'mine'; choose act, bc, "),
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
    assert [(p.name, p.folder) for p in config.pools] == [
        ("a", tmp_path / "pools/a"),
        ("b", tmp_path / "pools/b"),
    ]
    assert [(v.name, v.learner, v.settings) for v in config.learners] == [
        ("bc", "bc", {}),
        ("large", "bc-rnn", {"hidden": 128}),
    ]
    assert [(f.name, f.use) for f in config.filters] == [
        ("all", "ignore"),
        ("norm", "discard"),
        ("equation3", "weight"),
        ("labels", "labels"),
        ("random", "random"),
        ("theirs", "weight"),
        ("stored", "discard"),
    ]


MANY = """
learners = ["bc"]
observe = "state"
episodes = 1
experts = 2
segmenter = "logged"
[pools.pool]
folder = "pool"
[filters.all]
use = "ignore"
[filters.norm]
use = "discard"
[filters.random]
use = "random"
like = "norm"
[filters.shortest]
use = "length"
[filters.theirs]
use = "weight"
command = "{python} tool.py {{pool}} {{table}}"
[filters.stored]
use = "discard"
table = "{{pool}}.csv"
"""
TOOL = """
import sys
from teasim.pool import Pool
from teasim.pool.weight_table import WeightRow, write_weight_table
pool, table = sys.argv[1:]
write_weight_table(table, [
    WeightRow(e.demo_id, e.index, 1 - e.index / 10, e.index, e.index == 7, int(e.index == 7), "")
    for e in Pool.open(pool).episodes
])
"""


@pytest.fixture(scope="module")
def many(folder):
    """An ablation of every way to choose."""
    plan = MANY.format(python=sys.executable).replace("episodes", f'env_id = "{FAKE_ID}"\nepisodes')
    (folder / "many.toml").write_text(plan)
    (folder / "tool.py").write_text(TOOL)
    table = folder / "out" / "filters" / "pool--norm.csv"
    if not table.is_file():
        ablate([str(folder / "plan.toml"), "-o", str(folder / "out"), "--jobs", "1"])
    (folder / "pool.csv").write_bytes(table.read_bytes())
    assert ablate([str(folder / "many.toml"), "-o", str(folder / "many"), "--jobs", "1"]) == 0
    return folder / "many"


def rows_of(path):
    return list(csv.DictReader(path.read_text().splitlines()))


def test_every_way_to_choose_ends_in_a_weight_table(many):
    def flagged(name):
        rows = read_weight_table(many / "filters" / f"pool--{name}.csv")
        return [row.flagged for row in rows]

    assert flagged("norm") == flagged("stored") == [False] * 6 + [True] * 2
    assert flagged("shortest") == flagged("norm")  # they lack a sub-task
    assert sum(flagged("random")) == 2
    assert flagged("theirs") == [False] * 7 + [True]
    weights = json.loads((many / "cells" / "pool--theirs--bc--0.json").read_text())["weights"]
    assert weights == pytest.approx([1, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3])


def test_random_draws_others_in_every_pool(folder):
    pool = Pool.open(folder / "pool")

    def drawn(name):
        chooser = Chooser(pool, name, {}, folder, folder, Workers(1))
        return [row.loss for row in by_chance(chooser, FilterVariant("random", "random"))]

    assert drawn("first") == drawn("first")
    assert drawn("first") != drawn("second")


def test_detection_stands_beside_the_scores_of_the_policies(many):
    rows = {row["filter"]: row for row in rows_of(many / "detection.csv")}
    assert set(rows) == {"norm", "random", "shortest", "theirs", "stored"}
    assert (rows["theirs"]["recall"], rows["theirs"]["false_alarms"]) == ("0.5", "0")
    assert (rows["theirs"]["auroc"], rows["theirs"]["brier"]) == ("1", "")
    results = rows_of(many / "results.csv")
    assert {row["flagging_recall"] for row in results if row["filter"] == "norm"} == {"1"}
    assert {row["flagging_recall"] for row in results if row["filter"] == "all"} == {""}
    assert {row["difference"] for row in results if row["filter"] == "all"} == {"0"}


def test_the_tables_are_the_same_in_every_form(many):
    for name in ("results", "detection"):
        rows = rows_of(many / f"{name}.csv")
        stored = pq.read_table(many / f"{name}.parquet").to_pylist()
        assert [list(row) for row in stored] == [list(row) for row in rows]
        assert [row["filter"] for row in stored] == [row["filter"] for row in rows]
    assert (many / "results.html").read_text().count("<table>") == 3


PARTS = """
[pools.one]
folder = "pool"
incorrect = 1
[pools.two]
folder = "pool"
incorrect = 2
[pools.other]
folder = "pool"
incorrect = 2
"""


def test_pools_can_be_parts_and_are_put_together_by_their_incorrect_demonstrations(
    folder, tmp_path, monkeypatch
):
    (folder / "parts.toml").write_text(SETTINGS + FILTERS + PARTS)
    trained = []
    real = ablation._run_cell
    monkeypatch.setattr(
        ablation, "_run_cell", lambda run, *rest: trained.append(run) or real(run, *rest)
    )
    assert ablate([str(folder / "parts.toml"), "-o", str(tmp_path), "--jobs", "1"]) == 0
    rows = {(row["pool"], row["filter"]): row for row in rows_of(tmp_path / "detection.csv")}
    assert [rows[pool, "labels"]["incorrect"] for pool in ("one", "two", "other")] == list("122")
    assert len(list((tmp_path / "cells").iterdir())) == 3 * 3 * 2 * 2
    assert len(trained) == 3 * 2 * 2 * 2  # norm and labels leave the same
    table = (tmp_path / "results.md").read_text()
    assert "## sampled decisions, by incorrect demonstrations" in table
    assert "\n| 1 | 1 | norm | bc | 1 | " in table
    line = next(x for x in table.splitlines() if x.startswith("| 2 | 2 | labels | bc | 2, 2 | "))
    assert " points (" in line


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (
            'folder = "pool"\nincorrect = 3',
            "'{pool}' has 2 demonstrations labelled incorrect, fewer than 'incorrect' of the pool "
            "'part', 3.",
        ),
        (
            'folder = "pool"\nincorrect = -1',
            "'incorrect' of the pool 'part' must be a whole number, 0 or more.",
        ),
        (
            'folder = "pool"\nincorrect = 1\n[filters.b]\ncommand = "c {table}"',
            "The pool 'part' is a part of a folder ('incorrect'), which the command of the filter "
            "'b' cannot be told; leave out one of them.",
        ),
    ],
)
def test_a_part_that_cannot_be_had_is_refused(folder, tmp_path, table, said):
    plan = folder / "part.toml"
    plan.write_text(SETTINGS + FILTERS + "[pools.part]\n" + table)
    found = refused(lambda: ablate([str(plan), "-o", str(tmp_path / "out"), "--jobs", "1"]))
    assert found == said.replace("{pool}", str(folder / "pool"))


@pytest.mark.parametrize(
    ("tool", "said"),
    [
        ("nothing-of-that-name {pool} {table}", "cannot be run: No such file or directory."),
        ("python -c 'raise SystemExit(\"no way\")' {table}", "failed with code 1: no way"),
        ("python -c 'pass' {table}", "wrote no table to {table}."),
    ],
)
def test_a_command_that_does_not_serve_is_one_sentence(folder, tmp_path, tool, said):
    python = tool.replace("python", sys.executable, 1)
    plan = f"[filters.theirs]\ncommand = '''{python}'''\n"
    (folder / "tools.toml").write_text('pools = ["pool"]' + SETTINGS + plan)
    what = f"The command '{python.split()[0]}' of the filter 'theirs' "
    assert refused(lambda: ablate([str(folder / "tools.toml"), "-o", str(tmp_path / "x")])) == (
        what + said
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            '[filters.a]\nuse = "random"\nlike = "b"',
            "The filter 'a' is like 'b', which is no filter of the configuration; choose a.",
        ),
        (
            '[filters.a]\nlike = "a"',
            "The filter 'a' takes 'like' only with the use random or length.",
        ),
        (
            '[filters.a]\ntable = "t"\ncommand = "c {table}"',
            "The filter 'a' takes one of table and command, with the use discard or weight.",
        ),
        (
            '[filters.a]\ncommand = "c {pool}"',
            "The command of the filter 'a' lacks {table}, the file to write.",
        ),
        ("[filters.a]\ntable = 3", "'table' of the filter 'a' must be of type str."),
        (
            '[filters.a]\nuse = "labels"\nscore = "norm"',
            "The filter 'a' does not run ours, so it takes no 'score'.",
        ),
        (
            '[filters.a]\nuse = "ignore"\n[pools.b]\nfolder = "b"\nseq1 = 3',
            "The pool 'b' has a folder, so it takes no options of generate; leave out 'seq1'.",
        ),
        (
            "experts = 1\nexpert = [1]\n" + FILTERS,
            "Both 'expert' and 'experts' were given; choose one.",
        ),
    ],
)
def test_ways_to_choose_that_exclude_each_other_are_refused(tmp_path, text, said):
    path = tmp_path / "plan.toml"
    path.write_text(text if "[pools" in text else POOLS + text)
    assert refused(lambda: AblationConfig.read(path)) == said


def test_pools_are_made_from_options(folder, tmp_path, monkeypatch):
    seen = {}

    def fake_generate(path, options, workers):
        seen.update(options)
        return make_fake_pool(path, [SEQ_1] * 3 + [WITHOUT_TEA_BAG])

    monkeypatch.setattr(ablation, "generate_pool", fake_generate)
    pools = '[pools.made]\nseq1 = 3\nmistakes = ["skip:1"]\n'
    head = SETTINGS.replace('"bc", "r-maxent"', '"bc"').replace("[0, 1]", "[0]")
    (folder / "made.toml").write_text(head + pools + '[filters.all]\nuse = "ignore"\n')
    ablate([str(folder / "made.toml"), "-o", str(tmp_path), "--jobs", "1"])
    assert seen == {"seq1": 3, "mistakes": ["skip:1"]}
    assert "| made | all | bc | " in (tmp_path / "results.md").read_text()


NEAREST = '[learners.near]\nlearner = "nearest"\nlevel = "joint"\n'
CHUNKS = '[learners.act]\nlevel = "joint"\nsteps = 20\nwidth = 16\nbatch = 16\n'
"""Learners of joints: one whose policies draw, and one whose policies do not."""


@pytest.mark.parametrize(
    ("learners", "modes"),
    [
        (NEAREST, ["deterministic", "sampled"]),
        (CHUNKS, ["deterministic"]),
        (NEAREST + CHUNKS, ["deterministic", "sampled", "deterministic"]),
    ],
)
def test_a_learner_of_joints_stands_in_the_same_tables(tmp_path, learners, modes):
    make_joint_pool(tmp_path / "joints")
    (tmp_path / "plan.toml").write_text(
        f'pools = ["joints"]\nepisodes = 1\njoint_env_id = "{FAKE_JOINTS_ID}"\n'
        f'{learners}[filters.all]\nuse = "ignore"\n'
    )
    ablate([str(tmp_path / "plan.toml"), "-o", str(tmp_path / "out"), "--jobs", "1"])
    rows = rows_of(tmp_path / "out" / "results.csv")
    assert [row["mode"] for row in rows] == modes
    assert all(row["subtasks_done"] and not row["policy_accuracy"] for row in rows)
    text = (tmp_path / "out" / "results.md").read_text()
    assert text.count("| sub-tasks done |") == len(set(modes))
    assert text.count("| joints | all | ") == len(modes)


def test_an_ablation_killed_ten_times_ends_with_the_same_tables(folder, tmp_path):
    """Any write may be the last one; what is stopped leaves whole files or none."""
    plan = (SETTINGS + FILTERS).replace("[0, 1]", "[0]").replace('"bc", "r-maxent"', '"bc"')
    (folder / "small.toml").write_text('pools = ["pool"]' + plan.replace("= 2", "= 1"))
    rng = np.random.default_rng(0)
    whole, command = tmp_path / "whole", [str(folder / "small.toml"), "--jobs", "1", "-o"]
    ablate([*command, str(whole)])
    command.append(str(tmp_path / "out"))
    kills = 0
    for _ in range(10):
        left = int(rng.integers(0, 4))

        def stop(path):
            nonlocal left, kills
            left -= 1
            if left < 0:
                kills += 1
                raise KeyboardInterrupt

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(files, "sync", stop)
            with contextlib.suppress(KeyboardInterrupt):
                ablate(command)
    assert kills == 10
    ablate(command)
    for name in ("results.csv", "results.parquet", "results.md", "results.html", "detection.csv"):
        assert (tmp_path / "out" / name).read_bytes() == (whole / name).read_bytes(), name
