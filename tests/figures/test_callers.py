"""What the verbs draw: from a fitted filter, a segmenter and an ablation."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.report.figures import precedence, save_filter_figures, timelines
from filtering.segmentation.figures import (
    NOTHING,
    confusion,
    folder_figures,
    segmenter_figures,
)
from teasim.common.figures import ConfusionFigure
from teasim.pool import Pool, Span
from teasim.pool.mstcn.folder import MSTCNFolder, write_predictions
from tests.filtering.conftest import TOY_SEQUENCES
from tests.toy_pool import SEQ_1, copy_pool, make_toy_pool, strip_ground_truth

TRUE = (Span("a", 0, 4), Span("b", 6, 10))
FOUND = (Span("a", 0, 5), Span("b", 5, 10))


@pytest.fixture(scope="module")
def toy_pool(tmp_path_factory: pytest.TempPathFactory) -> Pool:
    return make_toy_pool(
        tmp_path_factory.mktemp("pools") / "toy", TOY_SEQUENCES, size=32, frames_per_subtask=6
    )


@pytest.fixture(scope="module")
def toy_filter(toy_pool: Pool) -> DemoFilter:
    return DemoFilter(FilterConfig(segmenter="logged", effects=False)).fit(toy_pool)


def test_the_figures_of_a_filter(toy_filter: DemoFilter, toy_pool: Pool, tmp_path: Path) -> None:
    save_filter_figures(tmp_path, toy_pool, toy_filter)
    names = {path.stem for path in tmp_path.iterdir()}
    assert names == {"weights", "timelines", "precedence", "reliability"}
    order = precedence(toy_filter)
    edges = {(order.names[a], order.names[b]) for a, b in order.edges()}
    assert edges == set(pairwise(SEQ_1))
    drawn = timelines(toy_pool, toy_filter)
    assert len(drawn.names) == len(toy_pool.episodes)
    assert drawn.found[0][0].stop == toy_filter.segments_.spans[0][0].stop / 10
    assert not any(drawn.true)  # the segments are the labels


def test_without_labels_nothing_is_said_about_reliability(
    toy_filter: DemoFilter, toy_pool: Pool, tmp_path: Path
) -> None:
    blind = strip_ground_truth(copy_pool(toy_pool, tmp_path / "copy"))
    save_filter_figures(tmp_path / "figures", blind, toy_filter)
    names = {path.stem for path in (tmp_path / "figures").iterdir()}
    assert names == {"weights", "timelines", "precedence"}


def test_confusion_counts_every_frame_once() -> None:
    assert confusion([TRUE], [FOUND]) == ConfusionFigure(
        ("a", "b", NOTHING), ((4, 0, 0), (0, 4, 0), (1, 1, 0))
    )
    assert confusion([FOUND], [FOUND]).names == ("a", "b")
    assert segmenter_figures(["v"], [()], [FOUND], 10.0) == {}


def test_a_folder_of_predictions_gives_the_same_figures(tmp_path: Path) -> None:
    labels = {"v": np.array([0] * 4 + [-1] * 2 + [1] * 4)}
    found = {"v": np.array([0] * 5 + [1] * 5), "w": np.array([0, 1])}
    write_predictions(tmp_path, ("a", "b"), found, labels, {})
    drawn = folder_figures(MSTCNFolder.open(tmp_path))
    assert drawn == segmenter_figures(["v"], [TRUE], [FOUND], None)
    write_predictions(tmp_path / "blind", ("a", "b"), found, {}, {})
    assert folder_figures(MSTCNFolder.open(tmp_path / "blind")) == {}
