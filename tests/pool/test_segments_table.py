"""The table of segments: back as it was written, and damage in one sentence."""

from pathlib import Path

import pytest

from teasim.common.errors import PoolError
from teasim.pool.segments_table import SegmentRow, read_segments_table, write_segments_table

HEAD = "demo_id,episode_index,subtask,start,stop\n"


def test_rows_come_back(tmp_path: Path) -> None:
    rows = (SegmentRow("x", 0, 'pour, "hot"', 0, 3), SegmentRow("x", 0, "stir", 3, 9))
    write_segments_table(tmp_path / "segments.csv", rows)
    assert (tmp_path / "segments.csv").read_text().startswith(HEAD)
    assert read_segments_table(tmp_path / "segments.csv") == rows


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("demo_id\n", "'{path}' is no table of segments; its columns must be demo_id, episode_"),
        (HEAD + "x,0,a,0\n", "Line 2 of '{path}' has 4 values; a table of segments has 5."),
        (HEAD + "x,0,a,0,b\n", "Line 2 of '{path}' holds text in place of a number."),
        (HEAD + "x,0,a,3,3\n", "A segment of demonstration 0 is 'a', frames 3 to 3; that is no se"),
        (HEAD + "x,0,a,0,3\nx,0,b,2,4\n", "Segments of demonstration 0 in '{path}' overlap at "),
    ],
)
def test_damage_is_one_sentence(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "segments.csv"
    path.write_text(text)
    with pytest.raises(PoolError) as caught:
        read_segments_table(path)
    assert str(caught.value).startswith(said.format(path=path))


def test_a_missing_table(tmp_path: Path) -> None:
    with pytest.raises(PoolError, match="There is no table of segments at"):
        read_segments_table(tmp_path / "segments.csv")
