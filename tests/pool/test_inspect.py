import subprocess
import sys
from pathlib import Path

import pytest

from teasim.cli.inspect import main
from teasim.common.errors import PoolError
from teasim.pool import Pool
from tests.toy_pool import copy_pool, strip_ground_truth


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
    assert "no       skip turn_off_oven  p3" in lines[3]
    facts = dict(line.split(":", 1) for line in lines[5:])
    assert facts["Cameras"].strip() == "left, cup"
    assert facts["Frames per second"].strip() == "10"
    assert facts["Content hash"].strip() == toy_pool.content_hash()
    assert facts["Integrity"].strip() == "sound"


def test_what_is_not_known_is_a_hyphen(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stripped = strip_ground_truth(copy_pool(toy_pool, tmp_path / "copy"))
    assert main([str(stripped.root)]) == 0
    cells = capsys.readouterr().out.splitlines()[1].split()
    assert cells[3:8] == ["-", "-", "-", "p1", "turn_on_oven"]


def test_damage_is_told_and_exits_1(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    video = root / "videos/observation.images.cup/chunk-000/file-001.mp4"
    video.write_bytes(video.read_bytes()[:500])
    assert main([str(root)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert f"The file '{video}' is damaged: its check sum is not the one of the manifest." in lines
    assert lines[-1] == "Integrity: damaged, 2 problems"


def test_damaged_metadata_exit_1(
    toy_pool: Pool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    (root / "meta/info.json").write_text("{")
    assert main([str(root)]) == 1
    assert capsys.readouterr().out.splitlines() == [
        f"The file '{root}/meta/info.json' is damaged: it is no readable JSON.",
        "Integrity: damaged, 1 problem",
    ]


def test_no_pool_at_all_is_bad_input(tmp_path: Path) -> None:
    with pytest.raises(PoolError, match=r"^There is no pool at '.*': the folder is empty\.$"):
        main([str(tmp_path)])


def test_the_verb_imports_neither_simulator_nor_torch(toy_pool: Pool) -> None:
    code = (
        "import sys; from teasim.cli.inspect import main; light = set(sys.modules);"
        f"code = main([{str(toy_pool.root)!r}]);"
        "assert not {'pyarrow', 'cv2', 'av'} & light;"
        "assert not {'mujoco', 'gymnasium', 'torch', 'sklearn'} & set(sys.modules); sys.exit(code)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
