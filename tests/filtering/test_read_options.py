"""What a user says about a source reaches its reader."""

import json
from pathlib import Path

import pytest

from filtering.cli import main
from teasim.common.errors import ConfigError
from teasim.pool.weight_table import read_weight_table
from tests.pool import foreign_inputs as made


def test_a_mask_of_a_robomimic_file_is_filtered(tmp_path: Path) -> None:
    path = made.robomimic(tmp_path / "in")
    out = tmp_path / "out"
    options = ["--segmenter", "logged", "--mask", "train", "--no-effects"]
    assert main([str(path), "-o", str(out), *options]) == 0
    rows = read_weight_table(out / "weights.csv")
    assert [row.episode_index for row in rows] == [0, 2, 3]
    kept = (out / "keep.txt").read_text().splitlines()
    assert [line for line in kept if line[0] != "#"] == ["demo_0", "demo_2", "demo_3"]


def test_background_labels_are_no_sub_tasks(tmp_path: Path) -> None:
    path, out = made.ms_tcn(tmp_path / "in"), tmp_path / "out"
    assert main([str(path), "-o", str(out), "--background-label", "stir"]) == 0
    assert json.loads((out / "filter.json").read_text())["subtasks"] == ["pour"]


def test_an_option_that_the_format_does_not_know(tmp_path: Path) -> None:
    path = made.ms_tcn(tmp_path / "in")
    with pytest.raises(ConfigError) as caught:
        main([str(path), "-o", str(tmp_path / "out"), "--mask", "train"])
    assert str(caught.value) == (
        f"The option mask does not apply to '{path}' (MS-TCN folder); leave it out."
    )
