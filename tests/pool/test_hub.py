import shutil
from pathlib import Path

import pytest

from teasim.common.errors import PoolError
from teasim.pool import Pool
from teasim.pool.hub import located
from teasim.pool.readers.registry import open_source
from tests.pool.lerobot_sets import make_set

NAME = "someone/squares"


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_set(tmp_path_factory.mktemp("sets") / "set")


@pytest.fixture(autouse=True)
def _home(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for variable in ("HF_LEROBOT_HOME", "HF_HOME", "HF_HUB_CACHE"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("variable", "value", "place"),
    [
        ("HF_LEROBOT_HOME", "a", "a/someone/squares"),
        ("HF_HOME", "b", "b/lerobot/someone/squares"),
        ("HF_HOME", "b", "b/hub/datasets--someone--squares/snapshots/0a1b"),
        ("HF_HUB_CACHE", "c", "c/datasets--someone--squares/snapshots/0a1b"),
        (None, "", "home/.cache/huggingface/lerobot/someone/squares"),
        (None, "", "home/.cache/huggingface/hub/datasets--someone--squares/snapshots/0a1b"),
    ],
)
def test_a_name_is_found_in_the_local_cache(
    stored: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    variable: str | None,
    value: str,
    place: str,
) -> None:
    if variable:
        monkeypatch.setenv(variable, str(tmp_path / value))
    shutil.copytree(stored, tmp_path / place)
    for opened in (open_source(NAME), Pool.open(NAME)):
        assert opened.root == tmp_path / place
        assert len(opened.episodes) == 3


def test_a_snapshot_of_links_into_the_blobs_is_read(stored: Path, tmp_path: Path) -> None:
    folder = tmp_path / "home/.cache/huggingface/hub/datasets--someone--squares"
    (folder / "blobs").mkdir(parents=True)
    for number, path in enumerate(p for p in sorted(stored.rglob("*")) if p.is_file()):
        shutil.copy(path, folder / f"blobs/{number}")
        link = folder / "snapshots/0a1b" / path.relative_to(stored)
        link.parent.mkdir(parents=True, exist_ok=True)
        link.symlink_to(folder / f"blobs/{number}")
    pool = open_source(NAME)
    assert pool.problems() == []
    assert pool.episodes[0].clip("top").frames([0]).shape == (1, 16, 16, 3)


def test_the_revision_of_the_main_branch_counts_first(tmp_path: Path) -> None:
    folder = tmp_path / "home/.cache/huggingface/hub/datasets--someone--squares"
    for name in ("old", "main's", "new"):
        (folder / "snapshots" / name).mkdir(parents=True)
    (folder / "refs").mkdir()
    (folder / "refs/main").write_text("main's")
    assert located(NAME).name == "main's"


def test_a_folder_of_that_name_counts_before_the_cache(stored: Path, tmp_path: Path) -> None:
    shutil.copytree(stored, tmp_path / "home/.cache/huggingface/lerobot" / NAME)
    shutil.copytree(stored, tmp_path / NAME)
    assert open_source(NAME).root == Path(NAME)


def test_a_name_that_was_not_fetched_is_answered_with_the_command() -> None:
    with pytest.raises(PoolError) as caught:
        open_source(NAME)
    assert str(caught.value) == (
        "There is nothing at 'someone/squares', and no data set of that name in the local cache "
        "of the Hugging Face Hub; fetch it with: hf download someone/squares --repo-type dataset "
        "--local-dir squares"
    )


@pytest.mark.parametrize("path", ["none", "a/b/c", "../squares", "/a/b"])
def test_other_paths_are_no_names(path: str) -> None:
    with pytest.raises(PoolError) as caught:
        open_source(path)
    assert str(caught.value) == (
        f"There is nothing at '{path}'; name a folder with demonstrations."
    )
