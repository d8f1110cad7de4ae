"""Fitting a segmenter to labelled demonstrations of a pool (`teasim segment fit`)."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from filtering.features.checkpoint import save_features
from filtering.features.learned import LookConfig, learn_features
from filtering.segmentation.config import FitConfig
from filtering.segmentation.figures import segmenter_figures
from filtering.segmentation.mstcn.checkpoint import save_segmenter
from filtering.segmentation.mstcn.segmenter import MSTCNSegmenter
from filtering.segmentation.mstcn.training import LabelledVideo, MSTCNLearner, least_lengths
from filtering.segmentation.scoring import ScoresByPart, score_episodes, scores_json
from filtering.vision.frame_features import FrameSource, frame_features, sampled_frames
from filtering.vision.frames import chosen_cameras, frame_rate
from filtering.vision.pretrained import Backbone
from teasim.common.errors import ConfigError, PoolError
from teasim.common.figures import CurvesFigure, Drawing
from teasim.common.files import check_new_folder
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool.readers.registry import open_source
from teasim.pool.soundness import print_notes, require_sound
from teasim.pool.source import Demonstration, Source
from teasim.pool.types import NO_SUBTASK, index_from_spans

USUAL_LABELLED = 12
"""Demonstrations whose labels are used by default."""
CHECKED = 12
"""Largest number of unseen demonstrations on which a new segmenter is evaluated; `predict`
evaluates all."""


@dataclass(frozen=True)
class FitResult:
    """Summary of a fit."""

    labelled: tuple[int, ...]
    """Numbers of the demonstrations whose labels were used."""
    never_shown: tuple[str, ...]
    """Sub-tasks that occur only in other demonstrations."""
    loss: float
    """Mean loss of the last epoch [nats, summed over stages]."""
    scores: ScoresByPart
    """Measures of the segmentation, by part of the pool."""
    figures: Mapping[str, Drawing]
    """Training, and confusion and timelines of the demonstrations that were evaluated."""


def fit_segmenter(
    source: Path, out: Path, config: FitConfig, *, workers: Workers = IN_PROCESS
) -> FitResult:
    """Fit MS-TCN++ to labelled demonstrations of `source` and save it in the new folder `out`.

    `out` is created last, so that bad input leaves nothing behind.

    Raises:
        ConfigError: a setting does not fit the pool, or `out` is in use.
        PoolError: the pool is damaged, or has no labelled sub-tasks.
    """
    began = time.perf_counter()
    pool = open_source(source)
    check_new_folder(out)
    network = Backbone(config.backbone, config.backbone_weights)
    require_sound(pool)
    print_notes(pool)
    frames = FrameSource(chosen_cameras(pool, config.cameras) or pool.cameras, config.rate)
    chosen, others = _divide(pool, config)
    subtasks = pool.subtasks or tuple(sorted(_shown(chosen)))
    segmenter, history = _fit(pool, chosen, subtasks, frames, config=config, workers=workers)
    look = LookConfig(frames.cameras[0], backbone=network)
    learned = learn_features(chosen, subtasks, look, workers=workers) if config.features else None
    tried = [*chosen, *_draw(others, CHECKED, config.network.seed)]
    found = segmenter.segment_episodes(pool, tried, workers=workers)
    result = FitResult(
        labelled=tuple(episode.index for episode in chosen),
        never_shown=tuple(sorted(_shown(others) - _shown(chosen))),
        loss=history[-1],
        scores=score_episodes(tried, found),
        figures={
            "training": CurvesFigure({"loss": history}, "loss [nats, summed over stages]"),
            **segmenter_figures(
                [episode.name for episode in tried],
                [episode.spans() for episode in tried],
                found.spans,
                pool.fps,
            ),
        },
    )
    record = _record(pool, config, result, history, time.perf_counter() - began)
    if learned is not None:
        save_features(learned, out)
    save_segmenter(segmenter, out, record)
    return result


def _fit(
    pool: Source,
    chosen: Sequence[Demonstration],
    subtasks: tuple[str, ...],
    frames: FrameSource,
    *,
    config: FitConfig,
    workers: Workers,
) -> tuple[MSTCNSegmenter, tuple[float, ...]]:
    """Return the segmenter and the mean loss of each epoch."""
    rate = frame_rate(pool)
    videos = labelled_videos(
        chosen, frame_features(chosen, rate, frames, workers=workers), subtasks
    )
    # Frames of no sub-task, where there are any, get one more label, the last.
    n_labels = max(len(subtasks), 1 + max(int(video.labels.max()) for video in videos))
    learner = MSTCNLearner(config.network).fit(videos, n_labels)
    segmenter = MSTCNSegmenter(
        network=learner.network_,
        subtasks=subtasks,
        source=frames,
        scaling=config.network.scaling,
        shortest=least_seconds(videos, n_labels, frames.rate_in(rate), config.shortest),
        labelled=frozenset(episode.demo_id for episode in chosen),
    )
    return segmenter, learner.history_


def _divide(pool: Source, config: FitConfig) -> tuple[list[Demonstration], list[Demonstration]]:
    """Return the demonstrations whose labels are used, and the others."""
    if config.episodes and config.labelled is not None:
        raise ConfigError("Both episodes and labelled were given; choose one.")
    used = _named(pool, config.episodes) if config.episodes else _drawn(pool, config)
    chosen = [episode for episode in pool.episodes if episode.index in used]
    return chosen, [episode for episode in pool.episodes if episode.index not in used]


def _named(pool: Source, indexes: Sequence[int]) -> set[int]:
    """Return the numbers of the demonstrations asked for, which must have labels."""
    by_index = {episode.index: episode for episode in pool.episodes}
    for index in indexes:
        if index not in by_index:
            raise ConfigError(
                f"The pool has no demonstration {index}; choose from "
                f"{min(by_index)} to {max(by_index)}."
            )
        if not by_index[index].spans():
            raise PoolError(
                f"Demonstration {index} has no labelled sub-tasks, which a segmenter is fitted to; "
                "choose others."
            )
    return set(indexes)


def _drawn(pool: Source, config: FitConfig) -> set[int]:
    """Return the numbers of demonstrations drawn from those that have labels."""
    labelled = [episode for episode in pool.episodes if episode.spans()]
    if not labelled:
        raise PoolError(
            f"The pool '{pool.root}' has no labelled sub-tasks, which a segmenter is fitted to; "
            "filter it with --segmenter clustering instead."
        )
    count = min(USUAL_LABELLED, len(labelled)) if config.labelled is None else config.labelled
    if not 1 <= count <= len(labelled):
        raise ConfigError(f"labelled is {count}; choose 1 to {len(labelled)}.")
    return {episode.index for episode in _draw(labelled, count, config.network.seed)}


def _draw(episodes: Sequence[Demonstration], count: int, seed: int) -> list[Demonstration]:
    """Return at most `count` randomly drawn demonstrations in their order."""
    rng = np.random.default_rng(seed)
    drawn = rng.permutation(len(episodes))[:count]
    return [episodes[number] for number in sorted(drawn)]


def _shown(episodes: Sequence[Demonstration]) -> set[str]:
    return {span.subtask for episode in episodes for span in episode.spans()}


def labelled_videos(
    episodes: Sequence[Demonstration],
    features: Sequence[NDArray[np.float32]],
    subtasks: tuple[str, ...],
) -> list[LabelledVideo]:
    """Return features and labels at each frame used; frames of no sub-task get the label T."""
    columns = [index_from_spans(e.spans(), subtasks, e.length) for e in episodes]
    videos = []
    for episode, column, moments in zip(episodes, columns, features, strict=True):
        labels = column[sampled_frames(episode.length, len(moments))]
        labels = np.where(labels == NO_SUBTASK, len(subtasks), labels)
        videos.append(LabelledVideo(f"of demonstration {episode.index}", moments, labels))
    return videos


def least_seconds(
    videos: Sequence[LabelledVideo], n_labels: int, rate: float, given: float | None = None
) -> tuple[float, ...]:
    """Return the least length of a run of each of the C labels [s].

    Args:
        videos: labelled videos.
        n_labels: C.
        rate: frames used per second of video [Hz].
        given: the same length for all labels; None derives it from the videos.
    """
    if given is not None:
        return (given,) * n_labels
    return tuple(moments / rate for moments in least_lengths(videos, n_labels))


def _record(
    pool: Source, config: FitConfig, result: FitResult, history: Sequence[float], seconds: float
) -> dict[str, Any]:
    """Return the record of the fit in segmenter.json, sufficient to repeat it."""
    return {
        "config": asdict(config),
        "pool_hash": pool.content_hash(),
        "labelled": list(result.labelled),
        "never_shown": list(result.never_shown),
        "metrics": scores_json(result.scores),
        "history": list(history),
        "versions": {name: version(name) for name in ("teasim", "torch", "numpy")},
        "seconds": round(seconds, 3),
    }
