"""The verbs convert and label: words, codes and files."""

import json
from pathlib import Path

import pytest

from teasim.cli.main import main
from teasim.pool import Span
from teasim.pool.readers.registry import open_source
from teasim.pool.segments_table import segment_rows, write_segments_table
from teasim.pool.weight_table import WeightRow, write_weight_table
from tests.pool import foreign_inputs as made
from tests.toy_pool import make_toy_pool


@pytest.fixture
def films(tmp_path: Path) -> Path:
    return made.videos(tmp_path / "films")


def table_of(source: Path, path: Path) -> Path:
    """Two segments in each demonstration."""
    opened = open_source(source)
    spans = [(Span("step 1", 0, 2), Span("step 2", 2, 4)) for _ in opened.episodes]
    write_segments_table(path, segment_rows(opened, spans))
    return path


def test_convert_says_what_it_wrote(films: Path, tmp_path: Path, capsys) -> None:
    command = ["convert", str(films), str(tmp_path / "pool"), "--to", "lerobot", "--jobs", "1"]
    assert main(command) == 0
    said = capsys.readouterr()
    assert (said.out, said.err) == (f"4 demonstrations in {tmp_path / 'pool'} (lerobot)\n", "")
    assert main(["inspect", str(tmp_path / "pool")]) == 0
    capsys.readouterr()
    assert main(command) == 2
    assert "is in use" in capsys.readouterr().err


def test_convert_refuses_in_one_sentence(films: Path, tmp_path: Path, capsys) -> None:
    dest = str(tmp_path / "x.hdf5")
    assert main(["convert", str(films), dest, "--to", "robomimic"]) == 2
    assert capsys.readouterr().err == (
        f"teasim: '{films}' has no log 'action', which robomimic needs; its logs: none.\n"
    )
    assert main(["convert", str(films), dest, "--to", "tape"]) == 2
    (films / "ep 0 ü.mp4").write_bytes(b"no video")
    assert main(["convert", str(films), str(tmp_path / "y"), "--to", "lerobot"]) == 2
    assert "cannot be opened" in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["films"]


def test_convert_uses_verdicts(tmp_path: Path, capsys) -> None:
    pool = make_toy_pool(tmp_path / "pool", [("a", "b"), ("b", "a")], size=32)
    rows = [WeightRow(d.demo_id, d.index, 0.5, 1.0, d.index == 0, 0, "x") for d in pool.episodes]
    write_weight_table(tmp_path / "weights.csv", rows)
    command = ["convert", str(pool.root), str(tmp_path / "kept"), "--to", "lerobot"]
    command += ["--weights", str(tmp_path / "weights.csv"), "--drop-flagged", "--camera", "cup"]
    assert main(command) == 0
    copy = open_source(tmp_path / "kept")
    assert [demo.demo_id for demo in copy.episodes] == [pool.episodes[1].demo_id]
    assert copy.cameras == ("cup",)
    assert copy.episodes[0].record == pool.episodes[1].record


@pytest.mark.parametrize("form", ["lines", "json"])
def test_label_names_what_was_found_in_the_sources_own_format(
    films: Path, tmp_path: Path, form: str
) -> None:
    table = table_of(films, tmp_path / "segments.csv")
    names = tmp_path / "names"
    given = {"step 1": "pour water", "step 2": "stir"}
    lines = "".join(f"{old} = {new}\n" for old, new in given.items())
    names.write_text(json.dumps(given) if form == "json" else f"# names\n\n{lines}")
    out = tmp_path / "named"
    command = ["label", str(films), "--segments", str(table), "--names", str(names)]
    assert main([*command, "-o", str(out)]) == 0
    copy = open_source(out)
    assert copy.subtasks == ("pour water", "stir")
    assert all(d.spans() == (Span("pour water", 0, 2), Span("stir", 2, 4)) for d in copy.episodes)
    before = open_source(films).episodes
    assert [d.demo_id for d in copy.episodes] == [d.demo_id for d in before]
    assert main([*command, "-o", str(tmp_path / "tree"), "--to", "ms-tcn"]) == 0
    assert open_source(tmp_path / "tree").episodes[0].spans() == copy.episodes[0].spans()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("step 9 = stir", "'step 9' is no sub-task that was found; choose step 1, step 2."),
        ("step 1", "Line 1 of '{names}' is 'step 1'; write 'step 1 = pour water', each sub-task"),
        ("", "The file of names '{names}' is empty; it needs lines 'step 1 = pour water', or"),
        ("{1: 2}", "The file of names '{names}' is no readable JSON."),
        ('{"step 1": 3}', "The file of names '{names}' is not of the form lines 'step 1 = pour"),
    ],
)
def test_wrong_names_are_one_sentence(films: Path, tmp_path: Path, text: str, said: str, capsys):
    table = table_of(films, tmp_path / "segments.csv")
    names = tmp_path / "names.txt"
    names.write_text(text)
    command = ["label", str(films), "--segments", str(table), "--names", str(names)]
    assert main([*command, "-o", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.startswith("teasim: " + said.format(names=names))


def test_segments_with_one_name_are_joined(films: Path, tmp_path: Path) -> None:
    table = table_of(films, tmp_path / "segments.csv")
    (tmp_path / "names.txt").write_text("step 1 = stir\nstep 2 = stir\n")
    command = ["label", str(films), "--segments", str(table), "--names"]
    assert main([*command, str(tmp_path / "names.txt"), "-o", str(tmp_path / "out")]) == 0
    assert open_source(tmp_path / "out").episodes[0].spans() == (Span("stir", 0, 4),)


def test_an_interrupt_says_what_is_kept(
    films: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    def interrupted(*arguments: object, **more: object) -> None:
        (tmp_path / ".pool.incomplete" / "000000").mkdir(parents=True)
        raise KeyboardInterrupt

    monkeypatch.setattr("teasim.pool.writers.writing.write", interrupted)
    assert main(["convert", str(films), str(tmp_path / "pool"), "--to", "videos"]) == 130
    assert capsys.readouterr().err == (
        f"teasim: Interrupted; 1 of 4 demonstrations are kept in '{tmp_path / '.pool.incomplete'}',"
        " run the same command again to continue.\n"
    )
