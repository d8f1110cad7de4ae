"""A data set of several tasks is judged task by task."""

import json

import numpy as np
import pytest

from filtering import DemoFilter, FilterConfig
from filtering.by_task import fit_by_task, of_task
from filtering.judging.explain import Counterpart, Finding
from filtering.moments.suitable import UnsuitableError
from filtering.output import LEARNED, write_filter_output
from filtering.segmentation.segments import Segmentation
from teasim.common.errors import ConfigError
from teasim.pool import Span
from teasim.pool.mstcn.folder import write_predictions
from teasim.pool.readers.registry import open_source
from teasim.pool.selection import tasks_of
from teasim.pool.views.part import Part
from teasim.pool.weight_table import read_weight_table

USUAL, SHORT = np.repeat([0, 1, 2], 5), np.repeat([0, 2], 5)
CONFIG = FilterConfig(segmenter="predictions")


class Told:
    """A demonstration with a task of its own."""

    def __init__(self, demo, task):
        self._demo, self.task = demo, task

    def __getattr__(self, name):
        return getattr(self._demo, name)


@pytest.fixture
def pool(tmp_path):
    videos = {f"video_{n}": USUAL for n in range(12)} | {"video_12": SHORT, "video_13": SHORT}
    write_predictions(tmp_path / "pool", ("boil", "pour", "stir"), videos, {}, {})
    return open_source(tmp_path / "pool")


def told(pool, tasks):
    return Part(pool, [Told(e, t) for e, t in zip(pool.episodes, tasks, strict=True)])


def test_each_task_gets_what_it_gets_alone(pool):
    tasks = ["tea" if n % 2 else "coffee" for n in range(14)]
    both = told(pool, tasks)
    fitted = fit_by_task(CONFIG, both)
    for task, rows in tasks_of(both).items():
        alone = DemoFilter(CONFIG).fit(Part(both, [both.episodes[n] for n in rows]))
        assert np.array_equal(fitted.weights_[rows], alone.weights_), task
        assert np.array_equal(fitted.flagged_[rows], alone.flagged_)
        assert [fitted.reasons_[n] for n in rows] == list(alone.reasons_)
        assert [fitted.segments_.spans[n] for n in rows] == list(alone.segments_.spans)
    assert fitted.flagged_.sum() == 2
    assert {fitted.group_names_[g] for g in fitted.groups_} == {"kept", "steps left out"}


def test_a_task_of_few_demonstrations_is_kept_with_a_note(pool):
    fitted = fit_by_task(CONFIG, told(pool, ["tea"] * 12 + ["other"] * 2))
    assert fitted.weights_[12:].tolist() == [1.0, 1.0]
    assert fitted.words_[-1] == (
        "Too few demonstrations to judge, so that all are kept: 2 of the task 'other'."
    )


def test_descriptions_in_words_of_their_own_are_no_tasks(pool):
    fitted = fit_by_task(CONFIG, told(pool, map(str, range(14))))
    assert fitted.flagged_.sum() == 2


def test_one_task_is_judged_as_it_is(pool):
    one = told(pool, ["tea"] * 14)
    assert np.array_equal(fit_by_task(CONFIG, one).weights_, DemoFilter(CONFIG).fit(one).weights_)


def test_the_output_tells_tasks_apart(pool, tmp_path):
    both = told(pool, ["tea", "coffee"] * 6 + ["tea", "a\nrare one"])
    write_filter_output(tmp_path / "out", both, fit_by_task(CONFIG, both))
    rows = read_weight_table(tmp_path / "out" / "weights.csv")
    assert [row.task for row in rows] == ["tea", "coffee"] * 6 + ["tea", "a rare one"]
    assert [row.weight for row in rows if row.task == "a rare one"] == [1.0]
    assert rows[13].reason.startswith("Too few demonstrations to judge, so that all are kept: 1 of")
    whole = json.loads((tmp_path / "out" / "filter.json").read_text())
    assert whole["probability_is"] == LEARNED
    record = whole["tasks"]
    assert [(one["judged"], len(one["demonstrations"]), one["flagged"]) for one in record] == [
        *((True, 7, 1), (True, 6, 1), (False, 1, 0)),
    ]
    page = (tmp_path / "out" / "report.html").read_text()
    assert '<option value="1">coffee</option>' in page
    places = [int(part.split('"')[0]) for part in page.split('data-place="')[1:]]
    assert places == sorted(places) == [0] * 7 + [1] * 6 + [2]


def test_one_task_is_judged_alone(pool):
    both = told(pool, ["tea"] * 6 + ["coffee"] * 8)
    alone = of_task(both, "coffee")
    assert len(alone.episodes) == 8
    message = r"has no task 'cof'; choose from 'tea', 'coffee'\.$"
    with pytest.raises(ConfigError, match=message):
        of_task(both, "cof")
    with pytest.raises(ConfigError, match=r"has no task 'tea'; it names none\.$"):
        of_task(told(pool, [""] * 14), "tea")
    with pytest.raises(ConfigError, match=r"'t9' and 4 more\.$"):
        of_task(told(pool, [f"t{n}" for n in range(14)]), "tea")


class Seeing(DemoFilter):
    """A filter that finds each demonstration at odds with the next one of its task."""

    def fit(self, pool, *, workers):
        """Refuse the task 'dark'."""
        if pool.episodes[0].task == "dark":
            raise UnsuitableError("Nothing happens in the pictures.")
        super().fit(pool, workers=workers)
        self.chosen_ = FilterConfig(segmenter="clustering", score="norm")
        count, span = len(pool.episodes), Span("step 1", 0, 5)
        self.segments_ = Segmentation(("step 1",), ((span,),) * count)
        self.findings_ = tuple(
            (Finding("step 1", None, None, 0, True, 1.0, None, None, None, "", there),)
            for there in (Counterpart((n + 1) % count, span, "top") for n in range(count))
        )
        return self


def test_what_is_found_refers_to_the_demonstrations_of_the_whole_pool(pool, monkeypatch):
    monkeypatch.setattr("filtering.by_task.DemoFilter", Seeing)
    fitted = fit_by_task(CONFIG, told(pool, ["tea", "coffee"] * 7))
    for demo, (finding,) in enumerate(fitted.findings_):
        assert finding.counterpart.demo == (demo + 2) % 14
        task = ("tea", "coffee")[demo % 2]
        assert finding.expected == fitted.segments_.spans[demo][0].subtask == f"{task}: step 1"


def test_a_task_that_shows_nothing_is_kept_and_all_of_them_are_refused(pool, monkeypatch):
    monkeypatch.setattr("filtering.by_task.DemoFilter", Seeing)
    fitted = fit_by_task(CONFIG, told(pool, ["tea"] * 8 + ["dark"] * 6))
    assert fitted.weights_[8:].tolist() == [1.0] * 6
    assert set(fitted.reasons_[8:]) == {
        "The task 'dark' is not judged, so that all of it is kept: Nothing happens in the pictures."
    }
    with pytest.raises(UnsuitableError, match=r"^Nothing happens"):
        fit_by_task(CONFIG, told(pool, ["dark"] * 12 + ["rare"] * 2))
