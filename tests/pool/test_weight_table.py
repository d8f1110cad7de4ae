import contextlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from teasim.common.errors import PoolError
from teasim.pool.weight_table import COLUMNS, WeightRow, read_weight_table, write_weight_table

ROW = WeightRow("ab12", 0, 0.25, 1.5, True, 1, "Stirring is missing, at 12.0 s.", 0.75)
TEXT = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\r\n\0"), max_size=30)
ROWS = st.builds(
    WeightRow,
    demo_id=st.text("0123456789abcdef", min_size=1, max_size=16),
    episode_index=st.integers(0, 10**6),
    weight=st.floats(0, 1),
    loss=st.floats(allow_nan=False, allow_infinity=False),
    flagged=st.booleans(),
    group=st.integers(0, 5),
    reason=TEXT,
    p_incorrect=st.none() | st.floats(0, 1),
    task=TEXT,
)


@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(ROWS, max_size=6, unique_by=lambda row: row.episode_index))
def test_what_is_written_is_read(tmp_path: Path, rows: list[WeightRow]) -> None:
    path = tmp_path / "weights.csv"
    write_weight_table(path, rows)
    assert read_weight_table(path) == tuple(sorted(rows, key=lambda row: row.episode_index))


def test_the_columns_are_the_contract(tmp_path: Path) -> None:
    path = tmp_path / "weights.csv"
    write_weight_table(path, [ROW])
    header, line = path.read_text().splitlines()
    assert header == "demo_id,episode_index,weight,loss,flagged,group,reason,p_incorrect,task"
    assert line == 'ab12,0,0.25,1.5,1,1,"Stirring is missing, at 12.0 s.",0.75,'


def test_tables_without_probabilities_or_tasks_are_read(tmp_path: Path) -> None:
    path = tmp_path / "weights.csv"
    usual = "demo_id,episode_index,weight,loss,flagged,group,reason"
    path.write_text(f"{usual}\nab12,0,0.25,1.5,1,1,x\n")
    assert read_weight_table(path) == (replace(ROW, reason="x", p_incorrect=None),)
    path.write_text(f"{usual},p_incorrect\nab12,0,0.25,1.5,1,1,x,0.75\n")
    assert read_weight_table(path) == (replace(ROW, reason="x"),)


def test_numpy_values_are_written_as_numbers(tmp_path: Path) -> None:
    path = tmp_path / "weights.csv"
    values: Any = (np.int64(0), np.float32(0.25), np.float64(1.5), np.True_, np.int64(1))
    index, weight, loss, flagged, group = values
    numpy_row = WeightRow("ab12", index, weight, loss, flagged, group, "x", np.float64(0.75))
    write_weight_table(path, [numpy_row])
    assert read_weight_table(path) == (replace(ROW, reason="x"),)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"weight": 1.5}, "has the weight 1.5; it must lie in [0, 1]."),
        ({"weight": float("nan")}, "has the weight nan; it must lie in [0, 1]."),
        ({"p_incorrect": -0.1}, "has the probability -0.1; it must lie in [0, 1]."),
        ({"loss": float("inf")}, "has the loss inf; it must be finite."),
        ({"reason": "one\ntwo"}, "has a reason or a task of more than one line."),
        ({"group": -1}, "has the group -1; groups count from 0."),
        ({"demo_id": ""}, "has no demo_id."),
    ],
)
def test_values_out_of_range_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(PoolError) as caught:
        replace(ROW, **changes)  # type: ignore[arg-type]
    assert str(caught.value) == f"Demonstration 0 of the weight table {message}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no weight table; its columns must be demo_id, episode_index, weight, loss"),
        ("a,b\n1,2\n", "is no weight table; its columns must be"),
        (f"{','.join(COLUMNS)}\nx,0,0.5\n", "has 3 values; a weight table has 9."),
        (f"{','.join(COLUMNS)}\nx,0,half,1,0,0,r,,\n", "holds text in place of a number."),
        (f"{','.join(COLUMNS)}\nx,0,0.5,1,yes,0,r,,\n", "says flagged is 'yes'; choose 0 or 1."),
        (f"{','.join(COLUMNS)}\nx,0,2,1,0,0,r,,\n", "has the weight 2.0; it must lie in [0, 1]."),
        (f"{','.join(COLUMNS)}\nx,0,1,1,0,0,r,,\ny,0,1,1,0,0,r,,\n", "has demonstration 0 twice."),
    ],
)
def test_a_table_that_is_none_is_told(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "weights.csv"
    path.write_text(text)
    with pytest.raises(PoolError) as caught:
        read_weight_table(path)
    assert message in str(caught.value)


def test_a_missing_table_is_told(tmp_path: Path) -> None:
    with pytest.raises(PoolError, match=r"^There is no weight table at '.*none\.csv'\.$"):
        read_weight_table(tmp_path / "none.csv")


@settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.binary(max_size=200))
def test_no_file_content_gives_another_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "weights.csv"
    path.write_bytes(",".join(COLUMNS).encode() + b"\n" + content)
    with contextlib.suppress(PoolError):
        read_weight_table(path)


def test_a_demonstration_with_two_rows_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(PoolError, match=r"has demonstration 0 twice\.$"):
        write_weight_table(tmp_path / "weights.csv", [ROW, ROW])
    assert not list(tmp_path.iterdir())
