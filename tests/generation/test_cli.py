"""The verb `generate`: exit codes and sentences."""

import subprocess
import sys
from pathlib import Path

import pytest

from teasim.cli.main import main
from teasim.common.errors import RenderError
from teasim.generation import making, recording
from teasim.task.mistakes import MISTAKES
from tests.generation.test_pool import SHORT, digests

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ["--mistakes", "sneeze"],
            f"Unknown mistake 'sneeze'; choose {', '.join(MISTAKES)}.",
        ),
        (
            ["--mistakes", "skip:many"],
            "'skip:many' is no mistake with a count; write NAME[@SUBTASK][+NAME...][:COUNT].",
        ),
        (["--camera", "back"], "Unknown camera 'back'; choose left, cup, front, top."),
        (["--size", "63"], "The size is 63; choose an even number from 32 to 1024."),
        (["--seq1", "0"], "The pool would be empty; ask for demonstrations with --seq1 N."),
        (["--seq1", "-3"], "--seq1 is -3; give 0 or more demonstrations."),
        (["--quality", "great"], "Unknown quality 'great'; choose fast, nice."),
        (["--seed", "-1"], "The seed is -1; choose 0 or more."),
        (["--jobs", "0"], "jobs is 0; choose 1 or more."),
        (["--backend", "threads"], "Unknown parallel backend 'threads'; choose loky, dask, ray."),
    ],
)
def test_bad_input_gives_one_sentence_and_exit_code_2(tmp_path, capsys, options, sentence):
    assert main(["generate", str(tmp_path / "pool"), *options]) == 2
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", f"teasim: {sentence}\n")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_in_use_is_left_alone(tmp_path, capsys):
    (tmp_path / "thesis.txt").write_text("ten years of work")
    assert main(["generate", str(tmp_path), "--seq1", "1"]) == 2
    assert capsys.readouterr().err == (
        f"teasim: The folder '{tmp_path}' is not empty and holds no pool; "
        "choose one that is new or empty.\n"
    )
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]
    assert (tmp_path / "thesis.txt").read_text() == "ten years of work"


def test_a_file_in_the_way_is_left_alone(tmp_path, capsys):
    path = tmp_path / "pool"
    path.write_text("not a folder")
    assert main(["generate", str(path), "--seq1", "1"]) == 2
    assert capsys.readouterr().err == (
        f"teasim: '{path}' is a file; choose a folder that is new or empty.\n"
    )
    assert path.read_text() == "not a folder"


def test_an_unfinished_pool_of_other_settings_is_left_alone(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(recording, "_record", lambda *_: "It was spilled.")
    assert main(["generate", str(tmp_path / "pool"), "--seq1", "1", "--size", "64"]) == 2
    assert "failed 6 times; the last time: It was spilled." in capsys.readouterr().err
    before = digests(tmp_path)
    assert main(["generate", str(tmp_path / "pool"), "--seq1", "2", "--size", "64"]) == 2
    assert "holds an unfinished pool made with other settings" in capsys.readouterr().err
    assert digests(tmp_path) == before


def test_a_pool_is_made_and_told_about(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(making, "plan_pool", lambda _: SHORT[:1])
    pool = tmp_path / "pool"
    assert main(["generate", str(pool), "--size", "64", "--camera", "cup", "--jobs", "1"]) == 0
    told = capsys.readouterr()
    assert told.out.startswith(f"1 demonstrations in {pool} (")
    assert told.out.endswith("0 made again because they did not come out as labelled)\n")
    assert told.err == ""
    assert main(["inspect", str(pool)]) == 0


def test_help_comes_without_a_simulator():
    program = (
        "import sys; from teasim.cli.main import main; main(['generate', '--help']);"
        "assert not {'mujoco', 'torch'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True, capture_output=True)


def test_without_opengl_nothing_is_begun(tmp_path, capsys, monkeypatch):
    def missing():
        raise RenderError("No headless OpenGL back end works.")

    monkeypatch.setattr(making, "choose_gl", missing)
    assert main(["generate", str(tmp_path / "pool"), "--seq1", "1"]) == 2
    assert capsys.readouterr().err == "teasim: No headless OpenGL back end works.\n"
    assert list(tmp_path.iterdir()) == []
