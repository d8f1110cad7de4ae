"""scripts/setup, with a stand-in for the environment: what it does when, and what it says.

The stand-in for .venv/bin/python writes down how it is called and answers as the test wants, so
that no package is installed and no library is touched.
"""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

PYTHON = """#!/bin/bash
# Stands in for .venv/bin/python.
here=$(dirname "${BASH_SOURCE[0]}")/../..
case "$*" in
    "-c import pip") ;;
    *"-m pip"*"+cpu"*) echo "torch-cpu" >>"$here/calls"; exit "$FAKE_CPU_BUILD" ;;
    *"-m uv"*) echo "torch-uv" >>"$here/calls"; exit "$FAKE_UV" ;;
    *"-m pip"*) echo "pip ${*: -1}" >>"$here/calls" ;;
    *gl.FIXES*) echo "apt-get install libfake" ;;
    "- 2."*) exit 1 ;; # torch is not there
    "-"*)
        echo "probe" >>"$here/calls"
        [ ! -e "$here/libraries" ] || { echo egl; exit; }
        echo "teasim.common.errors.RenderError: Nothing renders; run it." >&2
        exit 1 ;;
esac
"""

APT = """#!/bin/bash
echo "apt-get $*" >>"$FAKE_ROOT/calls"
case "$*" in *install*) [ -z "$FAKE_APT_WORKS" ] || touch "$FAKE_ROOT/libraries" ;; esac
"""


@dataclass
class Copy:
    """A copy of the project small enough to set up in a moment."""

    root: Path
    environment: dict[str, str]

    def setup(self, *options: str, **environment: str) -> subprocess.CompletedProcess[str]:
        """Run scripts/setup."""
        return subprocess.run(
            ["scripts/setup", *options],
            cwd=self.root,
            env=self.environment | environment,
            capture_output=True,
            text=True,
        )

    def calls(self) -> list[str]:
        """What was called since the last look."""
        path = self.root / "calls"
        lines = path.read_text().splitlines() if path.exists() else []
        path.unlink(missing_ok=True)
        return lines


def program(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


@pytest.fixture
def copy(tmp_path) -> Copy:
    root = tmp_path / "project"
    for name in ("scripts/setup", "pyproject.toml", "requirements.lock"):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, root / name)
    program(root / ".venv/bin/python", PYTHON)
    program(root / ".venv/bin/teasim", "")
    (root / ".venv/bin/activate").write_text(f"VIRTUAL_ENV={root}/.venv\n")
    program(tmp_path / "bin/apt-get", APT)
    program(tmp_path / "bin/sudo", '#!/bin/bash\n[ "$1" != -n ] || shift\nexec env "$@"\n')
    program(tmp_path / "bin/nvidia-smi", "#!/bin/bash\nexit 1\n")
    (root / "libraries").touch()
    environment = {
        **os.environ,
        "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}",
        "PYTHON": "no-such-python",  # never make a real environment
        "FAKE_ROOT": str(root),
        "FAKE_CPU_BUILD": "0",
        "FAKE_UV": "0",
        "FAKE_APT_WORKS": "1",
    }
    return Copy(root, environment)


def test_the_first_run_installs_and_the_second_only_looks(copy):
    first = copy.setup()
    assert (first.returncode, first.stderr) == (0, "")
    assert copy.calls() == ["torch-cpu", "pip requirements.lock", "pip .", "probe"]
    second = copy.setup()
    assert second.returncode == 0
    assert copy.calls() == ["probe"]
    assert second.stdout.startswith("setup: ready in ")
    assert "rendering with egl" in second.stdout


@pytest.mark.parametrize("name", ["requirements.lock", "pyproject.toml"])
def test_a_changed_file_installs_again(copy, name):
    copy.setup()
    copy.calls()
    with (copy.root / name).open("a") as file:
        file.write("# changed\n")
    copy.setup()
    assert "pip requirements.lock" in copy.calls()


@pytest.mark.parametrize(
    ("cpu_build", "uv", "torch"),
    [
        ("0", "0", ["torch-cpu"]),
        ("1", "0", ["torch-cpu", "pip uv==", "torch-uv"]),
        ("1", "1", ["torch-cpu", "pip uv==", "torch-uv", "pip torch=="]),
    ],
)
def test_torch_comes_as_the_cpu_build_where_one_is_found(copy, cpu_build, uv, torch):
    done = copy.setup(FAKE_CPU_BUILD=cpu_build, FAKE_UV=uv)
    assert done.returncode == 0
    calls = [call.split("==")[0] + "==" * ("==" in call) for call in copy.calls()]
    assert calls[: len(torch)] == torch
    assert ("several GB" in done.stdout) == (len(torch) == 4)


def test_with_a_graphics_card_torch_is_the_standard_build(copy):
    program(Path(copy.environment["PATH"].split(":")[0]) / "nvidia-smi", "#!/bin/bash\n")
    copy.setup()
    assert copy.calls()[0].startswith("pip torch==")


def test_missing_libraries_are_installed_and_tried_again(copy):
    (copy.root / "libraries").unlink()
    done = copy.setup()
    assert done.returncode == 0
    assert copy.calls()[-4:] == [
        "probe",
        "apt-get update",
        "apt-get install libfake -y --no-install-recommends",
        "probe",
    ]
    assert "setup: installing the OpenGL libraries: apt-get install libfake\n" in done.stdout


def test_when_nothing_renders_it_says_so_in_one_sentence(copy):
    (copy.root / "libraries").unlink()
    done = copy.setup(FAKE_APT_WORKS="")
    assert done.returncode == 2
    assert done.stderr == "setup: Nothing renders; run it.\n"


def test_without_a_python_it_says_so_in_one_sentence(copy):
    (copy.root / ".venv/bin/python").unlink()
    done = copy.setup()
    assert done.returncode == 2
    assert done.stderr.startswith(
        "setup: no Python 3.11 or newer with the venv module among no-such"
    )
    assert done.stderr.count("\n") == 1


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


@pytest.fixture
def without_browser(copy, tmp_path) -> str:
    """A PATH with all programs but browsers."""
    programs = tmp_path / "programs"
    programs.mkdir()
    for folder in reversed(copy.environment["PATH"].split(":")):
        for found in Path(folder).glob("*"):
            if found.name not in BROWSERS:
                (programs / found.name).unlink(missing_ok=True)
                (programs / found.name).symlink_to(found)
    return str(programs)


def test_a_browser_is_installed_only_when_asked_for_and_absent(copy, without_browser, tmp_path):
    copy.setup(PATH=without_browser)
    assert not any("chromium" in call for call in copy.calls())
    done = copy.setup("--browser", PATH=without_browser)
    assert done.returncode == 0
    install = "apt-get install chromium -y --no-install-recommends"
    assert copy.calls()[-2:] == ["apt-get update", install]
    assert "setup: installing a browser: apt-get install chromium\n" in done.stdout
    program(tmp_path / "programs/chromium", "")
    copy.setup("--browser", PATH=without_browser)
    assert copy.calls() == ["probe"]


def test_without_a_browser_it_says_which_tests_are_skipped(copy, without_browser, tmp_path):
    (tmp_path / "programs/apt-get").unlink()
    done = copy.setup("--browser", PATH=without_browser)
    assert done.returncode == 0
    assert (
        "setup: chromium cannot be installed; the tests of the report page in a browser are "
        "skipped\n" in done.stdout
    )
