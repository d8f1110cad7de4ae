"""A segmenter is fitted to a part of a pool, used on the rest, and handed to the filter."""

import json
from dataclasses import replace

import numpy as np
import pytest

from filtering.cli import main as filter_verb
from filtering.cli import segment
from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.segmentation.config import FitConfig, MSTCNConfig
from filtering.segmentation.fit import FitResult, fit_segmenter
from filtering.segmentation.mstcn.checkpoint import load_segmenter
from filtering.segmentation.predict import predict
from filtering.segmentation.scoring import folder_pair, score_episodes
from filtering.vision.frame_features import FrameSource, frame_features
from teasim.common.errors import ConfigError, PoolError, TeasimError
from teasim.common.workers import IN_PROCESS
from teasim.pool import Episode, Pool, Span
from teasim.pool.mstcn.folder import MSTCNFolder, write_predictions
from tests.filtering.conftest import TOY_SEQUENCES
from tests.toy_pool import SEQ_1, make_toy_pool

SMALL = MSTCNConfig(
    epochs=40,
    learning_rate=5e-3,
    channels=16,
    prediction_layers=5,
    refinement_stages=1,
    refinement_layers=4,
)
FIT = FitConfig(episodes=(0, 1, 3), rate=10.0, shortest=0.2, network=SMALL)
QUICK = replace(FIT, network=replace(SMALL, epochs=1))


@pytest.fixture(scope="module")
def fitted(toy_pool: Pool, tmp_path_factory) -> tuple:
    out = tmp_path_factory.mktemp("segmenter") / "fitted"
    return out, fit_segmenter(toy_pool.root, out, FIT)


def test_unseen_demonstrations_are_segmented_well(fitted, toy_pool: Pool):
    folder, result = fitted
    assert result.labelled == (0, 1, 3)
    assert (result.scores["labelled"].videos, result.scores["unseen"].videos) == (3, 4)
    assert result.scores["unseen"].accuracy > 90.0
    assert result.scores["unseen"].f1[50] > 90.0
    found = load_segmenter(folder).segment(toy_pool)
    assert [[s.subtask for s in spans] for spans in found.spans] == [*map(list, TOY_SEQUENCES)]
    for episode, posteriors in zip(toy_pool.episodes, found.posteriors, strict=True):
        assert posteriors.shape == (episode.length, len(found.subtasks))
        np.testing.assert_allclose(posteriors.sum(axis=1), 1.0, atol=1e-5)


def test_the_checkpoint_says_what_it_was_fitted_to_and_how_good_it_is(fitted, toy_pool: Pool):
    folder, result = fitted
    described = json.loads((folder / "segmenter.json").read_text())
    assert described["labelled"] == sorted(toy_pool.episodes[i].demo_id for i in (0, 1, 3))
    record = described["record"]
    assert record["metrics"]["unseen"]["accuracy"] == result.scores["unseen"].accuracy
    assert record["pool_hash"] == toy_pool.content_hash()
    assert record["config"]["network"]["epochs"] == len(record["history"]) == 40


def test_a_seed_gives_the_same_bytes(toy_pool: Pool, tmp_path):
    for name in ("a", "b"):
        fit_segmenter(toy_pool.root, tmp_path / name, QUICK)
    files = [(tmp_path / name / "segmenter.safetensors").read_bytes() for name in ("a", "b")]
    assert files[0] == files[1]


def test_true_labels_are_not_read_when_segments_are_inferred(fitted, toy_pool, monkeypatch):
    config = FilterConfig(segmenter=str(fitted[0]))
    usual = DemoFilter(config).fit(toy_pool)

    def forbidden(_: Episode) -> None:
        raise AssertionError("the truth was read")

    monkeypatch.setattr(Episode, "spans", forbidden)
    assert DemoFilter(config).fit(toy_pool).table() == usual.table()


def test_the_filter_takes_a_segmenter_and_writes_down_how_good_it_was(
    fitted, toy_pool, tmp_path, capsys
):
    argv = [str(toy_pool.root), "-o", str(tmp_path / "out"), "--jobs", "1"]
    assert filter_verb([*argv, "--segmenter", str(fitted[0])]) == 0
    shown = capsys.readouterr().out
    assert "2 of 7 demonstrations are flagged." in shown
    assert f"and by sub-tasks that the segmenter '{fitted[0]}' found in them." in shown
    record = json.loads((tmp_path / "out" / "filter.json").read_text())["segmentation"]
    assert record["scores"]["unseen"]["videos"] == 4
    assert record["scores"]["unseen"]["accuracy"] > 90.0
    described = json.loads((fitted[0] / "segmenter.json").read_text())
    assert record["weights_sha256"] == described["weights_sha256"]
    assert filter_verb([*argv[:2], str(tmp_path / "truth"), "--jobs", "1"]) == 0
    assert json.loads((tmp_path / "truth" / "filter.json").read_text())["segmentation"] is None


