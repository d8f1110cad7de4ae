import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teasim.common.errors import PoolError
from teasim.pool import (
    EpisodeRecord,
    EpisodeWriter,
    MistakeSpan,
    Pool,
    Span,
    finalize_pool,
)
from teasim.pool.integrity import check_pool
from teasim.pool.types import spans_from_index
from tests.toy_pool import (
    SEQ_1,
    copy_pool,
    make_toy_pool,
    rewrite_table,
    strip_ground_truth,
    toy_header,
)

EPISODES = "meta/episodes/chunk-000/file-000.parquet"
WHOLE = st.integers(0, 2**31)
NAMES = toy_header().subtasks


@st.composite
def demonstrations(draw: st.DrawFn) -> tuple[EpisodeRecord, np.ndarray, np.ndarray]:
    """A record, its subtask_index (n,) and a state log (n, 16) of any finite numbers."""
    column = np.array(draw(st.lists(st.integers(-1, 6), min_size=1, max_size=9)))
    n = len(column)
    mistakes = tuple(
        MistakeSpan(draw(st.sampled_from(["skip", "repeat"])), draw(st.sampled_from(NAMES)), a, b)
        for a, b in [sorted(draw(st.tuples(st.integers(0, n), st.integers(0, n))))]
    )
    record = EpisodeRecord(
        sequence=draw(st.sampled_from(["seq_1", "seq_2", "seq_3"])),
        correct=draw(st.booleans()),
        mistakes=draw(st.sampled_from([mistakes, ()])),
        spans=spans_from_index(column, NAMES),
        participant=draw(st.text("pé1", max_size=3)),
        embodiment="yumi",
        seed=draw(WHOLE),
        task=draw(st.sampled_from(["make tea", "make a cup of tea"])),
    )
    numbers = np.random.default_rng(draw(WHOLE)).normal(size=(n, 16)) * draw(st.floats(0, 1e30))
    return record, column, numbers.astype(np.float32)


@settings(max_examples=8, deadline=None)
@given(st.lists(demonstrations(), min_size=1, max_size=2))
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory,
    written: list[tuple[EpisodeRecord, np.ndarray, np.ndarray]],
) -> None:
    root = tmp_path_factory.mktemp("pool")
    header = toy_header(size=16, cameras=("left",))
    for index, (record, column, state) in enumerate(written):
        with EpisodeWriter(root, index, header) as writer:
            for frame in range(len(column)):
                writer.add_frame(
                    images={"left": np.full((16, 16, 3), 20 * frame, np.uint8)},
                    state=state[frame],
                    action=-state[frame],
                    environment_state=np.full(7, frame),
                    subtask_index=column[frame],
                    reward=frame / 2,
                    success=bool(frame % 2),
                )
            writer.finish(record)
    pool = finalize_pool(root, header, len(written))
    for episode, (record, column, state) in zip(pool.episodes, written, strict=True):
        n = len(column)
        assert (episode.length, episode.task) == (n, record.task)
        assert episode.spans() == record.spans
        truth = episode.record
        assert truth is not None
        assert vars(truth) == {name: getattr(record, name) for name in vars(truth)}
        np.testing.assert_array_equal(episode.column("observation.state"), state)
        np.testing.assert_array_equal(episode.column("action"), -state)
        np.testing.assert_array_equal(episode.column("subtask_index"), column)
        np.testing.assert_array_equal(episode.column("next.reward"), np.arange(n) / 2)
        np.testing.assert_array_equal(episode.column("next.success"), np.arange(n) % 2 == 1)
        np.testing.assert_array_equal(episode.column("next.done"), np.arange(n) == n - 1)
        levels = episode.clip("left").frames(range(n)).mean((1, 2, 3))
        np.testing.assert_allclose(levels, 20 * np.arange(n), atol=4)
        assert episode.content_id() == episode.demo_id
    assert check_pool(root) == []


