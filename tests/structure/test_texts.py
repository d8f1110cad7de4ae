"""The texts keep their promises: commands exist, links lead somewhere, nothing names a machine."""

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from teasim.cli.main import main as teasim
from tests.toy_pool import SEQ_1, make_toy_pool

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
VERBS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"][
    "teasim.verbs"
]
MARKDOWN = [
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "docs/results.md",
    "docs/ci.md",
    "docs/policies.md",
    "docs/data.md",
    "docs/reproduce.md",
]
SCRIPTS = ["scripts/setup", "scripts/test", "scripts/demo", ".ci/run"]
TEXTS = {".py", ".md", ".toml", ".xml", ".html", ".j2", ".css", ".js", ".yml", ".yaml", ".lock", ""}

# Folders of one machine, hosts of package registries, numbers of a tracker.
FORBIDDEN = re.compile(
    r"(?<![\w.])/(?:root|home|work|Users|opt)/"
    r"|pypi\.(?:org|python)|pythonhosted\.|download\.pytorch"
    r"|\bissue #\d",
    re.IGNORECASE,
)


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def commands() -> list[list[str]]:
    lines = "".join(blocks("bash")).splitlines()
    return [shlex.split(line, comments=True) for line in lines if line.strip()]


def project_texts() -> list[Path]:
    """Every text file of the project that is not made by running it."""
    kept = []
    for folder, folders, names in os.walk(ROOT):
        folders[:] = [f for f in folders if f not in ("out", "dist", "__pycache__")]
        folders[:] = [f for f in folders if not f.startswith(".") or f in (".ci", ".github")]
        kept += [Path(folder, name) for name in names if Path(name).suffix in TEXTS]
    return [path for path in kept if path.name != ".git"]  # a work tree points to its repository


def test_the_readme_is_short():
    assert len(README.splitlines()) <= 140


@pytest.mark.parametrize("name", MARKDOWN)
def test_links_lead_somewhere(name):
    path = ROOT / name
    targets = re.findall(r"\]\(([^)#]+)[^)]*\)", path.read_text())
    missing = [t for t in targets if "://" not in t and not (path.parent / t).exists()]
    assert missing == []


def test_the_readmes_scripts_and_verbs_exist():
    assert {"scripts/demo", "scripts/test"} <= {words[0] for words in commands()}
    for program, *rest in commands():
        if program == "teasim":
            assert rest[0] in VERBS
        elif program == "source":
            assert rest == [".venv/bin/activate"]  # where scripts/setup makes the environment
        else:
            assert program in SCRIPTS


def test_the_readme_names_every_verb():
    assert {verb for verb in VERBS if f"| `teasim {verb}` |" in README} == set(VERBS)


def help_of(*verb: str) -> str:
    command = [sys.executable, "-m", "teasim", *verb, "--help"]
    return subprocess.check_output(command, text=True, cwd=ROOT)


@pytest.mark.parametrize("verb", VERBS)
def test_the_readmes_options_exist(verb):
    used = {
        word
        for program, *rest in commands()
        if program == "teasim" and rest[0] == verb
        for word in rest
        if word.startswith("-")
    }
    known = help_of(verb)
    if parts := re.match(r"usage: \S+ \S+ \[-h\] \{([\w,]+)\}", known):
        known += "".join(help_of(verb, part) for part in parts[1].split(","))
    assert {option for option in used if not re.search(rf"{option}\b", known)} == set()


def test_the_readme_shows_the_entry_points():
    shown = "\n".join(blocks("python")) + README
    for statement in (
        "from filtering import DemoFilter",
        "from teasim import Pool",
        "from teasim import generate",
        "from policies import load_policy, train",
    ):
        assert statement in shown
        subprocess.run([sys.executable, "-c", statement], cwd=ROOT, check=True)


@pytest.mark.parametrize("block", blocks("python"), ids=["environment", "filter"])
def test_the_readmes_python_runs(block, tmp_path):
    make_toy_pool(tmp_path / "pool", [SEQ_1] * 3 + [SEQ_1[1:]], size=32, frames_per_subtask=4)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-W", "error::ResourceWarning", "-c", block]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""  # what is opened is closed
    if "gym.make" in block:
        assert done.stdout.startswith("True ")  # tea is made by correct actions
    else:
        assert len(done.stdout.splitlines()) == 4


@pytest.mark.slow
def test_every_line_of_your_own_videos_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    make_toy_pool("recording", [SEQ_1] * 5 + [SEQ_1[1:]], size=32, frames_per_subtask=6)
    assert teasim(["convert", "recording", "films", "--to", "videos", "--jobs", "1"]) == 0
    section = README.split("## Your own videos")[1].split("## ")[0]
    (block,) = re.findall(r"```bash\n(.*?)```", section, flags=re.DOTALL)
    for line in block.splitlines():
        program, *arguments = shlex.split(line, comments=True)
        assert (program, teasim(arguments)) == ("teasim", 0), line + capsys.readouterr().err


@pytest.mark.parametrize("name", SCRIPTS)
def test_scripts_can_be_run(name):
    assert os.access(ROOT / name, os.X_OK)
    subprocess.run(["bash", "-n", ROOT / name], check=True)


def test_no_text_names_a_machine_a_registry_or_a_tracker():
    found = [
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path in project_texts()
        for match in [FORBIDDEN.search(path.read_text(errors="replace"))]
        if match
    ]
    assert found == []
