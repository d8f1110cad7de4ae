"""Who a demonstration is survives what other tools do to a data set; its weights still fit."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from teasim.pool import Pool
from teasim.pool.lerobot.identity import demo_id, halves
from teasim.pool.weight_table import WeightRow, match_rows
from tests.pool.lerobot_sets import (
    DATA,
    EPISODES,
    KEY,
    Recipe,
    make_set,
    rewrite_info,
    rewrite_log,
)

VIDEO = f"videos/{KEY}/chunk-000/file-000.mp4"


@pytest.fixture(scope="module")
def original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_set(tmp_path_factory.mktemp("sets") / "set")


def features_of(root: Path) -> dict[str, object]:
    features: dict[str, object] = json.loads((root / "meta/info.json").read_text())["features"]
    return features


def without(name: str) -> Callable[[Path], None]:
    def remove(root: Path) -> None:
        features = features_of(root)
        del features[name]
        rewrite_info(root, features=features)
        if name != KEY:
            rewrite_log(root, lambda table: table.drop_columns([name]))

    return remove


def renumber(root: Path) -> None:
    """The first demonstration removed, the others numbered anew."""

    def changed(table: pa.Table) -> pa.Table:
        table = table.filter(pa.compute.greater(table["episode_index"], 0))
        for name, by in (("episode_index", 1), ("index", 6)):
            if name in table.column_names:
                values = pa.array(np.asarray(table[name]) - by)
                table = table.set_column(table.column_names.index(name), name, values)
        return table

    def moved(table: pa.Table) -> pa.Table:
        table = changed(table)
        for name in ("dataset_from_index", "dataset_to_index"):
            values = pa.array(np.asarray(table[name]) - 6)
            table = table.set_column(table.column_names.index(name), name, values)
        return table

    rewrite_log(root, changed)
    rewrite_log(root, moved, EPISODES)


def new_container(root: Path) -> None:
    """The packets copied to a container with other time stamps, as a merge does."""
    source = root / VIDEO
    target = source.with_name("new.mkv")
    with av.open(str(source)) as before, av.open(str(target), "w") as after:
        stream = after.add_stream_from_template(before.streams.video[0])
        for packet in before.demux(before.streams.video[0]):
            if packet.dts is not None:
                packet.stream = stream
                after.mux(packet)
    target.rename(source)


def encoded_anew(root: Path) -> None:
    """Other pictures from the same frames, as removing a demonstration from a shared file does."""
    source = root / VIDEO
    with av.open(str(source)) as box:
        frames = [frame.to_ndarray(format="rgb24") for frame in box.decode(video=0)]
    with av.open(str(source), "w") as box:
        stream = box.add_stream("libx264", 10, options={"crf": "35", "bf": "0"})
        stream.width = stream.height = frames[0].shape[0]
        for number, image in enumerate(frames):
            frame = av.VideoFrame.from_ndarray(np.roll(image, 1, axis=0), format="rgb24")
            frame.pts = number
            box.mux(stream.encode(frame))
        box.mux(stream.encode())


@pytest.mark.parametrize(
    ("change", "first"),
    [
        (Path.absolute, 0),
        (renumber, 1),
        (new_container, 0),
        (without("observation.state"), 0),
    ],
)
def test_identity_survives(
    original: Path, tmp_path: Path, change: Callable[[Path], None], first: int
) -> None:
    root = Path(shutil.copytree(original, tmp_path / "elsewhere"))
    change(root)
    before = [episode.demo_id for episode in Pool.open(original).episodes]
    assert [episode.demo_id for episode in Pool.open(root).episodes] == before[first:]


@pytest.mark.parametrize("change", [without("action"), without(KEY), encoded_anew, renumber])
def test_weights_still_fit(original: Path, tmp_path: Path, change: Callable[[Path], None]) -> None:
    table = [
        WeightRow(episode.demo_id, episode.index, episode.index / 4, 0.0, False, 0, "")
        for episode in Pool.open(original).episodes
    ]
    root = Path(shutil.copytree(original, tmp_path / "copy"))
    change(root)
    episodes = Pool.open(root).episodes
    rows = match_rows(table, [episode.demo_id for episode in episodes])
    assert [row and row.episode_index for row in rows] == [0, 1, 2][-len(episodes) :]


def test_a_half_that_several_share_tells_nobody() -> None:
    commands = {"action": np.zeros((3, 2))}
    ids = [demo_id({"top": seen}, commands) for seen in ("a", "b")]
    assert halves(ids[0])[0] == halves(ids[1])[0]
    rows = [WeightRow(name, number, 1.0, 0.0, False, 0, "") for number, name in enumerate(ids)]
    other = demo_id({"top": "c"}, commands)
    assert match_rows(rows, [ids[1], ids[0]]) == [rows[1], rows[0]]
    assert match_rows(rows, [other]) == [None]


def test_an_identity_of_an_older_kind_has_no_halves() -> None:
    assert halves("0123456789abcdef") == ()


def test_missing_numbers_and_wider_floats_change_no_identity() -> None:
    values = np.array([[0.1, np.nan], [0.2, 3.0]])
    narrow = demo_id({}, {"action": values.astype(np.float32)})
    assert narrow == demo_id({}, {"action": values})


def test_without_anything_logged_demonstrations_still_differ(tmp_path: Path) -> None:
    root = make_set(tmp_path / "set", Recipe(lengths=(4, 4, 4)))
    for name in ("action", "observation.state", KEY):
        without(name)(root)
    assert pq.read_table(root / DATA).num_rows == 12
    assert len({episode.demo_id for episode in Pool.open(root).episodes}) == 3
