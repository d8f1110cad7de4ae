import json
import subprocess
import sys
from pathlib import Path

import pytest

import filtering
from filtering.cli import main, segment
from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from teasim.cli.main import main as teasim
from teasim.common.errors import ConfigError, PoolError
from teasim.pool import Pool

HEAVY = ("torch", "cv2", "sklearn", "scipy", "mujoco")


@pytest.mark.parametrize("module", ["filtering", "filtering.cli"])
def test_importing_loads_nothing_heavy(module: str) -> None:
    code = f"import sys, {module}; print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_help_loads_nothing_heavy_and_ends_with_two_examples() -> None:
    code = (
        "import sys, filtering.cli\n"
        "try: filtering.cli.main(['--help'])\n"
        f"finally: print([m for m in {HEAVY} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert lines[-1] == "[]"
    assert [line.split()[:2] for line in lines[-3:-1]] == [["teasim", "filter"]] * 2


def test_the_front_door_is_the_same_classes() -> None:
    assert filtering.DemoFilter is DemoFilter
    assert filtering.FilterConfig is FilterConfig
    with pytest.raises(AttributeError, match="has no attribute 'Filter'"):
        filtering.Filter  # noqa: B018


@pytest.mark.parametrize("verb", [["fit"], ["predict"]])
def test_both_parts_of_segment_show_two_examples(
    verb: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        segment([*verb, "--help"])
    examples = capsys.readouterr().out.splitlines()[-2:]
    assert [line.split()[:2] for line in examples] == [["teasim", "segment"]] * 2


def test_every_setting_of_the_filter_is_an_option(
    toy_pool: Pool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[FilterConfig] = []
    monkeypatch.setattr(DemoFilter, "fit", lambda self, *_, **__: seen.append(self.config))
    pairs = tmp_path / "pairs"
    pairs.write_text("a before b")
    options = (
        f"--segmenter clustering --subtasks 4 --groups 2 --threshold 0.3 --precedence {pairs} "
        "--tolerance 0.1 --camera left --camera cup --no-effects --frames-per-segment 9 "
        "--background mog2 --solver exact --trusted-share 0.6 --ridge 0.1"
    )
    with pytest.raises(AttributeError):  # nothing was fitted
        main([str(toy_pool.root), "-o", str(tmp_path / "out"), *options.split()])
    assert seen == [
        FilterConfig(
            segmenter="clustering",
            subtasks="4",
            groups="2",
            threshold=0.3,
            precedence=(("a", "b"),),
            tolerance=0.1,
            cameras=("left", "cup"),
            effects=False,
            frames_per_segment=9,
            background="mog2",
            solver="exact",
            trusted_share=0.6,
            ridge=0.1,
        )
    ]


def test_a_threshold_can_be_a_number(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = [str(toy_pool.root), "--jobs", "1", "--no-effects", "--segmenter", "logged"]
    assert main([*argv, "-o", str(tmp_path / "a"), "--threshold", "0.001"]) == 0
    assert "0 of 7 demonstrations are flagged." in capsys.readouterr().out
    assert main([*argv, "-o", str(tmp_path / "b"), "--threshold", "0.45"]) == 0
    assert "2 of 7 demonstrations are flagged." in capsys.readouterr().out
    record = json.loads((tmp_path / "b" / "filter.json").read_text())
    assert record["threshold"] == record["config"]["threshold"] == 0.45


@pytest.mark.parametrize(
    ("options", "seen"),
    [
        (["--segmenter", "logged", "--no-effects"], []),
        (["--segmenter", "logged"], ["left", "cup"]),
        (["--segmenter", "logged", "--camera", "left"], ["left"]),
        (["--no-effects", "--segmenter", "clustering"], ["left"]),
    ],
)
def test_the_cameras_that_were_looked_at_are_told(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str], options, seen
) -> None:
    out = tmp_path / "out"
    argv = [str(toy_pool.root), "-o", str(out), "--jobs", "1", "--score", "norm"]
    assert main([*argv, *options]) == 0
    told = ", ".join(seen) or "none"
    assert f"cameras looked at: {told}\n" in capsys.readouterr().out
    assert json.loads((out / "filter.json").read_text())["cameras_looked_at"] == seen


def test_debug_shows_the_traceback(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["filter", str(tmp_path), "-o", str(tmp_path / "out")]
    assert teasim(argv) == 2
    plain = capsys.readouterr().err
    assert plain.startswith("teasim: ")
    assert plain.count("\n") == 1
    assert teasim([*argv, "--debug"]) == 2
    shown = capsys.readouterr().err
    assert shown.startswith("Traceback")
    assert shown.endswith(plain)


def test_a_page_that_cannot_be_made_loses_no_result(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise PoolError("The video 'x.mp4' is damaged.")

    monkeypatch.setattr("filtering.output.demo_views", broken)
    out = tmp_path / "out"
    assert main([str(toy_pool.root), "-o", str(out), "--jobs", "1"]) == 0
    printed = capsys.readouterr()
    assert printed.err == (
        "teasim: warning: the page could not be made: The video 'x.mp4' is damaged.\n"
    )
    assert printed.out.endswith(f"weights: {out / 'weights.csv'}\n")
    assert sorted(path.name for path in out.iterdir()) == [
        "exclude.txt",
        "filter.json",
        "keep.txt",
        "segments.csv",
        "weights.csv",
    ]


def test_filtering_a_pool(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main([str(toy_pool.root), "-o", str(out), "--jobs", "1", "--segmenter", "logged"]) == 0
    printed = capsys.readouterr().out
    assert "2 of 7 demonstrations are flagged." in printed
    assert (out / "report.html").is_file()


@pytest.mark.parametrize(("share", "code"), [("0.2", 1), ("0.3", 0)])
def test_too_many_flagged_is_exit_code_1(
    toy_pool: Pool, tmp_path: Path, share: str, code: int
) -> None:
    argv = [str(toy_pool.root), "-o", str(tmp_path / "out"), "--jobs", "1"]
    argv += ["--segmenter", "logged"]
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
        (
            ["--fps", "5"],
            "The option fps does not apply to '{pool}' (LeRobot data set); leave it out.",
        ),
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
    assert teasim(["filter", str(toy_pool.root), "-o", str(tmp_path / "out"), *extra]) == 2
    assert capsys.readouterr().err == f"teasim: {message.format(pool=toy_pool.root)}\n"
    assert not (tmp_path / "out").exists()


def test_a_source_that_is_no_pool_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PoolError):
        main([str(tmp_path), "-o", str(tmp_path / "out")])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"threshold": 1.0},
            "threshold is 1.0; choose a weight between 0 and 1, or the name of a rule.",
        ),
        (
            {"threshold": 0.3, "groups": "3"},
            "The threshold 0.3 makes 2 groups, not 3; leave out groups.",
        ),
        (
            {"threshold": "some"},
            "Unknown threshold 'some'; choose a number between 0 and 1, auto, kmeans, gmm, "
            "minibatch.",
        ),
    ],
)
def test_thresholds_that_make_no_sense_are_refused(settings: dict, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        FilterConfig(**settings)
    assert str(caught.value) == message