def test_the_verb_fits_and_predicts(toy_pool, tmp_path, capsys):
    out, said = tmp_path / "s", tmp_path / "said"
    options = ["--labelled", "2", "--epochs", "1", "--jobs", "1", "--seed", "3"]
    assert segment(["fit", str(toy_pool.root), "-o", str(out), *options]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("fitted to 2 demonstrations: ")
    assert "accuracy  edit  F1@10  F1@25  F1@50  sub-tasks@5" in printed
    assert segment(["predict", str(out), str(toy_pool.root), "-o", str(said), "--jobs", "1"]) == 0
    assert f"predictions: {said / 'predictions'}" in capsys.readouterr().out
    written = MSTCNFolder.open(said)
    assert written.videos == tuple(f"episode_{n:06d}" for n in range(7))
    pairs = [folder_pair(written, video) for video in written.videos]
    assert [len(pair.truth) for pair in pairs] == [e.length for e in toy_pool.episodes]
    metrics = json.loads((said / "metrics.json").read_text())
    assert (metrics["labelled"]["videos"], metrics["unseen"]["videos"]) == (2, 5)


def test_predictions_from_stored_features(fitted, toy_pool: Pool, tmp_path):
    """Features exported from the pool give the pool's own segments."""
    source, names = FrameSource(toy_pool.cameras, 10.0), toy_pool.subtasks[::-1]
    features = frame_features(toy_pool.episodes, toy_pool.fps, source, workers=IN_PROCESS)
    found = load_segmenter(fitted[0]).segment(toy_pool)
    (tmp_path / "videos" / "features").mkdir(parents=True)
    truth = {}
    for episode, rows in zip(toy_pool.episodes[:6], features[:6], strict=True):
        np.save(tmp_path / "videos" / "features" / f"v{episode.index}.npy", rows.T)
        spans = episode.spans()
        labels = [names.index(s.subtask) for s in spans for _ in range(s.start, s.stop)]
        truth[f"v{episode.index}"] = np.array(labels)
    write_predictions(tmp_path / "videos", names, {}, truth, {})
    scores = predict(fitted[0], tmp_path / "videos", tmp_path / "out")
    assert scores["unseen"].accuracy > 90.0
    written = MSTCNFolder.open(tmp_path / "out")
    for number, posteriors in enumerate(found.posteriors[:6]):
        stored = np.load(tmp_path / "out" / "posteriors" / f"v{number}.npy", allow_pickle=False)
        np.testing.assert_array_equal(stored.T, posteriors)
    assert folder_pair(written, "v0").truth.tolist() == [
        written.names.index(names[label]) for label in truth["v0"]
    ]


def test_frames_of_no_subtask_become_a_label_of_their_own(toy_pool, tmp_path, monkeypatch):
    logged = Episode.spans
    monkeypatch.setattr(Episode, "spans", lambda episode: logged(episode)[:-1])
    fit_segmenter(toy_pool.root, tmp_path / "s", FIT)
    segmenter = load_segmenter(tmp_path / "s")
    assert segmenter.network.shape.labels == len(toy_pool.subtasks) + 1
    found = segmenter.segment(toy_pool)
    assert [s.subtask for s in found.spans[0]] == list(SEQ_1[:-1])
    assert found.posteriors[0].sum(axis=1)[-1] < 0.5
    assert score_episodes(toy_pool.episodes, found)["unseen"].accuracy > 85.0


def test_a_subtask_that_no_labelled_demonstration_shows_is_named(toy_pool, tmp_path, capsys):
    argv = ["fit", str(toy_pool.root), "-o", str(tmp_path / "s"), "--epochs", "1", "--jobs", "1"]
    assert segment([*argv, "--episodes", "2"]) == 0
    assert capsys.readouterr().err == (
        "teasim: warning: no labelled demonstration shows 'add_water', which others of the pool "
        "do; the segmenter cannot find it.\n"
    )


def test_by_chance_as_many_as_asked_for_are_labelled(toy_pool: Pool, tmp_path):
    def drawn(seed: int, count: int | None) -> tuple[int, ...]:
        config = FitConfig(labelled=count, rate=10.0, network=replace(QUICK.network, seed=seed))
        result: FitResult = fit_segmenter(toy_pool.root, tmp_path / f"{seed}{count}", config)
        return result.labelled

    assert len(drawn(0, 3)) == 3
    assert drawn(1, 3) != drawn(2, 3)
    assert drawn(0, None) == tuple(range(7))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--episodes", "0", "9"], "The pool has no demonstration 9; choose from 0 to 6."),
        (
            ["--episodes", "0", "--labelled", "2"],
            "Both episodes and labelled were given; choose one.",
        ),
        (["--labelled", "8"], "labelled is 8; choose 1 to 7."),
        (["--labelled", "0"], "labelled is 0; choose 1 to 7."),
        (["--camera", "roof"], "The pool has no camera 'roof'; choose from left, cup."),
        (["--rate", "0"], "rate is 0.0; choose moments per second above 0."),
        (["--epochs", "0"], "epochs is 0; choose 1 or more."),
        (["--jobs", "-1"], "jobs is -1; choose 1 or more."),
    ],
)
def test_a_fit_that_cannot_be_is_refused(toy_pool, tmp_path, options, message):
    with pytest.raises(TeasimError) as caught:
        segment(["fit", str(toy_pool.root), "-o", str(tmp_path / "s"), *options])
    assert str(caught.value) == message
    assert not (tmp_path / "s").exists()


