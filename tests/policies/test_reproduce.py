"""`teasim reproduce`: laws over every table and figure, on stand-ins for the slow work."""

import csv
import json

import pytest

from filtering.config import FilterConfig
from policies.cli import reproduce
from policies.experiments.reproduce import plan as plans
from policies.experiments.reproduce import run
from policies.experiments.reproduce.exhibits.exhibit import MOST_OPEN, as_html, as_markdown
from policies.experiments.reproduce.exhibits.policies import config_of
from policies.experiments.reproduce.methods import NORM, OURS
from policies.experiments.reproduce.paper import DETECTION, precision_sentence
from policies.experiments.reproduce.plan import PEOPLE_LEVEL, SEGMENTERS, SIZES, UNLABELLED
from policies.experiments.reproduce.registry import EXHIBITS
from policies.experiments.reproduce.works import WORKS
from policies.experiments.tabular import csv_text
from policies.experiments.units import Store, do_units, missing
from teasim.common.errors import ConfigError
from teasim.common.figures.drawing import rendered
from teasim.common.workers import IN_PROCESS
from tests.policies.reproduction import FAKES, TINY, tiny_plan

PLAN = tiny_plan()


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """All exhibits done by stand-ins."""
    store = Store(tmp_path_factory.mktemp("reproduced"), "teasim reproduce all -o OUT")
    units = [unit for exhibit in EXHIBITS.values() for unit in exhibit.units(PLAN)]
    do_units(units, store, FAKES, workers=IN_PROCESS)
    return store


@pytest.mark.parametrize("name", EXHIBITS)
def test_every_exhibit_says_what_it_and_the_paper_show(name):
    exhibit = EXHIBITS[name]
    assert exhibit.title
    assert exhibit.paper.endswith(".")


@pytest.mark.parametrize("name", EXHIBITS)
@pytest.mark.parametrize("size", SIZES)
def test_every_kind_of_work_is_known(name, size):
    plan = plans.Plan.sized(size)
    units = missing(EXHIBITS[name].units(plan), Store(plans.Path("nowhere")))
    assert units or name == "table4"
    assert {unit.kind for unit in units} <= set(WORKS)
    assert all(unit.seconds >= 0 for unit in units)
    json.dumps([unit.spec for unit in units])


@pytest.mark.parametrize("name", EXHIBITS)
def test_another_seed_makes_other_units(name):
    def keys(plan):
        units = missing(EXHIBITS[name].units(plan), Store(plans.Path("nowhere")))
        return {unit.key for unit in units}

    assert not keys(PLAN) & keys(tiny_plan(seed=1))


@pytest.mark.parametrize("name", EXHIBITS)
def test_every_exhibit_has_rows_sentences_and_files(store, name):
    exhibit = EXHIBITS[name]
    table = exhibit.table(PLAN, store)
    text = as_markdown(name, exhibit, table, store.command)
    page = as_html(name, exhibit, table, store.command)
    assert f"    {store.command}\n" in text
    assert store.command in page
    if table.not_run:
        assert f"Not run: {table.not_run}" in text
        assert not table.rows
        return
    assert table.words
    assert all(list(row) == table.columns for row in table.rows)
    rows = list(csv.DictReader(csv_text(table.rows).splitlines()))
    assert len(rows) == len(table.rows)
    assert text.count("\n| ") == len(rows) + 2
    assert page.count("<tr>") == len(rows) + 1
    assert (f"<summary>All {len(rows)} rows</summary>" in page) == (len(rows) > MOST_OPEN)


@pytest.mark.parametrize("name", ["table2", "table3"])
def test_true_segments_are_judged_rightly_and_baselines_stand_beside(store, name):
    rows = EXHIBITS[name].table(PLAN, store).rows
    pools = {row["pool"] for row in rows}
    assert pools == {f"10 + {printed.k}" for printed in DETECTION[name]}
    assert {"length", "random", "oracle", "equation 3"} <= {row["method"] for row in rows}
    oracle = [row for row in rows if row["method"] == "oracle"]
    assert all(row["FP"] == row["FN"] == 0 and row["F1"] == 100 for row in oracle)
    ours = [row for row in rows if row["method"] in (NORM, OURS)]
    assert all(row["FP"] == row["FN"] == 0 for row in ours)
    alone = {row["segmenter"] for row in ours if row["method"] == OURS}
    assert alone == {SEGMENTERS[UNLABELLED], SEGMENTERS[PEOPLE_LEVEL]}


