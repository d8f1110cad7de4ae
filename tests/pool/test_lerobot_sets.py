"""LeRobot data sets of every version open whole, whatever other tools have done to them."""

import json
import pickle
import shutil
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from teasim.common.errors import PoolError
from teasim.pool import Pool
from teasim.pool.integrity import check_pool
from teasim.pool.readers.registry import open_source
from tests.pool.lerobot_sets import (
    DATA,
    EPISODES,
    KEY,
    NAMES,
    Recipe,
    level,
    make_set,
    rewrite_info,
    rewrite_log,
    spans,
)

RECIPES = {
    "v3.0": Recipe(),
    "v3.0, a file each": Recipe(shared=False),
    "v3.0, images": Recipe(kind="image"),
    "v2.1": Recipe("v2.1"),
    "v2.1, images": Recipe("v2.1", kind="image"),
    "v2.0": Recipe("v2.0"),
}


@pytest.fixture(scope="module")
def sets(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("sets")
    return {name: make_set(folder / name, recipe) for name, recipe in RECIPES.items()}


@pytest.fixture
def copy(sets: dict[str, Path], tmp_path: Path) -> Path:
    return Path(shutil.copytree(sets["v3.0"], tmp_path / "copy"))


def assert_whole(root: Path, lengths: tuple[int, ...] = (6, 8, 5)) -> Pool:
    """Every frame is the one that was written."""
    pool = Pool.open(root)
    assert check_pool(root) == []
    assert [episode.length for episode in pool.episodes] == list(lengths)
    for episode in pool.episodes:
        frames = np.arange(episode.length)
        seen = episode.clip(pool.cameras[0]).frames(frames).mean((1, 2, 3))
        np.testing.assert_allclose(seen, [level(episode.index, f) for f in frames], atol=3)
        np.testing.assert_array_equal(episode.column("frame_index"), frames)
        np.testing.assert_array_equal(episode.column("action")[:, 1], -frames)
    return pool


@pytest.mark.parametrize("name", RECIPES)
def test_every_version_opens_whole(sets: dict[str, Path], name: str) -> None:
    pool = assert_whole(sets[name])
    assert pool.cameras == ("top",)
    assert [episode.task for episode in pool.episodes] == ["stack", "stack", "sort"]
    assert (pool.notes, pool.subtasks, pool.state_names) == ((), (), ("x", "y"))
    assert all(episode.spans() == () and episode.record is None for episode in pool.episodes)


def test_versions_tell_the_same_demonstrations(sets: dict[str, Path]) -> None:
    def ids(name: str) -> list[str]:
        return [episode.demo_id for episode in Pool.open(sets[name]).episodes]

    assert ids("v2.1") == ids("v2.0") == ids("v3.0, a file each")
    assert ids("v2.1, images") == ids("v3.0, images")
    assert len(set(ids("v3.0"))) == 3


@pytest.mark.parametrize("name", ["v3.0", "v3.0, images"])
def test_rows_are_found_by_number_not_by_position(
    sets: dict[str, Path], tmp_path: Path, name: str
) -> None:
    root = Path(shutil.copytree(sets[name], tmp_path / "copy"))
    order = np.random.default_rng(1).permutation(19)
    rewrite_log(root, lambda table: table.take(pa.array(order)))
    rewrite_log(root, lambda table: table.take(pa.array([2, 0, 1])), EPISODES)
    before = Pool.open(sets[name])
    for one, other in zip(before.episodes, assert_whole(root).episodes, strict=True):
        assert one.demo_id == other.demo_id


def test_several_episodes_files_are_one_table(copy: Path) -> None:
    table = pq.read_table(copy / EPISODES)
    pq.write_table(table.slice(1), copy / "meta/episodes/chunk-000/file-001.parquet")
    first = table.slice(0, 1)
    place = first.column_names.index("data/file_index")
    pq.write_table(first.set_column(place, "data/file_index", pa.array([0.0])), copy / EPISODES)
    assert_whole(copy)


def test_scalars_may_be_lists_of_one(copy: Path) -> None:
    def nested(table: pa.Table) -> pa.Table:
        for name in ("timestamp", "episode_index", "frame_index", "index", "task_index"):
            values = pa.array([[value] for value in table[name].to_pylist()])
            table = table.set_column(table.column_names.index(name), name, values)
        return table

    rewrite_log(copy, nested)
    rewrite_log(copy, lambda table: table.drop_columns(["tasks"]), EPISODES)
    assert [episode.task for episode in assert_whole(copy).episodes] == ["stack", "stack", "sort"]


@pytest.mark.parametrize("labels", ["numbers", "sparse", "dense", "sentences"])
def test_labels_of_every_form_give_the_same_spans(tmp_path: Path, labels: str) -> None:
    pool = Pool.open(make_set(tmp_path / "set", Recipe(labels=labels)))
    assert pool.subtasks == NAMES
    for episode in pool.episodes:
        found = [(span.subtask, span.start, span.stop) for span in episode.spans()]
        assert found == spans(episode.length)
    assert pool.problems() == []


def test_numbers_without_a_list_become_names(tmp_path: Path) -> None:
    root = make_set(tmp_path / "set", Recipe(labels="numbers"))
    (root / "meta/subtasks.parquet").unlink()
    pool = open_source(root)
    assert pool.subtasks == ("subtask 0", "subtask 1", "subtask 2")
    assert [span.subtask for span in pool.episodes[1].spans()] == list(pool.subtasks)
    assert pool.problems() == []


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ("observation.image", "image"),
        ("observation.images.front.rgb", "front.rgb"),
        ("observation/images/front", "observation/images/front"),
        ("front", "front"),
    ],
)
def test_keys_of_every_form_name_a_camera(tmp_path: Path, key: str, name: str) -> None:
    assert assert_whole(make_set(tmp_path / "set", Recipe(keys=(key,)))).cameras == (name,)


