"""One law: what `inspect` calls damaged, `filter`, `segment` and `train` refuse."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from filtering.cli import main as run_filter
from filtering.cli import segment as run_segment
from policies.cli import train as run_train
from teasim.cli.inspect import main as run_inspect
from teasim.common.errors import PoolError, TeasimError
from teasim.pool import Pool
from teasim.pool.readers.registry import check_source, open_source
from teasim.pool.soundness import print_notes, require_sound
from tests.pool.lerobot_sets import DATA, EPISODES, KEY, Recipe, make_set, rewrite_log

VIDEO = f"videos/{KEY}/chunk-000/file-000.mp4"


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    recipe = Recipe(labels="numbers", lengths=(12, 12, 12))
    return make_set(tmp_path_factory.mktemp("sets") / "sound", recipe)


def replaced(column: str, change: Callable[[np.ndarray], None]) -> Callable[[pa.Table], pa.Table]:
    def rewrite(table: pa.Table) -> pa.Table:
        values = np.array(table[column]).copy()
        change(values)
        return table.set_column(table.column_names.index(column), column, pa.array(values))

    return rewrite


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-200])


def first(value: float) -> Callable[[np.ndarray], None]:
    return lambda values: values.__setitem__(0, value)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "missing log": lambda root: (root / DATA).unlink(),
    "missing video": lambda root: (root / VIDEO).unlink(),
    "cut log": lambda root: cut(root / DATA),
    "cut video": lambda root: (root / VIDEO).write_bytes((root / VIDEO).read_bytes()[:900]),
    "rows missing": lambda root: rewrite_log(root, lambda table: table.slice(0, 30)),
    "row twice": lambda root: rewrite_log(
        root, lambda table: pa.concat_tables([table, table.slice(3, 1)])
    ),
    "wrong length": lambda root: rewrite_log(root, replaced("length", first(11)), EPISODES),
    "wrong frames": lambda root: rewrite_log(root, replaced("frame_index", first(4))),
    "wrong index": lambda root: rewrite_log(root, replaced("index", first(99))),
    "times descend": lambda root: rewrite_log(root, replaced("timestamp", first(9))),
    "another's rows": lambda root: rewrite_log(root, replaced("episode_index", first(2))),
    "ends after its video": lambda root: rewrite_log(
        root, replaced(f"videos/{KEY}/from_timestamp", lambda v: v.__iadd__(2)), EPISODES
    ),
    "label without a name": lambda root: rewrite_log(root, replaced("subtask_index", first(9))),
    "no column": lambda root: rewrite_log(root, lambda table: table.drop_columns(["action"])),
}


def outcomes(root: Path, out: Path) -> dict[str, int | str]:
    """Exit code of every verb, or the sentence it ends with."""
    verbs: dict[str, Callable[[], int]] = {
        "inspect": lambda: run_inspect([str(root)]),
        "filter": lambda: run_filter([str(root), "-o", str(out / "filter"), "--jobs", "1"]),
        "segment": lambda: run_segment(["fit", str(root), "-o", str(out / "fit"), "--jobs", "1"]),
        "train": lambda: run_train([str(root), "-o", str(out / "train"), "--jobs", "1"]),
    }
    found: dict[str, int | str] = {}
    for name, run in verbs.items():
        try:
            found[name] = run()
        except TeasimError as error:
            found[name] = str(error)
    return found


@pytest.mark.parametrize("name", DAMAGES)
def test_damage_is_refused_by_all_verbs(
    sound: Path, tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    root = Path(shutil.copytree(sound, tmp_path / "damaged"))
    DAMAGES[name](root)
    problems = check_source(root)
    assert problems
    assert all(text.endswith(".") and "\n" not in text for text in problems)
    with pytest.raises(PoolError) as caught:
        require_sound(open_source(root))
    told = str(caught.value)
    assert told.startswith(problems[0][:-1])
    assert told.endswith(f"; for the whole check run: teasim inspect {root}")
    found = outcomes(root, tmp_path / "out")
    assert found.pop("inspect") == 1
    printed = capsys.readouterr().err
    for verb, outcome in found.items():
        assert outcome == told or (outcome == 2 and told in printed), verb
    assert not (tmp_path / "out").exists()


def test_what_is_sound_is_worked_on(sound: Path) -> None:
    assert check_source(sound) == []
    require_sound(Pool.open(sound))


def test_the_number_of_other_problems_is_told(sound: Path, tmp_path: Path) -> None:
    root = Path(shutil.copytree(sound, tmp_path / "damaged"))
    (root / VIDEO).unlink()
    (root / DATA).unlink()
    with pytest.raises(PoolError) as caught:
        require_sound(open_source(root))
    assert str(caught.value) == (
        f"The file '{root / DATA}' is missing, and 1 more problem; for the whole check run: "
        f"teasim inspect {root}"
    )


def test_notes_are_printed_as_warnings(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = Path(shutil.copytree(sound, tmp_path / "copy"))
    rewrite_log(root, lambda table: table.slice(1), EPISODES)
    print_notes(open_source(root))
    lines = capsys.readouterr().err.splitlines()
    assert lines
    assert all(line.startswith("teasim: warning: ") for line in lines)


def test_every_verb_prints_the_notes(
    sound: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def stop(*_: object, **__: object) -> None:
        raise TeasimError("Far enough.")

    root = Path(shutil.copytree(sound, tmp_path / "copy"))
    rewrite_log(root, lambda table: table.slice(1), EPISODES)
    for work in ("demo_filter.DemoFilter.fit", "segmentation.fit.chosen_cameras"):
        monkeypatch.setattr(f"filtering.{work}", stop)
    monkeypatch.setattr("policies.training.demo_weights", stop)
    found = outcomes(root, tmp_path / "out")
    assert [*found.values()] == [0, *["Far enough."] * 3]  # `inspect` comes first
    notes, printed = open_source(root).notes, capsys.readouterr().err
    assert notes
    assert all(printed.count(f"teasim: warning: {note}\n") == len(found) for note in notes)


def test_a_damaged_label_file_is_a_problem_of_a_folder_of_labels(tmp_path: Path) -> None:
    (tmp_path / "groundTruth").mkdir()
    (tmp_path / "mapping.txt").write_text("0 cut\n1 mix\n")
    for name, text in (("a", "cut\nmix\n"), ("b", "cut\nfry\n")):
        (tmp_path / "groundTruth" / f"{name}.txt").write_text(text)
    problems = check_source(tmp_path)
    assert len(problems) == 1
    assert "'fry'" in problems[0]
