"""A data set of several tasks is judged task by task."""

import numpy as np
import pytest

from filtering import DemoFilter, FilterConfig
from filtering.by_task import fit_by_task, tasks_of
from teasim.pool.mstcn.folder import write_predictions
from teasim.pool.readers.registry import open_source
from teasim.pool.views.part import Part

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
    write_predictions(tmp_path, ("boil", "pour", "stir"), videos, {}, {})
    return open_source(tmp_path)


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