def test_cameras_that_would_be_called_alike_are_called_by_their_keys(tmp_path: Path) -> None:
    keys = ("observation.top", "observation.images.top")
    assert Pool.open(make_set(tmp_path / "set", Recipe(keys=keys))).cameras == keys


def test_a_depth_camera_is_left_out_and_named(tmp_path: Path) -> None:
    keys = ("observation.images.depth", KEY)
    root = make_set(tmp_path / "set", Recipe(keys=keys))
    features = json.loads((root / "meta/info.json").read_text())["features"]
    features[keys[0]]["info"] = {"video.is_depth_map": True}
    rewrite_info(root, features=features)
    pool = assert_whole(root)
    assert pool.cameras == ("top",)
    assert pool.notes == ("The depth camera 'observation.images.depth' is left out.",)


def test_a_feature_that_was_removed_is_no_damage(copy: Path) -> None:
    ids = [episode.demo_id for episode in Pool.open(copy).episodes]
    features = json.loads((copy / "meta/info.json").read_text())["features"]
    del features["observation.state"]
    rewrite_info(copy, features=features)
    rewrite_log(copy, lambda table: table.drop_columns(["observation.state"]))
    pool = assert_whole(copy)
    assert pool.state_names is None
    assert [episode.demo_id for episode in pool.episodes] == ids


def test_a_missing_number_harms_only_who_needs_it(copy: Path) -> None:
    def punched(table: pa.Table) -> pa.Table:
        values = table["observation.state"].to_pylist()
        values[3] = None
        place = table.column_names.index("observation.state")
        return table.set_column(place, "observation.state", pa.array(values))

    rewrite_log(copy, punched)
    pool = assert_whole(copy)
    assert pool.notes == (
        "'observation.state' has values that are missing, not finite or of another size in 1 "
        "demonstrations, the first is demonstration 0; it cannot be learned from.",
    )
    with pytest.raises(PoolError, match=r"^The column 'observation\.state' has 1 missing values"):
        pool.episodes[0].column("observation.state")


def test_totals_that_disagree_are_a_note(copy: Path) -> None:
    rewrite_info(copy, total_episodes=9, total_frames=1)
    assert assert_whole(copy).notes == (
        "'meta/info.json' says total_episodes is 9 but the episodes table has 3.",
        "'meta/info.json' says total_frames is 1 but the episodes table has 19.",
    )


def test_gaps_between_the_numbers_are_a_note(copy: Path) -> None:
    rewrite_log(copy, lambda table: table.take(pa.array([0, 2])), EPISODES)
    pool = assert_whole(copy, (6, 5))
    assert "not numbered 0 to 1 without a gap" in pool.notes[-1]


def test_frames_are_read_by_time(copy: Path) -> None:
    begin = f"videos/{KEY}/from_timestamp"

    def later(table: pa.Table) -> pa.Table:
        values = [time + (0.037 if time else 0) for time in table[begin].to_pylist()]
        return table.set_column(table.column_names.index(begin), begin, pa.array(values))

    rewrite_log(copy, later, EPISODES)
    (note,) = assert_whole(copy).notes
    assert note.startswith("2 demonstrations, the first is demonstration 1, begin between two")


def test_a_clock_that_starts_late_shifts_no_frame(copy: Path) -> None:
    def late(table: pa.Table) -> pa.Table:
        values = pa.array(np.asarray(table["timestamp"]) + np.float32(0.5))
        return table.set_column(table.column_names.index("timestamp"), "timestamp", values)

    rewrite_log(copy, late)
    (note,) = assert_whole(copy).notes
    assert note.startswith("The timestamps of 3 demonstrations are not the frame numbers divided")


def test_ten_thousand_demonstrations_open_at_once(copy: Path) -> None:
    n = 10_000
    row = {k: v[0] for k, v in pq.read_table(copy / EPISODES).slice(0, 1).to_pydict().items()}
    columns = {name: [value] * n for name, value in row.items()}
    columns |= {"episode_index": list(range(n))}
    pq.write_table(pa.table(columns), copy / EPISODES)
    began = time.perf_counter()
    pool = Pool.open(copy)
    lengths = {episode.length for episode in pool.episodes}
    assert time.perf_counter() - began < 1.0
    assert lengths == {6}
    assert len(pickle.dumps(pool.episodes[5])) < 20_000


