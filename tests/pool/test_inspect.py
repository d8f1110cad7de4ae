import json
import subprocess
import sys
from pathlib import Path

import pytest

from teasim.cli.inspect import main
from teasim.common.errors import ConfigError, PoolError
from teasim.pool import Pool
from tests.toy_pool import SEQ_1, SEQ_2, copy_pool, make_toy_pool, strip_ground_truth, strip_labels


def test_a_sound_pool_is_shown_in_full(toy_pool: Pool, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(toy_pool.root)]) == 0
    lines = capsys.readouterr().out.splitlines()
    for episode, line in zip(toy_pool.episodes, lines[1:4], strict=True):
        assert line.split()[:4] == [
            str(episode.index),
            episode.demo_id,
            f"{episode.length / 10:.1f}",
            f"seq_{episode.index + 1}",
        ]
    assert lines[1].split()[4:] == ["yes", "p1", "0", "4", "2", "3", "6", "1", "5"]
    assert lines[4] == "   mistakes: skip turn_off_oven"
    facts = dict(line.split(":", 1) for line in lines[6:] if ":" in line)
    assert facts["Cameras"].strip() == "left, cup"
    assert facts["Frame rate"].strip() == "10 per second"
    assert facts["Content hash"].strip() == toy_pool.content_hash()
    assert facts["Integrity"].strip() == "sound"


def test_the_text_fits_80_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    many = [*SEQ_1, *SEQ_1[:5], *SEQ_2, *SEQ_1[1:], *SEQ_2[::-1]]
    make_toy_pool(tmp_path / "p", [many, SEQ_2, SEQ_1[3:]], size=16, frames_per_subtask=2)
    assert main([str(tmp_path / "p")]) == 0
    out = capsys.readouterr().out.replace(str(tmp_path), "")
    assert max(map(len, out.splitlines())) <= 80