@pytest.mark.parametrize("name", sorted(set(EXHIBITS) - {"table1", "table4"}))
def test_the_default_filter_and_its_figures_are_in_every_exhibit(store, name):
    exhibit = EXHIBITS[name]
    table = exhibit.table(PLAN, store)
    ours = "the filter found" if name == "figure6" else "default filter"
    ours = "from the videos alone" if name.startswith("table") else ours
    assert any(ours in sentence for sentence in table.words)
    drawn = exhibit.figures(PLAN, store)
    assert drawn
    assert all(rendered(drawing)["svg"] for drawing in drawn.values())


def test_policies_of_figure_6_see_pictures_and_a_pool_is_filtered_once(store):
    units = EXHIBITS["figure6"].units(PLAN)
    assert {unit.spec["observe"] for unit in units} == {"pixels_agent_pos", "state"}
    pictures, state = (config_of(unit, store) for unit in units)
    assert pictures.pools == state.pools
    ours, stored = (config.filters[1] for config in (pictures, state))
    assert (ours.table, ours.config) == ("", FilterConfig())
    assert stored.table.endswith("pool--filtered.csv")
    assert {f.like for f in pictures.filters if f.use in ("length", "random")} == {"filtered"}


@pytest.mark.parametrize("name", DETECTION)
def test_the_papers_numbers_fit_together(name):
    for row in DETECTION[name]:
        assert row.false_positives >= 1
        found = 100 * (10 + row.k - row.false_positives) / (10 + row.k)
        assert abs(found - row.accuracy) < 3  # the paper rounds, and not always to the nearest


def test_the_printed_precision_is_f1():
    said = precision_sentence()
    assert "equals F1 in 13 of 14 rows" in said
    assert "TP / (TP + FP) in 0;" in said


def test_a_dry_run_estimates_and_does_nothing(tmp_path, capsys):
    out = tmp_path / "out"
    assert reproduce(["table2", "--quick", "--dry-run", "-o", str(out), "--jobs", "2"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("0 of ")
    assert "x bank" in said
    assert "with --jobs 2 on idle cores" in said
    assert not out.exists()


def test_the_verb_writes_a_page_and_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(plans.__dict__, "SIZES", {"quick": TINY})
    monkeypatch.setattr(run, "WORKS", FAKES)
    out = tmp_path / "out"
    words = ["table2", "--quick", "-o", str(out), "--jobs", "1"]
    assert reproduce(words) == 0
    first = (out / "table2.csv").read_bytes()
    said = capsys.readouterr()
    assert f"page: {out / 'index.html'}" in said.out
    assert (out / "figures" / "table2.png").is_file()
    assert "<img src='figures/table2.svg'" in (out / "index.html").read_text()
    monkeypatch.setattr(run, "WORKS", {})  # nothing is left to do
    assert reproduce(words) == 0
    assert (out / "table2.csv").read_bytes() == first
    assert capsys.readouterr().err.startswith("16 of 16 units of work are done.")


def refused(*words):
    with pytest.raises(ConfigError) as error:
        reproduce([*words])
    return str(error.value)


def test_what_cannot_be_run_is_refused(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    choices = ", ".join([*EXHIBITS, "all"])
    assert refused("table9", "-o", str(tmp_path / "out")) == (
        f"Unknown table or figure 'table9'; choose {choices}."
    )
    assert refused("table2", "-o", str(tmp_path)) == (
        f"The output folder '{tmp_path}' is in use; choose a new or empty one."
    )
    assert refused("table2", "-o", str(tmp_path / "mine.txt")) == (
        f"The output folder '{tmp_path / 'mine.txt'}' is a file; choose a new or empty folder."
    )
    assert refused("all", "--seed", "-1", "-o", str(tmp_path / "out")) == (
        "The seed is -1; choose 0 or more."
    )
