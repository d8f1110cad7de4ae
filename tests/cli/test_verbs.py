"""Laws that hold for every verb of this project."""

import os
import pty
import re
import subprocess
import sys
import tomllib
from importlib.metadata import entry_points
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GROUP = "teasim.verbs"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
VERBS = PROJECT["entry-points"][GROUP]
HEAVY = ("torch", "mujoco", "cv2", "stable_baselines3")

PROGRAM = f"""
import sys
from teasim.cli.main import main
code = main(sys.argv[1:])
print("loaded:", *[name for name in {HEAVY} if name in sys.modules])
sys.exit(code)
"""


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the dispatcher in a process of its own, which then tells what it loaded.

    Its output is no terminal and no width is given, as where it is piped into a file.
    """
    command = [sys.executable, "-c", PROGRAM, *arguments]
    environment = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=environment)


def test_the_installed_verbs_are_those_of_the_project():
    installed = {p.name: p.value for p in entry_points(group=GROUP) if p.dist.name == "teasim"}
    assert installed == VERBS, "run scripts/setup"


@pytest.mark.parametrize("verb", VERBS)
def test_help_tells_usage_and_purpose_quickly(verb):
    done = run(verb, "--help")
    assert (done.returncode, done.stderr) == (0, "")
    usage, purpose, *_ = done.stdout.split("\n\n")
    assert usage.startswith(f"usage: teasim {verb}")
    assert purpose.strip().endswith(".")
    assert done.stdout.endswith("loaded:\n"), "--help loads a heavy package"


@pytest.mark.parametrize("verb", VERBS)
def test_help_fits_a_terminal_and_ends_with_two_examples(verb):
    lines = run(verb, "--help").stdout.splitlines()[:-1]
    assert [line for line in lines if len(line) > 80] == []
    assert "examples:" in lines
    examples = lines[lines.index("examples:") + 1 :]
    assert len(examples) >= 2
    assert all(example.startswith(f"  teasim {verb}") for example in examples)


@pytest.mark.parametrize("verb", VERBS)
def test_the_options_of_examples_exist(verb):
    examples = run(verb, "--help").stdout.split("examples:\n")[1].splitlines()[:-1]
    for _, _, *words in map(str.split, examples):
        part = [word for word in words[:1] if not word.startswith("-")]  # perhaps a sub-command
        known = run(verb, *part, "--help").stdout.split("examples:")[0]
        options = {word for word in words if word.startswith("--")}
        assert options <= set(re.findall(r"--[\w-]+", known)), " ".join(words)


def test_verbs_that_go_on_where_they_were_interrupted_say_so_and_are_documented():
    verbs = {p.name: p.load() for p in entry_points(group=GROUP) if p.name in VERBS}
    resuming = {name for name, verb in verbs.items() if getattr(verb, "resumes", False)}
    text = (ROOT / "docs" / "cluster.md").read_text()
    sentence = re.search(r"`generate`[^.]*resume what was interrupted", text)
    assert sentence is not None
    assert resuming == set(re.findall(r"`(\w+)`", sentence[0]))


@pytest.mark.parametrize("verb", VERBS)
def test_options_are_completed_by_the_shell(verb):
    script = run(verb, "--tyro-print-completion", "bash").stdout
    assert f"# Bash completion for teasim {verb}" in script
    assert "examples:" not in script


@pytest.mark.parametrize("verb", VERBS)
def test_an_unknown_option_is_a_usage_error(verb):
    done = run(verb, "--no-such-option")
    assert done.returncode == 2
    assert f"teasim {verb} --help" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(("no_color", "coloured"), [("1", False), ("", True)])
def test_no_color_is_respected_on_a_terminal(no_color, coloured):
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "teasim", "doctor", "--help"]
    environment = {**os.environ, "TERM": "xterm", "NO_COLOR": no_color}
    subprocess.run(command, cwd=ROOT, stdout=theirs, env=environment, check=True)
    os.close(theirs)
    with os.fdopen(ours, "rb") as terminal:
        assert (b"\x1b[" in terminal.read1(4096)) == coloured


def test_the_list_of_verbs_has_a_summary_for_each():
    done = run("--help")
    rows = dict(re.findall(r"^  (\w\S*) +(.*)$", done.stdout, flags=re.MULTILINE))
    assert set(rows) == set(VERBS)
    assert all(summary.endswith(".") for summary in rows.values())
    assert done.stdout.endswith("loaded:\n")
