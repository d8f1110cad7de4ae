"""The documentation builds without a warning, and what it tells to run runs."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from teasim.cli.main import main as teasim
from tests.toy_pool import SEQ_1, make_toy_pool

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def blocks(page):
    """The commands of the bash blocks of a page, one list per block."""
    text = (ROOT / "docs" / page).read_text()
    found = re.findall(r"```bash\n(.*?)```", text, flags=re.DOTALL)
    lines = [[shlex.split(line, comments=True) for line in block.splitlines()] for block in found]
    return [[words for words in block if words] for block in lines]


def test_the_site_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", tmp_path / "site"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "DemoFilter" in (tmp_path / "site" / "api" / "index.html").read_text()


def test_every_page_is_in_the_navigation():
    listed = (ROOT / "mkdocs.yml").read_text()
    assert [page.name for page in (ROOT / "docs").glob("*.md") if page.name not in listed] == []


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_a_notebook_runs(path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    notebook = nbformat.read(path, as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells)  # none is stored
    NotebookClient(notebook, timeout=600, kernel_name="python3").execute()


@pytest.mark.slow
def test_the_quickstart_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (lines,) = blocks("index.md")
    for program, *arguments in lines:
        assert (program, teasim(arguments)) == ("teasim", 0), arguments


@pytest.mark.slow
def test_what_is_said_about_your_own_videos_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_toy_pool("recording", [SEQ_1] * 5 + [SEQ_1[:3]], size=64, frames_per_subtask=12)
    Path("names.json").write_text('{"step 1": "begin"}')
    for block in blocks("own-videos.md"):
        for program, *arguments in block:
            if "wrist" in arguments:
                arguments[arguments.index("wrist")] = "cup"  # that of the toy
            assert (program, teasim(arguments)) == ("teasim", 0), arguments
