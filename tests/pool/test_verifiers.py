"""Tools of other people, which know LeRobot v3.0, find nothing wrong with our pools."""

import subprocess

import pyarrow.parquet as pq
import pytest

from teasim.pool import Pool
from tests.pool.conftest import BIN


@pytest.mark.parametrize("command", [("robovet", "doctor"), ("lerobot-doctor", "check")])
def test_foreign_verifiers_pass(toy_pool: Pool, command: tuple[str, str]) -> None:
    done = subprocess.run(
        [BIN / command[0], command[1], toy_pool.root], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout
    assert "FAIL" not in done.stdout


def test_tasks_and_subtasks_are_pandas_frames_with_the_name_as_index(toy_pool: Pool) -> None:
    for what in ("task", "subtask"):
        frame = pq.read_table(toy_pool.root / f"meta/{what}s.parquet").to_pandas()
        assert frame.index.name == what
        assert list(frame.columns) == [f"{what}_index"]
    assert frame.iloc[-1].name == "none"
    assert frame.iloc[5].name == "stir"


def test_logs_have_the_types_lerobot_declares(toy_pool: Pool) -> None:
    schema = pq.read_schema(toy_pool.episodes[0].data_path)
    types = {name: str(schema.field(name).type) for name in schema.names}
    assert types["observation.state"] == "fixed_size_list<element: float>[16]"
    assert types["timestamp"] == types["next.reward"] == "float"
    assert types["next.success"] == "bool"
    assert {types[name] for name in ("frame_index", "index", "subtask_index")} == {"int64"}
    features = toy_pool.info["features"]
    assert set(types) == {name for name in features if features[name]["dtype"] != "video"}


def test_the_episodes_table_adds_up(toy_pool: Pool) -> None:
    stop = 0
    for episode in toy_pool.episodes:
        assert episode.row["dataset_from_index"] == stop
        stop = episode.row["dataset_to_index"]
        key = "videos/observation.images.cup"
        window = episode.row[f"{key}/to_timestamp"] - episode.row[f"{key}/from_timestamp"]
        assert round(window * toy_pool.fps) == episode.length
    assert stop == toy_pool.info["total_frames"]
