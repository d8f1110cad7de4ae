import doctest
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import filtering.demo_filter
from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.judging.judges import JUDGES
from filtering.segmentation.segmenter import segmenter_named
from teasim.common.errors import ConfigError, PoolError
from teasim.common.workers import Workers
from teasim.pool import Pool
from tests.filtering.conftest import TOY_SEQUENCES
from tests.toy_pool import SEQ_1, make_toy_pool, strip_ground_truth, strip_labels

LOGGED = FilterConfig(segmenter="logged")
WRONG = [sequence != SEQ_1 for sequence in TOY_SEQUENCES]


def test_incorrect_demonstrations_are_flagged_with_the_right_reason(
    toy_filter: DemoFilter,
) -> None:
    assert toy_filter.flagged_.tolist() == WRONG
    assert "'add_water' was expected, 'stir' was seen" in toy_filter.reasons_[2]
    assert "After add_milk" in toy_filter.reasons_[5]
    assert "'turn_off_oven' is missing" in toy_filter.reasons_[5]
    assert [bool(reason) for reason in toy_filter.reasons_] == WRONG


@pytest.mark.parametrize("segmenter", ["logged", "clustering"])
def test_the_judge_knows_whether_segments_are_told(
    toy_pool: Pool, monkeypatch: pytest.MonkeyPatch, segmenter: str
) -> None:
    seen = []

    def judge(evidence, config):
        seen.append(evidence.told)
        return JUDGES["norm"](evidence, config)

    monkeypatch.setattr(filtering.demo_filter, "judge_named", lambda _: judge)
    found = DemoFilter(FilterConfig(score="norm", segmenter=segmenter)).fit(toy_pool)
    assert seen == [segmenter == "logged"]
    assert found.chosen_.decision == "learned"


def test_the_learned_decision_in_the_score_combined_is_taken_when_asked_for(
    toy_pool: Pool,
) -> None:
    asked = FilterConfig(score="combined", decision="learned").for_source(toy_pool)
    assert asked.decision == "learned"
    assert FilterConfig(score="combined").for_source(toy_pool).decision == "clusters"


def test_weights_and_trust_are_shares(toy_filter: DemoFilter) -> None:
    for shares in (toy_filter.weights_, toy_filter.trust_):
        assert ((shares >= 0) & (shares <= 1)).all()
    assert (toy_filter.groups_ == 0).tolist() == [not wrong for wrong in WRONG]


def test_fitting_again_changes_nothing(toy_filter: DemoFilter, toy_pool: Pool) -> None:
    again = DemoFilter(toy_filter.config).fit(toy_pool).fit(toy_pool, workers=Workers(2))
    assert again.table() == toy_filter.table()


def test_the_filter_never_reads_the_ground_truth(
    toy_filter: DemoFilter, toy_pool: Pool, tmp_path: Path
) -> None:
    stripped = strip_ground_truth(shutil.copytree(toy_pool.root, tmp_path / "stripped"))
    assert all(episode.record is None for episode in stripped.episodes)
    assert DemoFilter(LOGGED).fit(stripped).table() == toy_filter.table()


def test_no_label_changes_a_weight_of_the_default_filter(toy_pool: Pool, tmp_path: Path) -> None:
    stripped = strip_labels(shutil.copytree(toy_pool.root, tmp_path / "stripped"))
    assert stripped.subtasks == ()
    assert not any(episode.spans() for episode in stripped.episodes)
    for config in (FilterConfig(), FilterConfig(score="moments")):
        found = DemoFilter(config).fit(stripped)
        assert found.chosen_.segmenter in ("clustering", "agreement")
        assert found.table() == DemoFilter(config).fit(toy_pool).table()


def test_with_one_group_nothing_is_flagged(toy_pool: Pool) -> None:
    found = DemoFilter(FilterConfig(segmenter="logged", groups="1")).fit(toy_pool)
    assert not found.flagged_.any()
    assert found.threshold_ == 0.0