def test_the_pool_names_what_it_holds(toy_pool: Pool) -> None:
    header = toy_header()
    assert toy_pool.cameras == header.cameras
    assert toy_pool.subtasks == header.subtasks
    assert toy_pool.state_names == header.state_names
    assert toy_pool.fps == header.fps
    assert [episode.index for episode in toy_pool.episodes] == [0, 1, 2]


def test_spans_agree_with_the_frames(toy_pool: Pool) -> None:
    for episode in toy_pool.episodes:
        column = episode.column("subtask_index")
        assert episode.spans() == spans_from_index(column, toy_pool.subtasks)


def test_two_spans_of_one_subtask_in_a_row_stay_two(tmp_path: Path) -> None:
    pool = make_toy_pool(tmp_path / "p", [("stir", "stir")], size=16, frames_per_subtask=2)
    assert pool.episodes[0].spans() == (Span("stir", 0, 2), Span("stir", 2, 4))


def test_a_foreign_data_set_opens_without_ground_truth(foreign_pool: Pool) -> None:
    assert foreign_pool.cameras == ("cam_top", "cam_wrist")
    assert foreign_pool.subtasks == ()
    assert foreign_pool.state_names is not None
    total = 0
    for episode in foreign_pool.episodes:
        assert episode.record is None
        assert episode.spans() == ()
        assert episode.task
        assert episode.column("action").shape == (episode.length, 6)
        np.testing.assert_array_equal(episode.column("frame_index"), np.arange(episode.length))
        assert (episode.column("episode_index") == episode.index).all()
        assert episode.clip("cam_top").frames([0, episode.length - 1]).shape[0] == 2
        total += episode.length
    assert total == foreign_pool.info["total_frames"]
    assert len({episode.demo_id for episode in foreign_pool.episodes}) == len(foreign_pool.episodes)


def test_people_have_no_joint_log_at_all(tmp_path: Path) -> None:
    pool = make_toy_pool(
        tmp_path / "p", [("stir",)], size=16, frames_per_subtask=3, embodiment="person"
    )
    assert pool.state_names is None
    assert not {"observation.state", "action"} & set(pool.info["features"])
    assert pool.episodes[0].embodiment == "person"
    with pytest.raises(PoolError, match=r"has no column 'observation\.state'; it has subtask_"):
        pool.episodes[0].column("observation.state")
    assert check_pool(pool.root) == []


def test_without_ground_truth_a_filter_sees_the_same(toy_pool: Pool, tmp_path: Path) -> None:
    stripped = strip_ground_truth(copy_pool(toy_pool, tmp_path / "stripped"))
    assert stripped.content_hash() == toy_pool.content_hash()
    for before, after in zip(toy_pool.episodes, stripped.episodes, strict=True):
        assert after.record is None
        assert (after.demo_id, after.spans()) == (before.demo_id, before.spans())
        assert (after.participant, after.embodiment) == (before.participant, before.embodiment)
    assert check_pool(stripped.root) == []


def test_a_changed_pixel_or_label_changes_the_hash(toy_pool: Pool, tmp_path: Path) -> None:
    copy = Pool.open(copy_pool(toy_pool, tmp_path / "copy"))
    assert copy.content_hash() == toy_pool.content_hash()
    first, second = (copy.episodes[i].clip("left").path for i in (0, 1))
    shutil.copy(first, second)
    assert copy.content_hash() != toy_pool.content_hash()


def test_dropped_columns_come_back_from_the_manifest(toy_pool: Pool, tmp_path: Path) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")

    def drop(table: pa.Table) -> pa.Table:
        return table.select([name for name in table.column_names if "teasim/" not in name])

    rewrite_table(root / EPISODES, drop)
    for before, after in zip(toy_pool.episodes, Pool.open(root).episodes, strict=True):
        assert after.row.get("teasim/demo_id") is None
        assert after.record == before.record
        assert after.demo_id == before.demo_id


