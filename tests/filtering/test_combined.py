"""The score `combined`: whom the norm may accuse, and by which sub-tasks."""

from pathlib import Path

import numpy as np
import pytest

import filtering.demo_filter
from filtering import DemoFilter, FilterConfig
from filtering.judging.combined import MAJORITY, SUSPECT, unless_alone
from filtering.judging.judgement import Judgement
from filtering.judging.thresholds import Grouping
from filtering.segmentation.segmenter import segmenter_named
from filtering.segmentation.segments import Segmentation
from teasim.pool import Span
from tests.toy_pool import SEQ_1, SEQ_2, make_toy_pool

NAMES = ("kept", "out of order", "steps left out")
WRONG = "a network for other videos"
"""Name of a segmenter whose sub-tasks are not the same in all videos."""


def by_norm(groups):
    """A verdict of the norm by the groups of the demonstrations."""
    groups = np.array(groups)
    weights = np.where(groups > 0, 0.1, 0.9)
    grouping = Grouping(groups, 0.5, NAMES)
    return Judgement(-np.log(weights), weights, grouping, weights, ((),) * len(groups))


def test_a_verdict_of_the_norm_alone_is_not_heard():
    heard = unless_alone(by_norm([0, 1, 2]), np.zeros(3), np.ones(3))
    assert heard.grouping.groups.tolist() == [0, 0, 0]
    assert heard.weights.tolist() == [1.0, 1.0, 1.0]
    assert heard.losses.tolist() == [0.0, 0.0, 0.0]


def test_moments_that_find_it_unusual_are_a_witness():
    strengths = np.array([SUSPECT, SUSPECT, SUSPECT - 0.01])
    heard = unless_alone(by_norm([1, 2, 2]), strengths, np.ones(3))
    assert heard.grouping.groups.tolist() == [1, 2, 0]
    assert heard.weights.tolist() == [0.1, 0.1, 1.0]


def test_the_order_of_a_minority_is_a_witness_of_a_wrong_order_alone():
    kept = np.array([MAJORITY - 0.01, MAJORITY, MAJORITY - 0.01])
    heard = unless_alone(by_norm([1, 1, 2]), np.zeros(3), kept)
    assert heard.grouping.groups.tolist() == [1, 0, 0]


def halved(pool, *, workers):
    """Cut each video at another place."""
    del workers
    spans = [
        (Span("first", 0, cut), Span("second", cut, demo.length))
        for cut, demo in zip(range(20, 180, 20), pool.episodes, strict=True)
    ]
    return Segmentation(("first", "second"), tuple(spans))


@pytest.mark.parametrize("wrong", [WRONG, "logged"])
def test_sub_tasks_that_are_not_the_same_in_all_videos_are_found_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wrong: str
) -> None:
    pool = make_toy_pool(
        tmp_path / "pool", [SEQ_1] * 5 + [SEQ_2] * 3, frames_per_subtask=30, cameras=("left",)
    )

    def named(name, *how):
        return halved if name == WRONG else segmenter_named(name, *how)

    monkeypatch.setattr(filtering.demo_filter, "segmenter_named", named)
    monkeypatch.setattr(FilterConfig, "_check_names", lambda _: None)
    fitted = DemoFilter(FilterConfig(score="combined", segmenter=wrong)).fit(pool)
    told = any(f"'{WRONG}' finds are not the same" in word for word in fitted.words_)
    assert told == (wrong == WRONG)
    assert fitted.chosen_.segmenter == ("clustering" if told else "logged")
    assert len(fitted.segments_.subtasks) > len(("first", "second"))
    assert fitted.flagged_.tolist() == [False] * 5 + [True] * 3
