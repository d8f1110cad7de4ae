"""The output folder of a filter: weight table, lists for other tools, record of the run, page."""

import platform
import sys
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from filtering.demo_filter import DemoFilter, caution
from filtering.judging.explain import Clock
from filtering.report import ReportSection, render_report
from filtering.report.videos import FOLDER, Embed, foreign_videos, remove_videos
from filtering.report.views import demo_views
from filtering.segmentation.scoring import score_episodes, scores_json
from teasim.common.errors import ConfigError, TeasimError
from teasim.common.files import write_json, write_text
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool.segments_table import segment_rows, write_segments_table
from teasim.pool.source import Source
from teasim.pool.weight_table import write_weight_table

FILES = ("weights.csv", "segments.csv", "filter.json", "keep.txt", "exclude.txt", "report.html")
"""Files of an output folder; beside them stands the folder of the page's videos, if any."""
PACKAGES = ("teasim", "numpy", "scipy", "scikit-learn", "torch", "opencv-python-headless")
"""Packages whose versions are recorded, because weights may depend on them."""

LEARNED = "learned decision: P(incorrect | the whole pool), see docs/decision.md"
"""Definition of probability_incorrect where the learned decision was used."""
PROBABILITY = (
    "probability of the upper of two Gaussians of equal variance fitted to sqrt(loss), times the "
    "probability by BIC that there are two"
)
"""Definition of probability_incorrect."""


def check_output(out: Path, source: Path, *, overwrite: bool) -> None:
    """Refuse an output folder that is in use.

    Raises:
        ConfigError: `out` is a file, lies in the pool, or holds something else, or an earlier
            filter's output and `overwrite` is not set.
    """
    if out.resolve().is_relative_to(source.resolve()):
        raise ConfigError(
            f"The output '{out}' lies in the pool '{source}', which is never modified; "
            "choose another folder."
        )
    if not out.exists():
        return
    if not out.is_dir():
        raise ConfigError(f"The output '{out}' is a file; choose a folder.")
    present = {path.name for path in out.iterdir()}
    foreign = sorted(present - {*FILES, FOLDER}) + foreign_videos(out)
    if foreign:
        raise ConfigError(
            f"The output folder '{out}' holds other files ('{foreign[0]}'); "
            "choose one that is new or empty."
        )
    if present and not overwrite:
        raise ConfigError(
            f"The output folder '{out}' holds an earlier filter's output; "
            "choose another one or add --overwrite."
        )


def write_filter_output(
    out: Path | str,
    pool: Source,
    fitted: DemoFilter,
    *,
    sections: Sequence[ReportSection] = (),
    overwrite: bool = False,
    embed: Embed = "auto",
    workers: Workers = IN_PROCESS,
) -> None:
    """Write FILES to the folder `out`, each atomically, the page last.

    Videos that are not embedded in the page are in a folder `videos` beside it. An error while
    the page is made becomes a warning on stderr: the results are already written.

    Args:
        out: new or empty folder, or one with an earlier output.
        pool: what was filtered.
        fitted: the filter after `fit(pool)`.
        sections: further sections of the page.
        overwrite: replace an earlier output.
        embed: whether the page holds its videos: all, none, or auto, where they are small.
        workers: where the videos of the page are encoded.

    Raises:
        ConfigError: the folder is in use.
        TeasimError: the folder cannot be written.
    """
    folder = Path(out)
    check_output(folder, pool.root, overwrite=overwrite)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _write_results(folder, pool, fitted)
    except OSError as error:
        raise TeasimError(f"The output '{out}' cannot be written: {error.strerror}.") from error
    (folder / "report.html").unlink(missing_ok=True)  # never a page of other weights
    try:
        render_report(
            folder / "report.html",
            demos=demo_views(pool, fitted, folder, embed=embed, workers=workers),
            threshold=fitted.threshold_,
            subtasks=fitted.segments_.subtasks,
            words=fitted.words_,
            sections=sections,
            unit=Clock(pool.fps).unit,
        )
    except Exception as error:
        remove_videos(folder)
        reason = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        print(f"teasim: warning: the page could not be made: {reason}.", file=sys.stderr)