def test_a_pool_of_another_task_is_filtered(tmp_path: Path) -> None:
    full = ("cut", "fry", "serve")
    pool = make_toy_pool(
        tmp_path / "cook", [full] * 4 + [("cut", "serve")], frames_per_subtask=3, cameras=("main",)
    )
    found = DemoFilter(LOGGED).fit(pool)
    assert found.cameras_ == ("main",)
    assert found.flagged_.tolist() == [False] * 4 + [True]
    assert "'fry' is missing" in found.reasons_[-1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"segmenter": "luck"},
            "Unknown segmenter 'luck'; choose logged, clustering, predictions or the folder of one "
            "that `teasim segment fit` made.",
        ),
        ({"score": "luck"}, "Unknown score 'luck'; choose norm, equation3."),
        (
            {"solver": "magic"},
            "Unknown solver 'magic'; choose annealed, alternating, exact, published.",
        ),
        ({"groups": "7"}, "Unknown number of groups '7'; choose auto, 1, 2, 3."),
        (
            {"background": "flow"},
            "Unknown background subtraction 'flow'; choose none, median, mog2.",
        ),
        ({"frames_per_segment": 0}, "frames_per_segment is 0; choose 1 or more."),
        ({"trusted_share": 1.0}, "trusted_share is 1.0; choose a share between 0 and 1."),
        ({"ridge": 0.0}, "ridge is 0.0; choose a number above 0."),
    ],
)
def test_settings_out_of_range_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        replace(FilterConfig(), **change)  # type: ignore[arg-type]
    assert str(caught.value) == message


def test_unknown_camera_is_refused_with_the_choices(toy_pool: Pool) -> None:
    with pytest.raises(ConfigError) as caught:
        DemoFilter(FilterConfig(cameras=("roof",))).fit(toy_pool)
    assert str(caught.value) == "The pool has no camera 'roof'; choose from left, cup."


def test_the_example_of_the_filter_runs() -> None:
    assert doctest.testmod(filtering.demo_filter).failed == 0
    assert "DemoFilter(" in (DemoFilter.__doc__ or "")


def test_too_small_pools_are_refused(tmp_path: Path) -> None:
    pool = make_toy_pool(tmp_path / "two", [SEQ_1] * 2, frames_per_subtask=2)
    with pytest.raises(ConfigError, match=r"has 2 demonstrations; a filter needs 3 or more\.$"):
        DemoFilter(LOGGED).fit(pool)


class _Unlabelled:
    subtasks = ("a", "b")
    root = Path("somewhere")

    class _Episode:
        index = 4
        name = "video 4"
        length = 10

        def spans(self) -> tuple[()]:
            return ()

    episodes = (_Episode(),)


def test_logged_sub_tasks_must_be_there() -> None:
    with pytest.raises(PoolError) as caught:
        segmenter_named("logged")(_Unlabelled())  # type: ignore[arg-type]
    assert str(caught.value) == (
        "The demonstration 'video 4' of 'somewhere' has no sub-tasks that the segmenter 'logged' "
        "could read; choose another segmenter."
    )


def test_segment_labels_are_numbers_of_the_pools_subtasks(toy_pool: Pool) -> None:
    found = segmenter_named("logged")(toy_pool)
    for labels, sequence in zip(found.labels(), TOY_SEQUENCES, strict=True):
        assert [found.subtasks[label] for label in labels] == list(sequence)
    assert np.max([max(labels) for labels in found.labels()]) < len(found.subtasks)


@pytest.mark.parametrize("name", JUDGES)
def test_every_score_finds_the_same_in_an_easy_pool(name: str, toy_pool: Pool) -> None:
    found = DemoFilter(FilterConfig(segmenter="logged", score=name)).fit(toy_pool)
    assert found.flagged_.tolist() == WRONG
    assert (found.weights_ < found.threshold_).tolist() == WRONG
    assert found.losses_[~found.flagged_].max() < found.losses_[found.flagged_].min()


def test_equation_3_trusts_half_of_the_pool_and_says_its_value(toy_pool: Pool) -> None:
    found = DemoFilter(FilterConfig(segmenter="logged", score="equation3")).fit(toy_pool)
    assert found.trust_.sum() == pytest.approx(len(WRONG) / 2, abs=1e-6)
    assert found.objective_ is not None
    assert found.objective_ > 0
    assert [bool(reason) for reason in found.reasons_] == WRONG
    assert "'turn_off_oven' is missing" in found.reasons_[5]


@pytest.mark.parametrize("name", JUDGES)
def test_no_score_flags_anything_in_a_clean_pool(name: str, tmp_path: Path) -> None:
    pool = make_toy_pool(tmp_path / "clean", [SEQ_1] * 5, frames_per_subtask=3)
    found = DemoFilter(FilterConfig(segmenter="logged", score=name)).fit(pool)
    assert not found.flagged_.any()
    assert found.threshold_ == 0.0
    assert found.weights_ == pytest.approx(np.ones(5), abs=0.01)
