"""What the pages on policies say can be done."""

import re
import shlex
from importlib import import_module
from pathlib import Path

import pytest

from policies import cli
from policies.experiments import ablation_config
from policies.learners.registry import AT_JOINTS, LEARNERS

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {name: (DOCS / name).read_text() for name in ("ci.md", "policies.md")}


def commands(page):
    """Verb and options of every command line on `page`; a folded one is one line."""
    text = re.sub(r"\n +(?=--)", " ", re.sub(r"run: >\n +", "run: ", PAGES[page]))
    for line in re.findall(r"teasim (?:train|evaluate|ablate) [^\n`]*", text):
        _, verb, *words = shlex.split(line)
        yield verb, [word for word in words if word.startswith("--")]


@pytest.mark.parametrize("page", PAGES)
def test_the_options_of_the_commands_exist(page, capsys):
    found = list(commands(page))
    assert len(found) >= 2
    for verb, options in found:
        with pytest.raises(SystemExit):
            getattr(cli, verb)(["--help"])
        known = capsys.readouterr().out
        assert [option for option in options if not re.search(rf"{option}\b", known)] == []


def test_the_build_sets_a_bar_and_keeps_the_scores():
    (options,) = (options for _, options in commands("ci.md") if "--junit" in options)
    assert {"--min-policy-accuracy", "--json", "--episodes", "--seed"} <= set(options)


def test_every_learner_is_in_both_tables():
    learning = PAGES["policies.md"].partition("## Ablations")[0]
    rows = re.findall(r"^\| `([a-z][\w-]*)` \|", learning, re.MULTILINE)
    joints = [name for name, kind in LEARNERS.items() if "joint" in kind.levels]
    assert rows == [*LEARNERS, *LEARNERS, *sorted([*joints, *AT_JOINTS]), *AT_JOINTS]


def test_the_settings_of_every_learner_are_on_the_page():
    table = PAGES["policies.md"].partition("## Settings of a learner")[2].partition("## Python")[0]
    rows = dict(re.findall(r"^\| `([\w-]+)` \| (.+) \|$", table, re.MULTILINE))
    assert settings(rows) == {name: kind.options for name, kind in LEARNERS.items()}


def settings(rows):
    """Names of the settings of every learner, for the second columns of a table."""
    return {
        name: tuple(row.replace("those of `bc`", rows["bc"]).split(", "))
        for name, row in rows.items()
    }


def test_the_settings_at_the_joint_level_are_on_the_page():
    table = PAGES["policies.md"].partition("| learner at the level `joint` |")[2]
    table = table.partition("\n## ")[0]
    rows = dict(re.findall(r"^\| `([\w-]+)` \| (.+) \|$", table, re.MULTILINE))
    assert settings(rows) == {name: kind.options for name, kind in AT_JOINTS.items()}


def test_the_plan_on_the_page_is_that_of_the_module():
    plan, *_ = re.findall(r"```toml\n(.*?)```", PAGES["policies.md"], re.DOTALL)
    lines = [line[4:] for line in ablation_config.__doc__.splitlines() if line[:4] == "    "]
    assert [line for line in plan.splitlines() if line] == lines


def test_what_the_python_imports_exists():
    imports = re.findall(r"^from ([\w.]+) import (.+)$", PAGES["policies.md"], re.MULTILINE)
    assert len(imports) == 8
    for module, names in imports:
        assert all(hasattr(import_module(module), name) for name in names.split(", "))