def test_a_demonstration_travels_to_another_process(tmp_path: Path) -> None:
    recipe = Recipe(labels="numbers")
    episode = Pool.open(make_set(tmp_path / "set", recipe)).episodes[1]
    copied = pickle.loads(pickle.dumps(episode))
    assert (copied.index, copied.demo_id) == (1, episode.demo_id)
    assert copied.spans() == episode.spans()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"data_path": "../{file_index}.parquet"}, "The path '../0.parquet' of the metadata leads"),
        ({"data_path": "/etc/passwd"}, "The path '/etc/passwd' of the metadata leads out of"),
        ({"video_path": "videos/../../x.mp4"}, "of the metadata leads out of '"),
        ({"data_path": "{file_index:99999999d}"}, "of info.json is not readable."),
        ({"data_path": "{file_index.real}"}, "of info.json is not readable."),
        ({"video_path": 3}, "is damaged: 'video_path' is no text."),
        ({"chunks_size": 0}, "is damaged: chunks_size is 0."),
        ({"codebase_version": None}, "has LeRobot format None; v2.0, v2.1 and v3.0 can be read"),
    ],
)
def test_metadata_cannot_lead_elsewhere(
    copy: Path, changes: dict[str, object], message: str
) -> None:
    rewrite_info(copy, **changes)
    with pytest.raises(PoolError) as caught:
        Pool.open(copy)
    assert message in str(caught.value)
    assert check_pool(copy) == [str(caught.value)]


def test_a_link_out_of_the_data_set_is_refused(copy: Path, tmp_path: Path) -> None:
    video = copy / f"videos/{KEY}/chunk-000/file-000.mp4"
    shutil.move(video, tmp_path / "elsewhere.mp4")
    video.symlink_to(tmp_path / "elsewhere.mp4")
    with pytest.raises(PoolError, match=r"is a link that leads out of the data set\.$"):
        Pool.open(copy)


def test_a_relative_path_is_that_of_the_folder_one_is_in(
    copy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("here", "there"):
        shutil.copytree(copy, tmp_path / name / "pool")
        monkeypatch.chdir(tmp_path / name)
        assert len(Pool.open("pool").episodes) == len(Pool.open(copy).episodes)


def test_a_link_to_another_disk_is_followed(copy: Path, tmp_path: Path) -> None:
    shutil.move(copy / "videos", tmp_path / "disk")
    (copy / "videos").symlink_to(tmp_path / "disk")
    assert_whole(copy)


@pytest.mark.parametrize(
    ("column", "value", "message"),
    [
        ("length", 0, "has no frame: 'length' is 0."),
        ("length", 2**50, "is damaged: 'length' is 1125899906842624."),
        ("episode_index", 1, "is damaged: it has demonstration 1 twice."),
        ("data/file_index", -1, "is damaged: 'data/file_index' is -1."),
    ],
)
def test_an_episodes_table_that_cannot_be_true_is_told(
    copy: Path, column: str, value: int, message: str
) -> None:
    def change(table: pa.Table) -> pa.Table:
        values = [value, *table[column].to_pylist()[1:]]
        return table.set_column(table.column_names.index(column), column, pa.array(values))

    rewrite_log(copy, change, EPISODES)
    with pytest.raises(PoolError) as caught:
        Pool.open(copy)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("{", "episodes.jsonl' is damaged: line 4 is no readable JSON."),
        ("[]", "episodes.jsonl' is damaged: line 4 is not a JSON object."),
        ("[" * 100_000, "episodes.jsonl' is damaged: line 4 is no readable JSON."),
        ('{"episode_index": 3}', "episodes.jsonl' is damaged: 'length' is None in line 4."),
        ('{"episode_index": 3, "length": 1.5}', "'length' is 1.5 in line 4."),
        ('{"episode_index": 0, "length": 2}', "is damaged: it has demonstration 0 twice."),
    ],
)
def test_a_damaged_line_is_told(
    sets: dict[str, Path], tmp_path: Path, line: str, message: str
) -> None:
    root = Path(shutil.copytree(sets["v2.1"], tmp_path / "copy"))
    with (root / "meta/episodes.jsonl").open("a") as stream:
        stream.write(line + "\n")
    with pytest.raises(PoolError) as caught:
        Pool.open(root)
    assert message in str(caught.value)


def test_a_task_of_two_parts_is_told_whole(tmp_path: Path) -> None:
    root = make_set(tmp_path / "set", replace(Recipe(), lengths=(4,), tasks=("stack",)))

    def two(table: pa.Table) -> pa.Table:
        return table.set_column(
            table.column_names.index("tasks"), "tasks", pa.array([["stack", "sort", "stack"]])
        )

    rewrite_log(root, two, EPISODES)
    assert Pool.open(root).episodes[0].task == "stack; sort"


def test_a_log_with_a_row_too_many_is_damaged(copy: Path) -> None:
    rewrite_log(copy, lambda table: pa.concat_tables([table, table.slice(0, 1)]))
    assert check_pool(copy) == [
        f"The log '{copy / DATA}' has 7 rows of demonstration 0, which has 6 frames."
    ]
