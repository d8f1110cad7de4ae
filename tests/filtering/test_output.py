import json
import re
from pathlib import Path

import pytest

from filtering.demo_filter import DemoFilter
from filtering.output import FILES, write_filter_output
from filtering.report import DemoView, Mark, ReportSection, Segment, render_report
from filtering.report.layout import TALLEST, place_dots, place_marks, strip_of
from teasim.common.errors import ConfigError
from teasim.common.figures.colours import colours_of, contrast, ink_on
from teasim.pool import Pool, Span
from teasim.pool.segments_table import read_segments_table
from teasim.pool.weight_table import read_weight_table


@pytest.fixture(scope="module")
def written(
    toy_filter: DemoFilter, toy_pool: Pool, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    out = tmp_path_factory.mktemp("out") / "filtered"
    section = ReportSection("Scores <1>", "<table><tr><td>98 %</td></tr></table>")
    write_filter_output(out, toy_pool, toy_filter, sections=[section])
    return out


def test_all_files_are_there_and_nothing_else(written: Path) -> None:
    assert sorted(path.name for path in written.iterdir()) == sorted(FILES)


def test_weight_table_reads_back(written: Path, toy_filter: DemoFilter) -> None:
    assert read_weight_table(written / "weights.csv") == toy_filter.table()


def test_run_record_holds_what_repeats_the_run(
    written: Path, toy_filter: DemoFilter, toy_pool: Pool
) -> None:
    record = json.loads((written / "filter.json").read_text())
    assert record["pool_hash"] == toy_pool.content_hash()
    assert record["config"]["solver"] == "annealed"
    assert record["trusted"] == pytest.approx(toy_filter.trust_.sum())
    assert record["objective"] is None
    assert record["threshold"] == toy_filter.threshold_
    assert list(record["trust"].values()) == toy_filter.trust_.tolist()
    assert set(record["seconds"]) == {"segments", "features", "weights"}


def test_lists_hold_indexes_and_ready_lines(written: Path) -> None:
    keep = (written / "keep.txt").read_text()
    exclude = (written / "exclude.txt").read_text()
    assert _indexes(keep) == [0, 1, 3, 4, 6]
    assert _indexes(exclude) == [2, 5]
    assert '--dataset.episodes="[0,1,3,4,6]"' in keep
    assert '--operation.episode_indices "[2,5]"' in exclude
    assert "demo_0 demo_1 demo_3" in keep


def _indexes(text: str) -> list[int]:
    return [int(line) for line in text.splitlines() if not line.startswith("#")]


def test_page_is_self_contained_and_sorted(written: Path) -> None:
    page = (written / "report.html").read_text()
    assert not re.search(r'(?:src|href)="(?!data:|#)', page)
    films = json.loads(page.split('id="films">')[1].split("</script>")[0])
    assert {name for name in films if name.endswith("/left")} == {f"{n}/left" for n in range(7)}
    assert {"2/cup", "5/cup"} <= set(films)
    assert all(film.startswith("data:video/mp4;base64,") for film in films.values())
    shown = [int(number) for number in re.findall(r'id="demo-(\d+)"', page)]
    assert set(shown[:2]) == {2, 5}
    assert len(shown) == 7
    assert "2 of 7 videos are flagged as incorrect." in page
    assert "turn off oven is missing" in page
    assert "<h2>Scores &lt;1&gt;</h2>" in page
    assert "<td>98 %</td>" in page


def test_an_output_in_use_is_refused(
    written: Path, toy_filter: DemoFilter, toy_pool: Pool, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=r"holds an earlier filter's output; .* --overwrite"):
        write_filter_output(written, toy_pool, toy_filter)
    write_filter_output(written, toy_pool, toy_filter, overwrite=True)
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(ConfigError, match=r"holds other files \('thesis.tex'\)"):
        write_filter_output(tmp_path, toy_pool, toy_filter, overwrite=True)
    with pytest.raises(ConfigError, match="is a file; choose a folder"):
        write_filter_output(tmp_path / "thesis.tex", toy_pool, toy_filter)
    with pytest.raises(ConfigError, match="lies in the pool"):
        write_filter_output(toy_pool.root / "filtered", toy_pool, toy_filter)
    assert (tmp_path / "thesis.tex").read_text() == "precious"


def test_page_escapes_what_it_is_told(tmp_path: Path) -> None:
    demo = DemoView(
        episode_index=0,
        demo_id="<script>",
        weight=0.5,
        loss=1.0,
        flagged=True,
        group="steps left out",
        reason="<b>bold</b>",
        seconds=2.0,
        segments=(Segment("a<b", 0.0, 2.0),),
        marks=(Mark(1.0, "<i>"),),
    )
    path = tmp_path / "report.html"
    render_report(path, demos=[demo], threshold=0.0, summary="1 < 2")
    page = path.read_text()
    assert "<b>bold" not in page
    assert "&lt;b&gt;bold" in page
    assert "1 &lt; 2" in page
    assert "there is no threshold and none is flagged" in page


def test_dots_never_cover_each_other() -> None:
    dots = place_dots([1.0, 1.0, 1.0, 0.99, 0.2])
    assert [dot.level for dot in dots] == [0, 1, 2, 3, 0]


def test_many_dots_stand_in_columns_without_gaps() -> None:
    strip = strip_of([0.9 + 0.0003 * number for number in range(300)])
    assert strip.bars
    columns = {dot.x: sorted(d.level for d in strip.dots if d.x == dot.x) for dot in strip.dots}
    assert all(levels == list(range(len(levels))) for levels in columns.values())
    assert strip.height <= TALLEST + 1e-9
    assert not strip_of([0.5] * 8).bars


def test_every_colour_has_a_text_colour_that_can_be_read() -> None:
    names = [str(number) for number in range(200)]
    assert all(contrast(ink_on(c), c) >= 4.5 for c in colours_of(names).values())
    assert contrast("#ffffff", "#000000") == pytest.approx(21)


def test_marks_that_are_close_stand_on_different_lines() -> None:
    placed = place_marks([Mark(1.0, "a"), Mark(1.5, "b"), Mark(9.9, "c")], 10.0)
    assert [item.mark.text for item in placed] == ["c", "b", "a"]
    assert [item.level for item in placed] == [0, 0, 1]
    assert [item.turned for item in placed] == [True, False, False]


def test_segments_read_back(written: Path, toy_filter: DemoFilter) -> None:
    rows = read_segments_table(written / "segments.csv")
    own: dict[int, list[Span]] = {}
    for row in rows:
        own.setdefault(row.episode_index, []).append(row.span)
    assert [tuple(own[index]) for index in sorted(own)] == list(toy_filter.segments_.spans)
