"""Step lists without pictures are filtered as pools are, or refused with a reason."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.judging.judges import JUDGES
from filtering.judging.norm.norm_score import score_steps
from filtering.judging.norm.steps import count_steps, steps_of_frames
from filtering.output import FILES
from filtering.segmentation.segmenter import segmenter_named
from teasim.cli.main import main
from teasim.common.errors import ConfigError, PoolError
from teasim.pool import Pool, Span
from teasim.pool.mstcn.folder import write_predictions
from teasim.pool.readers.registry import open_source
from teasim.pool.sequences import SequencePool, joined_spans
from teasim.pool.weight_table import read_weight_table
from tests.filtering.conftest import real_data
from tests.toy_pool import SEQ_1

FULL = np.repeat(np.arange(7), 4)
NO_WATER = FULL[FULL != 5]
GAPPED = np.where(np.arange(len(FULL)) % 4 == 1, -1, FULL)
"""Background inside of every segment."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Six videos by truth, the third without water; the network sees water left out twice."""
    root = tmp_path / "labels"
    truth = {f"v{k}": NO_WATER if k == 2 else FULL for k in range(6)}
    seen = {**truth, "v4": NO_WATER, "v0": GAPPED}
    posteriors = {
        name: np.full((len(labels), 7), 1 / 7, np.float32) for name, labels in seen.items()
    }
    write_predictions(root, SEQ_1, seen, truth, posteriors)
    return root


def run(folder: Path, out: Path, *extra: str) -> int:
    return main(["filter", str(folder), "-o", str(out), *extra])


