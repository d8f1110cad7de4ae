import hashlib
import json
import shutil
from pathlib import Path

import pytest

from teasim.common.errors import ConfigError, PoolError
from teasim.pool import Pool
from teasim.pool.integrity import check_pool
from teasim.pool.repair import repair_pool
from tests.pool.lerobot_sets import DATA, KEY, Recipe, make_set, rewrite_log
from tests.toy_pool import copy_pool

LENGTHS = (6, 8, 5)
RECIPES = {
    "v3.0": (Recipe(shared=False), f"videos/{KEY}/chunk-000/file-001.mp4"),
    "v2.1": (Recipe("v2.1"), f"videos/chunk-000/{KEY}/episode_000001.mp4"),
}


def hashes(root: Path) -> dict[str, str]:
    files = (path for path in sorted(root.rglob("*")) if path.is_file())
    return {str(p.relative_to(root)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


@pytest.mark.parametrize("name", RECIPES)
def test_the_copy_is_sound_and_the_source_untouched(tmp_path: Path, name: str) -> None:
    recipe, video = RECIPES[name]
    root = make_set(tmp_path / "set", recipe)
    ids = [episode.demo_id for episode in Pool.open(root).episodes]
    (root / video).write_bytes(b"nothing")
    before = hashes(root)
    done = repair_pool(root, tmp_path / "sound")
    assert hashes(root) == before
    assert done.kept == (0, 2)
    assert list(done.set_aside) == [1]
    assert check_pool(done.root) == []
    copy = Pool.open(done.root)
    assert copy.notes == ()
    assert [episode.index for episode in copy.episodes] == [0, 1]
    assert [episode.demo_id for episode in copy.episodes] == [ids[0], ids[2]]
    assert [episode.task for episode in copy.episodes] == ["stack", "sort"]
    assert (done.root / "damaged" / video).read_bytes() == b"nothing"
    told = json.loads((done.root / "damaged/reasons.json").read_text())
    assert told["episodes"] == [{"episode_index": 1, "problems": list(done.set_aside[1])}]


def test_rows_of_a_shared_log_are_set_aside_too(tmp_path: Path) -> None:
    root = make_set(tmp_path / "set")
    rewrite_log(root, lambda table: table.slice(0, 17))
    done = repair_pool(root, tmp_path / "sound")
    assert (done.kept, list(done.set_aside)) == ((0, 1), [2])
    aside = Pool.open(root).episodes[2].log_rows()
    assert len(aside) == 3
    assert (done.root / "damaged/rows/episode_000002.parquet").is_file()
    assert check_pool(done.root) == []


def test_our_own_pools_keep_what_is_known_about_them(toy_pool: Pool, tmp_path: Path) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    video = root / "videos/observation.images.cup/chunk-000/file-001.mp4"
    video.write_bytes(video.read_bytes()[:-1] + b"x")
    done = repair_pool(root, tmp_path / "sound")
    assert (done.kept, list(done.set_aside)) == ((0, 2), [1])
    copy = Pool.open(done.root)
    for episode, old in zip(copy.episodes, (0, 2), strict=True):
        before = toy_pool.episodes[old]
        assert (episode.demo_id, episode.record) == (before.demo_id, before.record)
        assert episode.spans() == before.spans()
    assert check_pool(done.root) == []


def test_a_sound_set_is_copied_whole(tmp_path: Path) -> None:
    root = make_set(tmp_path / "set")
    done = repair_pool(root, tmp_path / "sound")
    assert (done.kept, done.set_aside) == ((0, 1, 2), {})
    assert not (done.root / "damaged").exists()


def test_where_nothing_is_sound_nothing_is_written(tmp_path: Path) -> None:
    root = make_set(tmp_path / "set")
    (root / DATA).unlink()
    with pytest.raises(PoolError) as caught:
        repair_pool(root, tmp_path / "sound")
    assert str(caught.value) == (f"No demonstration of '{root}' is sound; nothing can be repaired.")
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def test_the_copy_needs_a_folder_of_its_own(tmp_path: Path) -> None:
    root = make_set(tmp_path / "set")
    with pytest.raises(ConfigError, match=r"is in use; choose a new or empty one\.$"):
        repair_pool(root, root)
    with pytest.raises(PoolError, match=r"lies in the pool itself; choose one outside it\.$"):
        repair_pool(root, root / "sound")
    shutil.rmtree(root)
    with pytest.raises(PoolError, match=r"^There is no pool at '.*': the folder does not exist"):
        repair_pool(root, tmp_path / "sound")