def test_json_has_facts_demonstrations_and_problems(
    toy_pool: Pool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(toy_pool.root), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["source"] == str(toy_pool.root)
    assert told["format"] == "LeRobot data set"
    assert told["problems"] == []
    assert told["content_hash"] == toy_pool.content_hash()
    assert told["subtasks"] == list(toy_pool.subtasks)
    last = told["demonstrations"][2]
    assert last["demo_id"] == toy_pool.episodes[2].demo_id
    assert last["correct"] is False
    assert [mistake["subtask"] for mistake in last["mistakes"]] == ["turn_off_oven"]
    spans = [(s["subtask"], s["start"], s["stop"]) for s in last["segments"]]
    assert spans == [(s.subtask, s.start, s.stop) for s in toy_pool.episodes[2].spans()]


def test_json_of_a_damaged_pool_has_its_problems(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    (root / "meta/info.json").write_text("{")
    assert main([str(root), "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["problems"] == [
        f"The file '{root}/meta/info.json' is damaged: it is no readable JSON."
    ]
    assert "demonstrations" not in told


def test_a_source_of_another_format_is_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "groundTruth").mkdir()
    (tmp_path / "mapping.txt").write_text("0 cut\n1 mix\n")
    (tmp_path / "groundTruth" / "salad.txt").write_text("cut\ncut\nmix\n")
    assert main([str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == [
        "#",
        "demo_id",
        "frames",
        "sequence",
        "correct",
        "participant",
        "sub-tasks",
    ]
    assert lines[1].split() == ["0", "salad", "3", "-", "-", "-", "0", "1"]
    assert "Format:         MS-TCN folder" in lines
    assert "Sub-tasks:      0=cut, 1=mix" in lines
    assert main([str(tmp_path), "--fps", "2"]) == 0
    assert capsys.readouterr().out.splitlines()[1].split()[2] == "1.5"


def test_leakage_is_shown_as_text_and_as_json(
    toy_pool: Pool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(toy_pool.root), "--leakage"]) == 0
    text = capsys.readouterr().out
    assert main([str(toy_pool.root), "--leakage", "--json"]) == 0
    clues = json.loads(capsys.readouterr().out)["leakage"]
    assert clues
    for name, value in clues.items():
        assert f"  {name:20}{value:.2f}" in text


def test_what_is_not_known_is_a_hyphen(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stripped = strip_ground_truth(copy_pool(toy_pool, tmp_path / "copy"))
    assert main([str(stripped.root)]) == 0
    cells = capsys.readouterr().out.splitlines()[1].split()
    assert cells[3:7] == ["-", "-", "p1", "0"]


def test_damage_is_told_and_exits_1(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    video = root / "videos/observation.images.cup/chunk-000/file-001.mp4"
    video.write_bytes(video.read_bytes()[:500])
    assert main([str(root)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert f"The file '{video}' is damaged: its check sum is not the one of the manifest." in lines
    assert lines[-1] == "Integrity:      damaged, 2 problems"


def test_damaged_metadata_exit_1(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    (root / "meta/info.json").write_text("{")
    assert main([str(root)]) == 1
    assert capsys.readouterr().out.splitlines() == [
        f"The file '{root}/meta/info.json' is damaged: it is no readable JSON.",
        "Integrity:      damaged, 1 problem",
    ]


def test_no_pool_at_all_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(PoolError, match=r"^The folder '.*' is empty; a source is one of: "):
        main([str(tmp_path)])


def test_the_verb_imports_neither_simulator_nor_torch(toy_pool: Pool) -> None:
    code = (
        "import sys; from teasim.cli.inspect import main; light = set(sys.modules);"
        f"code = main([{str(toy_pool.root)!r}]);"
        "assert not {'pyarrow', 'cv2', 'av'} & light;"
        "assert not {'mujoco', 'gymnasium', 'torch', 'sklearn'} & set(sys.modules); sys.exit(code)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def test_a_repair_is_told_and_inspected_as_sound(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    video = root / "videos/observation.images.cup/chunk-000/file-001.mp4"
    video.unlink()
    assert main([str(root), "--repair", str(tmp_path / "sound")]) == 0
    assert capsys.readouterr().out.splitlines()[-2:] == [
        f"2 sound demonstrations are in {tmp_path}/sound, numbered from 0.",
        f"1 damaged ones were set aside in {tmp_path}/sound/damaged.",
    ]
    assert main([str(tmp_path / "sound")]) == 0


def test_only_the_native_format_is_repaired(tmp_path: Path) -> None:
    (tmp_path / "groundTruth").mkdir()
    (tmp_path / "mapping.txt").write_text("0 cut\n")
    (tmp_path / "groundTruth/a.txt").write_text("cut\n")
    with pytest.raises(ConfigError, match=r"MS-TCN folder; --repair works on a LeRobot data set"):
        main([str(tmp_path), "--repair", str(tmp_path / "sound")])


WITHOUT_MILK = [name for name in SEQ_1 if name != "add_milk"]
SEQUENCES = """\
Sequences:      3 different in 6 demonstrations
   3 x  turn_on_oven, add_tea_bag, add_sugar, add_milk, turn_off_oven,
        add_water, stir
   2 x  without add_milk (demonstrations 3, 4)
   1 x  add_sugar before add_tea_bag (demonstrations 5)
One order: 5 of 6 demonstrations keep it, one does not.
Perhaps optional: 2 of 6 leave out add_milk. Only you know whether that is legal
or a mistake: --optional add_milk or --critical add_milk.
"""


@pytest.fixture
def varied(tmp_path: Path) -> Pool:
    swapped = [SEQ_1[0], SEQ_1[2], SEQ_1[1], *SEQ_1[3:]]
    demos = [SEQ_1, SEQ_1, SEQ_1, WITHOUT_MILK, WITHOUT_MILK, swapped]
    return make_toy_pool(tmp_path / "varied", demos, size=16, frames_per_subtask=2)


def test_sequences_are_counted_and_optional_steps_named(
    varied: Pool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(varied.root), "--sequences"]) == 0
    assert capsys.readouterr().out.endswith(SEQUENCES)
    assert main([str(varied.root), "--sequences", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["sequences"][1] == {"steps": WITHOUT_MILK, "demonstrations": [3, 4]}
    assert " ".join(told["words"]) == " ".join(SEQUENCES.split("\n", 5)[5].split())


def test_sequences_of_found_segments_are_those_of_the_table(
    varied: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from teasim.pool.segments_table import segment_rows, write_segments_table

    spans = [episode.spans() for episode in varied.episodes]
    (tmp_path / "findings").mkdir()
    write_segments_table(tmp_path / "findings" / "segments.csv", segment_rows(varied, spans))
    bare = strip_labels(copy_pool(varied, tmp_path / "bare")).root
    with pytest.raises(ConfigError) as caught:
        main([str(bare), "--sequences"])
    assert str(caught.value) == (
        f"'{bare}' has no logged sub-tasks; run 'teasim filter {bare} -o findings' and add "
        "'--segments findings'."
    )
    for table in (tmp_path / "findings", tmp_path / "findings" / "segments.csv"):
        assert main([str(bare), "--sequences", "--segments", str(table)]) == 0
        assert capsys.readouterr().out.endswith(SEQUENCES)


def test_sequences_without_steps_are_refused_with_the_next_command(
    varied: Pool, tmp_path: Path
) -> None:
    from teasim.pool.segments_table import segment_rows, write_segments_table

    with pytest.raises(ConfigError, match=r"^--segments is for --sequences; add '--sequences'\.$"):
        main([str(varied.root), "--segments", "x"])
    some = [episode.spans() if episode.index else () for episode in varied.episodes]
    write_segments_table(tmp_path / "some.csv", segment_rows(varied, some))
    with pytest.raises(ConfigError) as caught:
        main([str(varied.root), "--sequences", "--segments", str(tmp_path / "some.csv")])
    assert str(caught.value) == (
        f"The table of segments '{tmp_path / 'some.csv'}' does not know 'video 0'; run 'teasim "
        f"filter {varied.root} -o findings' and add '--segments findings'."
    )
