"""What a filter leaves behind: weight table, lists for other tools, record of the run, the page."""

import json
import platform
import shlex
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
from filtering.report.views import demo_views
from filtering.segmentation.scoring import score_episodes, scores_json
from teasim.common.errors import ConfigError, TeasimError
from teasim.common.files import write_json, write_text
from teasim.pool import Pool
from teasim.pool.sequences import SequencePool, Source
from teasim.pool.weight_table import write_weight_table

FILES = ("weights.csv", "filter.json", "keep.txt", "exclude.txt", "report.html")
"""What an output folder holds."""
PACKAGES = ("teasim", "numpy", "scipy", "scikit-learn", "torch", "opencv-python-headless")
"""Packages whose versions are written down, because weights may depend on them."""

PROBABILITY = (
    "share of the upper of two Gaussians of one variance fitted to sqrt(loss), times the "
    "probability by BIC that there are two"
)
"""How probability_incorrect comes about."""


def check_output(out: Path, source: Path, *, overwrite: bool) -> None:
    """Refuse an output folder that is in use, before any work is done.

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
    foreign = sorted(present - set(FILES))
    if foreign:
        raise ConfigError(
            f"The output folder '{out}' holds other files ('{foreign[0]}'); "
            "choose one that is new or empty."
        )
    if present and not overwrite:
        raise ConfigError(
            f"The output folder '{out}' holds an earlier filter's output; "
            "choose another one or say --overwrite."
        )


def write_filter_output(
    out: Path | str,
    pool: Source,
    fitted: DemoFilter,
    *,
    sections: Sequence[ReportSection] = (),
    overwrite: bool = False,
) -> None:
    """Write FILES to the folder `out`, each atomically, the page last.

    Args:
        out: new or empty folder, or one with an earlier output.
        pool: what was filtered; it is not modified.
        fitted: the filter after `fit(pool)`.
        sections: what else goes on the page.
        overwrite: replace an earlier filter's output.

    Raises:
        ConfigError: the folder is in use.
        TeasimError: the folder cannot be written.
    """
    folder = Path(out)
    check_output(folder, pool.root, overwrite=overwrite)
    rows = fitted.table()
    keep = [row.episode_index for row in rows if not row.flagged]
    exclude = [row.episode_index for row in rows if row.flagged]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_weight_table(folder / "weights.csv", rows)
        write_json(folder / "filter.json", run_record(fitted, pool))
        write_text(folder / "keep.txt", _keep_text(pool, keep))
        write_text(folder / "exclude.txt", _exclude_text(pool, exclude))
    except OSError as error:
        raise TeasimError(f"The output '{out}' cannot be written: {error.strerror}.") from error
    render_report(
        folder / "report.html",
        demos=demo_views(pool, fitted),
        threshold=fitted.threshold_,
        subtasks=fitted.segments_.subtasks,
        sections=sections,
        unit=Clock(pool.fps).unit,
    )


def run_record(fitted: DemoFilter, pool: Source) -> dict[str, Any]:
    """Return what filter.json holds: enough to repeat the run and to check its result."""
    return {
        "config": asdict(fitted.config),
        "pool": str(pool.root),
        "pool_hash": pool.content_hash(),
        "versions": _versions(),
        "cameras": list(fitted.cameras_),
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
        "probability_is": PROBABILITY,
        "seconds": {stage: round(spent, 3) for stage, spent in fitted.timings_.items()},
    }


def _by_demo(fitted: DemoFilter, values: NDArray[np.float64]) -> dict[str, float]:
    return {row.demo_id: float(v) for row, v in zip(fitted.table(), values, strict=True)}


def video_list(pool: SequencePool, indexes: Sequence[int], purpose: str) -> str:
    """Return the files of an MS-TCN folder in the form of its splits, without the first lines."""
    files = [f"{pool.episodes[index].demo_id}.txt" for index in indexes]
    return _list(
        files,
        f"{len(files)} videos to {purpose}, of {pool.root}",
        "MS-TCN:    grep -v '^#' keep.txt > splits/keep.bundle",
    )


def _keep_text(pool: Source, keep: Sequence[int]) -> str:
    if isinstance(pool, SequencePool):
        return video_list(pool, keep, "keep")
    return keep_list(pool, keep)


def _exclude_text(pool: Source, exclude: Sequence[int]) -> str:
    if isinstance(pool, SequencePool):
        return video_list(pool, exclude, "leave out")
    return exclude_list(pool, exclude)


def keep_list(pool: Pool, keep: Sequence[int]) -> str:
    """Return keep.txt: the kept episodes, and how to use only them."""
    indexes = _json(keep)
    root, name = shlex.quote(str(pool.root)), shlex.quote(f"local/{pool.root.name}")
    demos = " ".join(f"demo_{index}" for index in keep)
    return _list(
        keep,
        f"{len(keep)} demonstrations to keep, episode indexes of {pool.root}",
        f"LeRobot:   lerobot-train --dataset.repo_id={name} --dataset.root={root} "
        f'--dataset.episodes="{indexes}"',
        f"robomimic: put these names into mask/keep and set train.hdf5_filter_key=keep: {demos}",
        f"Minari:    dataset.filter_episodes(lambda episode: episode.id in {indexes})",
    )


def exclude_list(pool: Pool, exclude: Sequence[int]) -> str:
    """Return exclude.txt: the flagged episodes, and how to leave them out."""
    title = f"{len(exclude)} demonstrations to leave out, episode indexes of {pool.root}"
    if not exclude:
        return _list(exclude, title)
    indexes = _json(exclude)
    root, name = shlex.quote(str(pool.root)), shlex.quote(f"local/{pool.root.name}")
    demos = " ".join(f"demo_{index}" for index in exclude)
    copy = shlex.quote(f"local/{pool.root.name}_filtered")
    return _list(
        exclude,
        title,
        f"LeRobot:   lerobot-train --dataset.repo_id={name} --dataset.root={root} "
        f'--dataset.exclude_episodes="{indexes}"   (needs a version after 0.6.1)',
        f"LeRobot:   lerobot-edit-dataset --repo_id {name} --root {root} --new_repo_id {copy} "
        f'--operation.type delete_episodes --operation.episode_indices "{indexes}"   '
        "(makes a copy, without the columns teasim/*)",
        f"robomimic: leave these names out of the mask you train on: {demos}",
        f"Minari:    dataset.filter_episodes(lambda episode: episode.id not in {indexes})",
    )


def _segmentation_record(fitted: DemoFilter, pool: Source) -> dict[str, Any] | None:
    """Return what inferred the segments and how good they are, where that is known."""
    found = fitted.segments_
    if isinstance(pool, SequencePool) or found.weights_sha256 is None:
        return None
    return {
        "weights_sha256": found.weights_sha256,
        "scores": scores_json(score_episodes(pool.episodes, found)),
    }


def _list(entries: Sequence[int] | Sequence[str], *comments: str) -> str:
    lines = [f"# {comment}" for comment in comments]
    return "\n".join([*lines, *map(str, entries)]) + "\n"


def _json(indexes: Sequence[int]) -> str:
    return json.dumps(list(indexes), separators=(",", ":"))


def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