def _write_results(folder: Path, pool: Source, fitted: DemoFilter) -> None:
    """Write what other tools read, and remove the videos of an earlier page."""
    rows = fitted.table()
    keep = [row.episode_index for row in rows if not row.flagged]
    exclude = [row.episode_index for row in rows if row.flagged]
    write_weight_table(folder / "weights.csv", rows)
    write_segments_table(folder / "segments.csv", segment_rows(pool, fitted.segments_.spans))
    write_json(folder / "filter.json", run_record(fitted, pool))
    write_text(folder / "keep.txt", selection_text(pool, keep, keep=True))
    write_text(folder / "exclude.txt", selection_text(pool, exclude, keep=False))
    remove_videos(folder)


def run_record(fitted: DemoFilter, pool: Source) -> dict[str, Any]:
    """Return the content of filter.json, sufficient to repeat the run and to check its result."""
    return {
        "config": asdict(fitted.config),
        "score": fitted.chosen_.score,
        "segmenter": fitted.chosen_.segmenter,
        "pool": str(pool.root),
        "pool_hash": pool.content_hash(),
        "versions": _versions(),
        "cameras": list(fitted.cameras_),
        "cameras_looked_at": list(fitted.looked_at_),
        "subtasks": list(fitted.segments_.subtasks),
        "segmentation": _segmentation_record(fitted, pool),
        "segmentation_confidence": fitted.segments_.confidence(),
        "demonstrations": len(fitted.weights_),
        "caution": caution(len(fitted.weights_)),
        "flagged": int(fitted.flagged_.sum()),
        "groups": int(fitted.groups_.max()) + 1,
        "group_names": list(fitted.group_names_),
        "threshold": fitted.threshold_,
        "objective": fitted.objective_,
        "trusted": float(fitted.trust_.sum()),
        "trust": _by_demo(fitted, fitted.trust_),
        "probability_incorrect": _by_demo(fitted, fitted.probabilities_),
        "probability_is": LEARNED if fitted.chosen_.decision == "learned" else PROBABILITY,
        "decision": _decision_record(fitted),
        "words": list(fitted.words_),
        "tasks": _tasks_record(fitted),
        "sequences": _sequences_record(fitted),
        "risk_of_leaving_out": fitted.summary_.risks if fitted.summary_ else None,
        "seconds": {stage: round(spent, 3) for stage, spent in fitted.timings_.items()},
    }


def _decision_record(fitted: DemoFilter) -> dict[str, Any] | None:
    """Return what was decided about the pool as a whole; None where clusters decided."""
    found = fitted.decision_
    if found is None:
        return None
    return {
        "words": list(found.words),
        "p_clean": found.facts["clean"],
        "facts": dict(found.facts),
        "cost": found.cost,
        "cut": found.cut,
        "expected_recall": found.expected_recall,
        "model_sha256": found.sha256,
    }


def _tasks_record(fitted: DemoFilter) -> list[dict[str, Any]] | None:
    """Return what was found task by task; None where all were judged together."""
    if not fitted.tasks_:
        return None
    table = fitted.table()
    return [
        {
            "task": task.name,
            "judged": task.judged,
            "demonstrations": [table[row].demo_id for row in task.rows],
            "flagged": sum(table[row].flagged for row in task.rows),
            "words": list(task.words),
        }
        for task in fitted.tasks_
    ]


def _sequences_record(fitted: DemoFilter) -> list[dict[str, Any]] | None:
    """Return each different sequence of steps, the most frequent first; None without steps."""
    if fitted.summary_ is None:
        return None
    names = [row.demo_id for row in fitted.table()]
    return [
        {"steps": list(way.steps), "demonstrations": [names[row] for row in way.rows]}
        for way in fitted.summary_.ways.all
    ]


def _by_demo(fitted: DemoFilter, values: NDArray[np.float64]) -> dict[str, float]:
    return {row.demo_id: float(v) for row, v in zip(fitted.table(), values, strict=True)}


def selection_text(pool: Source, indexes: Sequence[int], *, keep: bool) -> str:
    """Return the text of keep.txt or exclude.txt, with the options of other tools as comments."""
    purpose = "keep" if keep else "leave out"
    title = f"{len(indexes)} demonstrations to {purpose}, of {pool.root}"
    comments = [f"# {line}" for line in (title, *pool.usage(indexes, keep=keep))]
    return "\n".join([*comments, *pool.entries(indexes)]) + "\n"


def _segmentation_record(fitted: DemoFilter, pool: Source) -> dict[str, Any] | None:
    """Return the segmenter and its measures; None where segments were not inferred."""
    found = fitted.segments_
    if found.weights_sha256 is None:
        return None
    return {
        "weights_sha256": found.weights_sha256,
        "scores": scores_json(score_episodes(pool.episodes, found)),
    }


def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
