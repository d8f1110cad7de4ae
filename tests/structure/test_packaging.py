"""What is shipped and what it needs: the wheel, the lock, the metadata."""

import ast
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.version import Version

ROOT = Path(__file__).parents[2]
PACKAGES = {"teasim", "filtering", "policies"}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def lock_lines() -> list[str]:
    lines = (ROOT / "requirements.lock").read_text().splitlines()
    return [line for line in lines if line and not line.startswith("#")]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> set[str]:
    """Names of the files in the wheel."""
    out = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(out)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (path,) = out.glob("*.whl")
    return set(zipfile.ZipFile(path).namelist())


def test_the_wheel_carries_the_models_inside_the_package(wheel):
    on_disk = {
        f"teasim/{path.relative_to(ROOT).as_posix()}"
        for path in (ROOT / "assets").rglob("*")
        if path.is_file()
    }
    assert any(name.endswith(".xml") for name in on_disk)
    assert on_disk <= wheel


def test_the_wheel_is_complete_and_carries_nothing_else(wheel):
    assert {f"{package}/py.typed" for package in PACKAGES} <= wheel
    sources = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert sources <= wheel
    assert {name.split("/")[0] for name in wheel} == {
        *PACKAGES,
        f"teasim-{PROJECT['version']}.dist-info",
    }


def test_the_wheel_carries_the_licence(wheel):
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in wheel)


def test_every_locked_version_is_exact_and_plain():
    assert all(re.fullmatch(r"[\w.-]+==[\d.]+", line) for line in lock_lines())


@pytest.mark.parametrize("group", ["run", "dev"])
def test_the_lock_meets_the_ranges(group):
    locked = {normal(n): Version(v) for n, v in (line.split("==") for line in lock_lines())}
    ranges = PROJECT["dependencies"] if group == "run" else PROJECT["optional-dependencies"]["dev"]
    for wanted in map(Requirement, ranges):
        assert wanted.specifier.contains(locked[normal(wanted.name)]), wanted


def imported() -> set[str]:
    """Top-level packages that the project's own packages import, ours and Python's left out."""
    found = set()
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Import):
                    found |= {alias.name.split(".")[0] for alias in node.names}
                elif isinstance(node, ast.ImportFrom) and node.module:
                    found.add(node.module.split(".")[0])
    return found - PACKAGES - sys.stdlib_module_names


# Policies answer SB3's protocol and pictures are saved with imageio: whoever installs the project
# can count on both, although its own packages do not import them.
PROMISED = {"imageio", "stable-baselines3"}


def test_what_is_imported_is_what_is_declared():
    extras = PROJECT["optional-dependencies"]
    optional = {
        normal(Requirement(line).name)
        for name in ("dask", "figures", "hdf5", "ray")
        for line in extras[name]
    }
    declared = {normal(Requirement(line).name) for line in PROJECT["dependencies"]}
    owners = packages_distributions()
    used = {normal(owners.get(name, [name])[0]) for name in imported()}
    assert used - optional | PROMISED == declared


def test_the_changelog_knows_this_version():
    assert f"## {PROJECT['version']}" in (ROOT / "CHANGELOG.md").read_text()


def test_set_up_and_lock_agree_on_torch():
    version = re.search(r"TORCH=([\d.]+)", (ROOT / "scripts/setup").read_text())
    assert version is not None
    assert f"torch=={version[1]}" in lock_lines()
