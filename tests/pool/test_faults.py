"""Whatever stops the writing, the same command continues it; two writers exclude each other."""

import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from teasim.common.errors import ConfigError, TeasimError
from teasim.common.lock import locked
from teasim.common.workers import Workers
from teasim.pool.readers.registry import open_source
from teasim.pool.source import Source
from teasim.pool.writers import writing
from teasim.pool.writers.content import Choice, content_of
from teasim.pool.writers.registry import WRITERS
from teasim.pool.writers.writing import kept, staging_of, write
from tests.pool import foreign_inputs as made
from tests.pool.faults import hashes

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Source:
    return open_source(made.videos(tmp_path_factory.mktemp("faults") / "films"))


@pytest.fixture
def robomimic(tmp_path: Path) -> Source:
    return open_source(made.robomimic(tmp_path / "source"))


def copy(source: Source, dest: Path, to: str = "lerobot", **choice: object) -> None:
    write(WRITERS[to], source, content_of(source, Choice(**choice)), dest)


def test_killed_writers_are_resumed_to_the_byte(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.pool.faults", str(tmp_path), "--kills", "4"]
    formats = ["--formats", "lerobot", "robomimic"]
    done = subprocess.run(
        [*command, *formats], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "pool: 4\nlerobot: 4\nrobomimic: 4\n"


@pytest.mark.parametrize("to", WRITERS)
def test_the_result_depends_neither_on_jobs_nor_on_time(toy_pool: Source, to: str, tmp_path: Path):
    suffix = ".hdf5" if WRITERS[to].suffixes else ""
    content = content_of(toy_pool, Choice())
    for name, jobs in (("one", 1), ("two", 2)):
        write(WRITERS[to], toy_pool, content, tmp_path / f"{name}{suffix}", workers=Workers(jobs))
    assert hashes(tmp_path / f"one{suffix}") == hashes(tmp_path / f"two{suffix}")


def test_a_second_writer_is_refused_and_a_dead_ones_lock_is_taken_over(
    source: Source, tmp_path: Path
) -> None:
    dest = tmp_path / "copy"
    with locked(dest), pytest.raises(ConfigError) as caught:
        copy(source, dest)
    said = str(caught.value)
    assert said.startswith(f"'{dest}' is being written by process {os.getpid()} on ")
    assert said.endswith("; wait until it ends, or choose another destination.")
    (tmp_path / ".copy.lock").write_text("1 elsewhere\n")
    copy(source, dest)
    assert [path.name for path in tmp_path.iterdir()] == ["copy"]


def test_a_destination_in_use_is_refused_and_left_alone(source: Source, tmp_path: Path) -> None:
    (tmp_path / "copy").mkdir()
    (tmp_path / "copy" / "mine").write_text("x")
    with pytest.raises(ConfigError, match="is in use; choose a new or empty one"):
        copy(source, tmp_path / "copy")
    assert hashes(tmp_path) == hashes(tmp_path) == {"copy/mine": hashes(tmp_path)["copy/mine"]}
    with pytest.raises(ConfigError, match="lies in the source"):
        copy(source, source.root / "copy")
    with pytest.raises(ConfigError, match=r"must end in \.hdf5 or \.h5: robomimic is one file"):
        copy(source, tmp_path / "x", "robomimic")


def stop_after(monkeypatch: pytest.MonkeyPatch, count: int, error: BaseException) -> None:
    """Let the writing of demonstration `count` fail."""
    usual = writing._stage

    def failing(writer, common, staging, item):
        if item.number == count:
            raise error
        usual(writer, common, staging, item)

    monkeypatch.setattr(writing, "_stage", failing)


def test_other_content_does_not_continue_what_is_unfinished(
    source: Source, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dest = tmp_path / "copy"
    with monkeypatch.context() as patch:
        stop_after(patch, 2, KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            copy(source, dest)
    assert kept(dest) == 2
    assert not dest.exists()
    with pytest.raises(ConfigError) as caught:
        copy(source, dest, "videos")
    assert str(caught.value) == (
        f"'{staging_of(dest)}' holds an unfinished data set of other content; remove it, or choose "
        "another destination."
    )
    copy(source, dest)
    assert len(open_source(dest).episodes) == len(made.LENGTHS)


def test_a_full_disk_is_one_sentence_and_nothing_is_lost(
    source: Source, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dest = tmp_path / "copy"
    with monkeypatch.context() as patch:
        stop_after(patch, 3, OSError(28, "No space left on device"))
        with pytest.raises(TeasimError) as caught:
            copy(source, dest)
    assert str(caught.value) == (
        f"'{dest}' cannot be written: No space left on device; 3 of 4 demonstrations are kept in "
        f"'{staging_of(dest)}', and the same command continues."
    )
    copy(source, dest)
    copy(source, tmp_path / "whole")
    assert hashes(dest) == hashes(tmp_path / "whole")


@pytest.fixture
def small_files() -> Iterator[None]:
    """No file may grow beyond 20 kB, as if the disk were full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_files_that_cannot_grow_are_one_sentence(
    robomimic: Source, tmp_path: Path, small_files: None
) -> None:
    for to, name in (("robomimic", "copy.hdf5"), ("minari", "copy")):
        with pytest.raises(TeasimError) as caught:
            copy(robomimic, tmp_path / name, to)
        said = str(caught.value)
        assert said.startswith(f"'{tmp_path / name}' cannot be written: ")
        assert not (tmp_path / name).exists()


def unwritable(folder: Path) -> Path:
    """A folder in which nothing can be made, by root neither."""
    folder.mkdir()
    folder.chmod(0o500)
    return Path("/sys/kernel") if os.access(folder, os.W_OK) else folder


def test_a_read_only_folder_is_one_sentence(source: Source, tmp_path: Path) -> None:
    dest = unwritable(tmp_path / "locked") / "copy"
    with pytest.raises(TeasimError) as caught:
        copy(source, dest)
    assert str(caught.value).startswith(f"'{dest}' cannot be written: ")
    assert str(caught.value).endswith(("ermission denied.", "not permitted.", "system."))


def test_a_conversion_killed_after_its_last_rename_is_tidied_up(
    source: Source, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dest = tmp_path / "copy"
    with monkeypatch.context() as patch:

        def killed(path, *arguments, **more):
            if Path(path).name == staging_of(dest).name:
                raise KeyboardInterrupt

        patch.setattr(writing.shutil, "rmtree", killed)
        with pytest.raises(KeyboardInterrupt):
            copy(source, dest)
    assert staging_of(dest).exists()
    copy(source, dest)
    assert [path.name for path in tmp_path.iterdir()] == ["copy"]
    with pytest.raises(ConfigError, match="is in use"):
        copy(source, dest)
