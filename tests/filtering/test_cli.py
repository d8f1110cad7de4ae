import subprocess
import sys
from pathlib import Path

import pytest

from filtering.cli import main
from teasim.pool import Pool


def test_importing_the_verb_loads_neither_torch_nor_opencv() -> None:
    code = (
        "import sys, filtering.cli;"
        "print([m for m in ('torch', 'cv2', 'scipy', 'mujoco') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_filtering_a_pool(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main([str(toy_pool.root), "-o", str(out), "--jobs", "1"]) == 0
    printed = capsys.readouterr().out
    assert "2 of 7 demonstrations are flagged." in printed
    assert (out / "report.html").is_file()


@pytest.mark.parametrize(("share", "code"), [("0.2", 1), ("0.3", 0)])
def test_too_many_flagged_is_exit_code_1(
    toy_pool: Pool, tmp_path: Path, share: str, code: int
) -> None:
    argv = [str(toy_pool.root), "-o", str(tmp_path / "out"), "--jobs", "1"]
    assert main([*argv, "--max-flagged", share]) == code


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (["--max-flagged", "2"], "--max-flagged is 2.0; choose a share from 0 to 1."),
        (
            ["--segmenter", "luck"],
            "Unknown segmenter 'luck'; choose logged, clustering, predictions or the folder of one "
            "that `teasim segment fit` made.",
        ),
        (
            ["--segmenter", "clustering", "--subtasks", "few"],
            "subtasks is 'few'; choose auto or a number from 1.",
        ),
        (["--fps", "5"], "The pool '{pool}' stores its own frame rate; leave out fps."),
        (
            ["--segmenter", "predictions"],
            "The demonstration 'video 0' of '{pool}' has no sub-tasks that the segmenter "
            "'predictions' could read; choose another segmenter.",
        ),
        (["--camera", "roof"], "The pool has no camera 'roof'; choose from left, cup."),
        (["--jobs", "-1"], "jobs is -1; choose 1 or more."),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    toy_pool: Pool,
    tmp_path: Path,
    extra: list[str],
    message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([str(toy_pool.root), "-o", str(tmp_path / "out"), *extra]) == 2
    assert capsys.readouterr().err == f"teasim: {message.format(pool=toy_pool.root)}\n"
    assert not (tmp_path / "out").exists()


def test_a_source_that_is_no_pool_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(tmp_path), "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.startswith("teasim: ")