def test_a_pool_without_labels_teaches_nothing(toy_pool, tmp_path, monkeypatch):
    monkeypatch.setattr(Episode, "spans", lambda _: ())
    with pytest.raises(PoolError) as caught:
        fit_segmenter(toy_pool.root, tmp_path / "s", replace(FIT, episodes=()))
    assert str(caught.value) == (
        f"The pool '{toy_pool.root}' has no labelled sub-tasks, which a segmenter is fitted to; "
        "filter it with --segmenter clustering instead."
    )


def test_labels_are_drawn_from_demonstrations_that_have_some(toy_pool, tmp_path, monkeypatch):
    logged = Episode.spans
    monkeypatch.setattr(
        Episode, "spans", lambda episode: logged(episode) if episode.index in (1, 4, 6) else ()
    )
    result = fit_segmenter(toy_pool.root, tmp_path / "s", replace(QUICK, episodes=()))
    assert result.labelled == (1, 4, 6)
    with pytest.raises(PoolError) as caught:
        fit_segmenter(toy_pool.root, tmp_path / "t", QUICK)
    assert str(caught.value) == (
        "Demonstration 0 has no labelled sub-tasks, which a segmenter is fitted to; choose others."
    )


def test_a_video_of_one_frame_teaches_nothing(tmp_path):
    pool = make_toy_pool(tmp_path / "pool", [("stir",)], frames_per_subtask=1)
    with pytest.raises(ConfigError) as caught:
        fit_segmenter(pool.root, tmp_path / "s", FitConfig())
    assert str(caught.value) == (
        "The video of demonstration 0 has 1 labelled frame; a segmenter learns from videos of 2 "
        "or more."
    )


def test_predicting_without_known_truth_scores_nothing(
    fitted, toy_pool, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(Episode, "spans", lambda _: ())
    argv = ["predict", str(fitted[0]), str(toy_pool.root), "-o", str(tmp_path / "o"), "--jobs", "1"]
    assert segment(argv) == 0
    assert "Nothing is scored: the true labels are not known." in capsys.readouterr().out
    assert not (tmp_path / "o" / "metrics.json").exists()
    assert not (tmp_path / "o" / "groundTruth").exists()


def test_a_segmenter_of_other_cameras_is_refused(fitted, tmp_path):
    pool = make_toy_pool(tmp_path / "pool", [SEQ_1], frames_per_subtask=2, cameras=("top", "cup"))
    with pytest.raises(ConfigError) as caught:
        predict(fitted[0], pool.root, tmp_path / "out")
    assert str(caught.value) == (
        f"The segmenter was fitted to the camera 'left', which the pool '{pool.root}' lacks; "
        "it has top, cup."
    )


def test_an_output_in_use_is_refused(fitted, toy_pool, tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    said = f"The output folder '{tmp_path}' is in use; choose a new or empty one."
    for attempt in (
        lambda: fit_segmenter(toy_pool.root, tmp_path, FIT),
        lambda: predict(fitted[0], toy_pool.root, tmp_path),
    ):
        with pytest.raises(ConfigError) as caught:
            attempt()
        assert str(caught.value) == said


def test_a_subtask_the_segmenter_does_not_know_counts_as_wrong(fitted, toy_pool, monkeypatch):
    found = load_segmenter(fitted[0]).segment(toy_pool)
    episode = toy_pool.episodes[4]
    whole = (Span("polish_cup", 0, episode.length),)
    monkeypatch.setattr(Episode, "spans", lambda _: whole)
    scores = score_episodes([episode], replace(found, spans=found.spans[4:5]))
    assert scores["unseen"].accuracy == 0.0
