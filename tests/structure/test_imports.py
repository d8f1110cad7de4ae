"""What an import costs and reaches: what import-linter cannot see, or cannot say."""

import ast
import subprocess
import sys
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

import grimp
import pytest

import teasim

ROOT = Path(__file__).parents[2]
PACKAGES = ("teasim", "filtering", "policies")
HEAVY = {
    "torch",
    "torch_geometric",
    "mujoco",
    "mink",
    "cv2",
    "stable_baselines3",
    "sklearn",
    "scipy",
}


def loaded_by(statement: str) -> set[str]:
    """Top-level packages in memory after a statement, in a fresh interpreter."""
    program = f"{statement}\nimport sys; print(*{{name.split('.')[0] for name in sys.modules}})"
    command = [sys.executable, "-c", program]
    return set(subprocess.check_output(command, cwd=ROOT, text=True).split())


@pytest.mark.parametrize(
    ("module", "unwanted"),
    [
        ("teasim", HEAVY),
        ("teasim.cli.main", {*HEAVY, "tyro"}),
        ("teasim.gl", HEAVY),
        ("teasim.pool", {"torch", "mujoco", "mink", "stable_baselines3"}),
        ("filtering", {"torch", "mujoco", "stable_baselines3"}),
        ("policies.cli", HEAVY),
    ],
)
def test_importing_loads_nothing_heavy(module, unwanted):
    assert loaded_by(f"import {module}") & unwanted == set()


def test_the_dispatcher_imports_only_the_errors():
    graph = grimp.build_graph(*PACKAGES, include_external_packages=False, cache_dir=None)
    assert graph.find_modules_directly_imported_by("teasim.cli.main") == {"teasim.common.errors"}


def modules() -> list[str]:
    return [
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
    ]


def test_every_exported_name_exists():
    for name in modules():
        tree = ast.parse(source(name))
        if any(isinstance(node, ast.Name) and node.id == "__all__" for node in ast.walk(tree)):
            module = import_module(name)
            missing = [public for public in module.__all__ if not hasattr(module, public)]
            assert missing == [], name


def source(name: str) -> str:
    path = ROOT.joinpath(*name.split("."))
    return (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text()


@pytest.mark.parametrize("first", ["", "import teasim.generation, teasim.pool; "])
def test_teasims_entry_points_are_what_they_are_called(first):
    program = f"{first}from teasim import Pool, generate; print(callable(generate), Pool.__name__)"
    command = [sys.executable, "-c", program]
    assert subprocess.check_output(command, cwd=ROOT, text=True) == "True Pool\n"


def test_teasim_knows_its_version():
    assert teasim.__version__ == version("teasim")


def test_an_unknown_name_of_teasim_is_an_import_error():
    with pytest.raises(ImportError, match="cannot import name 'generated'"):
        exec("from teasim import generated")