def test_identity_survives_renumbering(tmp_path: Path) -> None:
    options = {"size": 16, "frames_per_subtask": 3, "cameras": ("left",)}
    one = make_toy_pool(tmp_path / "one", [SEQ_1], **options)  # type: ignore[arg-type]
    header = toy_header([SEQ_1], size=16, cameras=("left",))
    source = one.episodes[0]
    frames = source.clip("left").frames(range(source.length))
    for index in (0, 1):
        with EpisodeWriter(tmp_path / "two", index, header) as writer:
            for frame in range(source.length):
                writer.add_frame(
                    images={"left": frames[frame]},
                    state=source.column("observation.state")[frame],
                    action=source.column("action")[frame],
                    environment_state=source.column("observation.environment_state")[frame],
                )
            writer.finish(EpisodeRecord("seq_1", bool(index), (), (), f"p{index}", "yumi", index))
    ids = {episode.demo_id for episode in finalize_pool(tmp_path / "two", header, 2).episodes}
    assert len(ids) == 1


def test_unknown_names_are_answered_with_the_choices(toy_pool: Pool) -> None:
    episode = toy_pool.episodes[0]
    with pytest.raises(PoolError) as caught:
        episode.clip("right")
    assert str(caught.value) == "The pool has no camera 'right'; it has left, cup."
    with pytest.raises(PoolError, match=r"has no column 'force'; it has observation\.state, act"):
        episode.column("force")


@pytest.mark.parametrize(
    ("prepare", "message"),
    [
        (Path.absolute, "There is no pool at '{root}': the folder does not exist."),
        (
            lambda root: root.write_text("x"),
            "There is no pool at '{root}': it is a file, and a pool is a folder; `teasim "
            "convert` writes one from other formats.",
        ),
        (lambda root: root.mkdir(), "There is no pool at '{root}': the folder is empty."),
        (
            lambda root: (root / "a" / "b").mkdir(parents=True),
            "There is no pool at '{root}': a LeRobot data set has the file meta/info.json; "
            "`teasim convert` writes one from other formats.",
        ),
        (
            lambda root: (root / ".incomplete" / "episode-000003").mkdir(parents=True),
            "The pool '{root}' is unfinished, with 1 complete demonstrations; generate it again "
            "with the same settings to finish it.",
        ),
    ],
)
def test_a_path_without_a_pool_is_told(
    tmp_path: Path, prepare: Callable[[Path], object], message: str
) -> None:
    root = tmp_path / "pool"
    prepare(root)
    for read in (Pool.open, check_pool):
        with pytest.raises(PoolError) as caught:
            read(root)
        assert str(caught.value) == message.format(root=root)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"codebase_version": "v1.6"}, "has LeRobot format v1.6; v2.0, v2.1 and v3.0 can be read"),
        ({"codebase_version": "v2.1"}, "meta/episodes.jsonl' is missing."),
        ({"fps": 0}, "is damaged: fps is 0, not a positive number."),
        ({"fps": "10"}, "is damaged: fps is 10, not a positive number."),
        ({"features": []}, "is damaged: 'features' is not readable."),
        ({"data_path": None}, "is damaged: it has no 'data_path'."),
        ({"data_path": "{nothing}"}, "The path '{nothing}' of info.json is not readable."),
    ],
)
def test_metadata_the_reader_cannot_use_are_told(
    toy_pool: Pool, tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    (root / "meta/info.json").write_text(json.dumps(dict(toy_pool.info) | changes))
    with pytest.raises(PoolError) as caught:
        Pool.open(root)
    assert message in str(caught.value)
    assert check_pool(root) == [str(caught.value)]


def test_a_pool_without_demonstrations_is_empty(toy_pool: Pool, tmp_path: Path) -> None:
    root = copy_pool(toy_pool, tmp_path / "copy")
    rewrite_table(root / EPISODES, lambda table: table.slice(0, 0))
    with pytest.raises(PoolError, match=r"^The pool '.*' is empty: it has no demonstration\.$"):
        Pool.open(root)