@pytest.mark.parametrize(("count", "majority"), [(3, 2), (4, 3), (5, None)])
def test_a_few_demonstrations_come_with_a_caution(
    count: int, majority: int | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    labels = {f"v{k}": FULL for k in range(count)}
    posteriors = {name: np.full((len(FULL), 7), 1 / 7, np.float32) for name in labels}
    write_predictions(tmp_path / "few", SEQ_1, labels, labels, posteriors)
    assert run(tmp_path / "few", tmp_path / "out") == 0
    printed = capsys.readouterr().out.splitlines()
    told = json.loads((tmp_path / "out" / "filter.json").read_text())["caution"]
    if majority is None:
        assert told is None
        assert not any("majority" in line for line in printed)
        return
    assert told == (
        f"With {count} demonstrations a majority is {majority}: a mistake that 2 of them share "
        "looks like usual behaviour, and even the mistake of a single one may not be flagged."
    )
    assert told in printed


@pytest.mark.parametrize(("source", "wrong"), [("logged", ["v2"]), ("predictions", ["v2", "v4"])])
def test_a_folder_of_labels_is_filtered(
    folder: Path, tmp_path: Path, source: str, wrong: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run(folder, out, "--segmenter", source) == 0
    assert sorted(path.name for path in out.iterdir()) == sorted(FILES)
    rows = read_weight_table(out / "weights.csv")
    assert [row.demo_id for row in rows] == [f"v{k}" for k in range(6)]
    assert [row.demo_id for row in rows if row.flagged] == wrong
    assert rows[2].reason == (
        "After turn_off_oven (frames 16-20) 'add_water' was expected, 'stir' was seen at frame 20; "
        "'add_water' is missing from the whole video."
    )
    assert f"{wrong[0]}  weight 0." in capsys.readouterr().out
    kept = [f"v{k}.txt" for k in range(6) if f"v{k}" not in wrong]
    assert lines(out / "keep.txt") == kept
    assert lines(out / "exclude.txt") == [f"{name}.txt" for name in wrong]
    record = json.loads((out / "filter.json").read_text())
    assert record["pool_hash"] == SequencePool.open(folder).content_hash()
    assert record["cameras"] == []


def lines(path: Path) -> list[str]:
    return [line for line in path.read_text().splitlines() if not line.startswith("#")]


def test_the_page_has_no_place_for_videos_and_counts_frames(folder: Path, tmp_path: Path) -> None:
    assert run(folder, tmp_path / "out") == 0
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<video" not in page
    assert "no video<" not in page
    assert re.search(r"<h3[^>]*>\s*V?v2\s*</h3>", page)
    assert "<span>28 frames</span>" in page
    assert "add water is missing" in page
    assert not re.search(r"\d s[<\"]", page)


def test_with_a_frame_rate_times_are_seconds(folder: Path, tmp_path: Path) -> None:
    assert run(folder, tmp_path / "out", "--fps", "2") == 0
    assert "(8.0-10.0 s)" in read_weight_table(tmp_path / "out" / "weights.csv")[2].reason
    assert "<span>14 s</span>" in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize("name", JUDGES)
def test_every_score_judges_step_lists(folder: Path, name: str) -> None:
    found = DemoFilter(FilterConfig(segmenter="logged", score=name)).fit(SequencePool.open(folder))
    assert np.flatnonzero(found.flagged_).tolist() == [2]
    assert "'add_water' is missing" in found.reasons_[2]
    assert found.cameras_ == ()


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        (
            ["--camera", "left"],
            "'{folder}' has no pictures; leave out cameras, which needs them.",
        ),
        (
            ["--background", "mog2"],
            "'{folder}' has no pictures; leave out background, which needs them.",
        ),
        (
            ["--frames-per-segment", "8"],
            "'{folder}' has no pictures; leave out frames_per_segment, which needs them.",
        ),
        (["--fps", "0"], "fps is 0.0; choose a number above 0."),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    folder: Path, tmp_path: Path, extra: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(folder, tmp_path / "out", *extra) == 2
    assert capsys.readouterr().err == f"teasim: {message.format(folder=folder)}\n"
    assert not (tmp_path / "out").exists()


def test_a_segmenter_that_looks_at_pictures_is_refused(folder: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        DemoFilter(FilterConfig(segmenter="clustering")).fit(SequencePool.open(folder))
    assert str(caught.value) == f"'{folder}' has no pictures to look at."


def test_videos_without_labels_are_named(folder: Path) -> None:
    (folder / "groundTruth" / "v3.txt").write_text("background\n")
    pool = SequencePool.open(folder)
    with pytest.raises(PoolError) as caught:
        segmenter_named("logged")(pool)
    assert str(caught.value) == (
        f"The demonstration 'v3' of '{folder}' has no sub-tasks that the segmenter 'logged' could "
        "read; choose another segmenter."
    )
    (folder / "predictions" / "v1.txt").unlink()
    with pytest.raises(PoolError, match=r"v1\.txt' cannot be read: No such file"):
        segmenter_named("predictions")(pool)


def test_posteriors_come_along_when_every_video_has_them(folder: Path) -> None:
    pool = SequencePool.open(folder)
    found = segmenter_named("predictions")(pool).posteriors
    assert found is not None
    assert found[4].shape == (len(NO_WATER), 7)
    assert segmenter_named("logged")(pool).posteriors is None
    assert segmenter_named("logged")(pool).told
    assert not segmenter_named("predictions")(pool).told
    (folder / "posteriors" / "v1.npy").unlink()
    assert segmenter_named("predictions")(pool).posteriors is None


def test_background_within_a_sub_task_does_not_end_it() -> None:
    found = joined_spans(np.array([-1, 0, 0, -1, 0, 1, -1, 0]), ("a", "b"))
    assert found == (Span("a", 1, 5), Span("b", 5, 6), Span("a", 7, 8))


def test_the_hash_knows_every_label(folder: Path) -> None:
    before = SequencePool.open(folder).content_hash()
    assert SequencePool.open(folder).content_hash() == before
    path = folder / "predictions" / "v5.txt"
    path.write_text(path.read_text().replace("stir", "add_sugar", 1))
    assert SequencePool.open(folder).content_hash() != before


def test_a_source_is_a_pool_or_such_a_folder(folder: Path, toy_pool: Pool) -> None:
    assert isinstance(open_source(folder), SequencePool)
    assert isinstance(open_source(toy_pool.root), Pool)


def test_real_predictions_are_judged_as_the_score_judges_them() -> None:
    pool = SequencePool.open(real_data("50salads"))
    found = DemoFilter(FilterConfig(segmenter="predictions")).fit(pool)
    steps = [steps_of_frames(e.folder.predictions(e.demo_id)) for e in pool.episodes]
    assert found.losses_ == pytest.approx(
        score_steps(count_steps(steps, len(pool.subtasks))).losses, abs=1e-6
    )
    for reason, flagged, weight in zip(found.reasons_, found.flagged_, found.weights_, strict=True):
        assert bool(reason) == bool(flagged or weight < 0.8)
        assert reason.startswith("Kept, though odd: ") == bool(reason and not flagged)
