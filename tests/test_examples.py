"""The examples run, and do what they say."""

import subprocess
import sys
from pathlib import Path

import pytest

from teasim.cli.main import main as teasim
from teasim.pool import Pool
from teasim.pool.weight_table import read_weight_table
from tests.toy_pool import SEQ_1, make_toy_pool

EXAMPLES = Path(__file__).parents[1] / "examples"


def run(name, *arguments):
    command = [sys.executable, EXAMPLES / f"{name}.py", *arguments]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_example_is_tested():
    names = {path.stem for path in EXAMPLES.glob("*.py")}
    tested = Path(__file__).read_text()
    assert names == {name for name in names if f'"{name}"' in tested or f"{name}:" in tested}
    assert len(names) == 5


@pytest.mark.slow
def test_a_pool_is_generated_filtered_and_learned_from(tmp_path):
    shown = run("first_pool", tmp_path / "pool")
    weights = [float(line.split()[2]) for line in shown.splitlines()]
    correct = [episode.record.correct for episode in Pool.open(tmp_path / "pool").episodes]
    assert [weight > 0.5 for weight in weights] == correct
    assert "missing" in shown.splitlines()[correct.index(False)]
    scores = run("train_and_evaluate", tmp_path / "pool", tmp_path / "learned")
    assert "deterministic: " in scores
    assert "sampled: " in scores


@pytest.mark.slow
def test_recordings_of_your_own_are_filtered(tmp_path):
    pool = tmp_path / "pool"
    make_toy_pool(pool, [SEQ_1] * 5 + [SEQ_1[:3]], size=32, frames_per_subtask=6)
    films = tmp_path / "films"
    assert teasim(["convert", str(pool), str(films), "--to", "videos", "--jobs", "1"]) == 0
    run("own_videos", films, tmp_path / "weights.csv")
    assert len(read_weight_table(tmp_path / "weights.csv")) == 6


def test_a_filter_of_your_own_writes_a_weight_table(tmp_path):
    make_toy_pool(tmp_path / "pool", [SEQ_1] * 5 + [SEQ_1[:3]], size=32, frames_per_subtask=4)
    run("own_filter", tmp_path / "pool", tmp_path / "weights.csv")
    flagged = [row.flagged for row in read_weight_table(tmp_path / "weights.csv")]
    assert flagged == [False] * 5 + [True]


def test_a_policy_of_your_own_is_evaluated(monkeypatch, capsys):
    monkeypatch.chdir(EXAMPLES)
    options = ["--episodes", "1", "--jobs", "1"]
    assert teasim(["evaluate", "own_policy:Recipe", *options]) == 0
    assert "policy accuracy  100.0 %" in capsys.readouterr().out
