"""The work of the verb `segment`: a pool to a segmenter, videos and a segmenter to predictions."""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from filtering.effects.checkpoint import save_effects
from filtering.effects.reader import FEWEST_DEMOS, EffectReader, fit_effects
from filtering.effects.rests import rest_features
from filtering.features.checkpoint import save_features
from filtering.features.learned import LookConfig, learn_features
from filtering.segmentation.metrics import LabelPair, SegmentationScores, segmentation_scores
from filtering.segmentation.mstcn_checkpoint import load_segmenter, save_segmenter
from filtering.segmentation.mstcn_segmenter import MSTCNSegmenter
from filtering.segmentation.mstcn_training import (
    LabelledVideo,
    MSTCNConfig,
    MSTCNLearner,
    least_lengths,
)
from filtering.segmentation.scoring import UNSEEN, score_episodes, scores_json
from filtering.segmentation.segments import decode
from filtering.vision.frame_features import (
    FrameSource,
    frame_features,
    sampled_frames,
)
from filtering.vision.frames import chosen_cameras, frame_rate
from teasim.common.errors import ConfigError, PoolError
from teasim.common.files import check_new_folder, write_json
from teasim.pool.mstcn import (
    MSTCNFolder,
    is_mstcn_folder,
    write_predictions,
)
from teasim.pool.readers.registry import open_source
from teasim.pool.soundness import require_sound
from teasim.pool.source import Demonstration, Source
from teasim.pool.types import NO_SUBTASK, index_from_spans

USUAL_LABELLED = 12
"""Demonstrations whose labels are used when nobody says which, or how many."""
CHECKED = 12
"""Most unseen demonstrations that a new segmenter is tried on; `predict` tries all."""
METRICS_FILE = "metrics.json"

Scores = dict[str, SegmentationScores]


@dataclass(frozen=True)
class FitConfig:
    """What a segmenter is fitted to, and how."""

    episodes: tuple[int, ...] = ()
    """Numbers of the demonstrations whose labels are used; empty: as many as `labelled`, drawn."""
    labelled: int | None = None
    """How many to draw of those that have labels; None: USUAL_LABELLED, or all of fewer."""
    cameras: tuple[str, ...] = ()
    """Cameras whose pictures are used; empty means all."""
    rate: float = 2.5
    """Moments looked at per second of video [Hz]."""
    shortest: float | None = None
    """Least length of a segment that the segmenter returns [s]; None: of each sub-task half of the
    shortest one that is labelled."""
    features: bool = False
    """Whether the paper's features are learned too, from the first of the cameras."""
    network: MSTCNConfig = field(default_factory=MSTCNConfig)
    """The network's settings; its seed also draws the demonstrations."""


@dataclass(frozen=True)
class FitResult:
    """What came of a fit."""

    labelled: tuple[int, ...]
    """Numbers of the demonstrations whose labels were used."""
    never_shown: tuple[str, ...]
    """Sub-tasks that other demonstrations show but none of these."""
    loss: float
    """Mean loss of the last epoch [nats, summed over stages]."""
    scores: Scores
    """How good it is, by part of the pool."""
    effects: dict[str, float]
    """Balanced accuracy of each effect that is read at rest, by its sub-task [share]; empty where
    too few demonstrations are labelled."""


def fit_segmenter(source: Path, out: Path, config: FitConfig, *, jobs: int = 1) -> FitResult:
    """Fit MS-TCN++ to labelled demonstrations of `source`, save it in the new folder `out`.

    `out` is made last, so nothing is left behind when the input is bad.

    Raises:
        ConfigError: a setting does not fit the pool, or `out` is in use.
        PoolError: the pool is damaged, or has no labelled sub-tasks.
    """
    pool = open_source(source)
    check_new_folder(out)
    require_sound(pool)
    frames = FrameSource(chosen_cameras(pool, config.cameras) or pool.cameras, config.rate)
    chosen, others = _divide(pool, config)
    subtasks = pool.subtasks or tuple(sorted(_shown(chosen)))
    began = time.perf_counter()
    features = frame_features(chosen, frame_rate(pool), frames, jobs=jobs)
    videos = labelled_videos(chosen, features, subtasks)
    # Frames of no sub-task, where there are any, are one more label, the last.
    n_labels = max(len(subtasks), 1 + max(int(video.labels.max()) for video in videos))
    learner = MSTCNLearner(config.network).fit(videos, n_labels)
    segmenter = MSTCNSegmenter(
        network=learner.network_,
        subtasks=subtasks,
        source=frames,
        scaling=config.network.scaling,
        shortest=least_seconds(videos, n_labels, frames.rate_in(frame_rate(pool)), config.shortest),
        labelled=frozenset(episode.demo_id for episode in chosen),
    )
    effects = _learn_effects(pool, chosen, features, frames)
    look = LookConfig(frames.cameras[0])
    learned = learn_features(chosen, subtasks, look, jobs=jobs) if config.features else None
    tried = [*chosen, *_draw(others, CHECKED, config.network.seed)]
    scores = score_episodes(tried, segmenter.segment_episodes(pool, tried, jobs=jobs))
    result = FitResult(
        labelled=tuple(episode.index for episode in chosen),
        never_shown=_never_shown(chosen, others),
        loss=learner.history_[-1],
        scores=scores,
        effects={} if effects is None else effects.reliability(),
    )
    record = _record(pool, config, result, learner.history_, time.perf_counter() - began)
    if learned is not None:
        save_features(learned, out)
    if effects is not None:
        save_effects(effects, out)
    save_segmenter(segmenter, out, record)
    return result


def predict(segmenter_folder: Path, source: Path, out: Path, *, jobs: int = 1) -> Scores:
    """Write what a segmenter says about a pool or an MS-TCN folder to the new folder `out`.

    It becomes an MS-TCN folder: mapping.txt, predictions, posteriors, and where the truth is known
    groundTruth and METRICS_FILE.

    Returns:
        Scores by part, empty without known truth.

    Raises:
        CheckpointError: there is no usable segmenter.
        ConfigError: it does not fit the videos, or `out` is in use.
        PoolError: a video or a file is missing or damaged.
    """
    check_new_folder(out)
    segmenter = load_segmenter(segmenter_folder)
    if is_mstcn_folder(source):
        scores = _predict_folder(segmenter, MSTCNFolder.open(source), out)
    else:
        scores = _predict_pool(segmenter, open_source(source), out, jobs)
    if scores:
        write_json(out / METRICS_FILE, scores_json(scores))
    return scores


def _predict_pool(segmenter: MSTCNSegmenter, pool: Source, out: Path, jobs: int) -> Scores:
    require_sound(pool)
    found = segmenter.segment(pool, jobs=jobs)
    assert found.posteriors is not None
    scores = score_episodes(pool.episodes, found)
    logged = [episode.spans() for episode in pool.episodes]
    names = tuple(dict.fromkeys([*found.subtasks, *(s.subtask for spans in logged for s in spans)]))
    predicted, truth, posteriors = {}, {}, {}
    for number, episode in enumerate(pool.episodes):
        video = f"episode_{episode.index:06d}"
        predicted[video] = index_from_spans(found.spans[number], names, episode.length)
        posteriors[video] = found.posteriors[number]
        if logged[number]:
            truth[video] = index_from_spans(logged[number], names, episode.length)
    write_predictions(out, names, predicted, truth, posteriors)
    return scores


def _predict_folder(segmenter: MSTCNSegmenter, folder: MSTCNFolder, out: Path) -> Scores:
    """Predict from stored features, one row per frame; the labels are matched by name."""
    names = tuple(dict.fromkeys([*segmenter.subtasks, *folder.names]))
    to_common = np.array([*map(names.index, folder.names), NO_SUBTASK])  # -1 stays -1
    predicted, truth, posteriors, pairs = {}, {}, {}, []
    for video in folder.videos:
        probabilities = segmenter.posteriors(folder.features(video))
        labels = decode(probabilities)
        predicted[video] = np.where(labels < len(segmenter.subtasks), labels, NO_SUBTASK)
        posteriors[video] = probabilities[:, : len(segmenter.subtasks)]
        known = folder.truth(video)
        if known is not None:
            truth[video] = to_common[known[: len(labels)]]
            pairs.append(LabelPair(truth[video], predicted[video]))
    write_predictions(out, names, predicted, truth, posteriors)
    return {UNSEEN: segmentation_scores(pairs)} if pairs else {}


def _divide(pool: Source, config: FitConfig) -> tuple[list[Demonstration], list[Demonstration]]:
    """Return the demonstrations whose labels are used, and the others."""
    if config.episodes and config.labelled is not None:
        raise ConfigError("Both episodes and a number of labelled ones were given; choose one.")
    used = _named(pool, config.episodes) if config.episodes else _drawn(pool, config)
    chosen = [episode for episode in pool.episodes if episode.index in used]
    return chosen, [episode for episode in pool.episodes if episode.index not in used]


def _named(pool: Source, indexes: Sequence[int]) -> set[int]:
    """Return the numbers that were asked for, all of demonstrations with labels."""
    by_index = {episode.index: episode for episode in pool.episodes}
    for index in indexes:
        if index not in by_index:
            raise ConfigError(
                f"The pool has no demonstration {index}; choose from "
                f"{min(by_index)} to {max(by_index)}."
            )
        if not by_index[index].spans():
            raise PoolError(
                f"Demonstration {index} has no labelled sub-tasks, which a segmenter learns from; "
                "choose others."
            )
    return set(indexes)


def _drawn(pool: Source, config: FitConfig) -> set[int]:
    """Return the numbers of demonstrations drawn from those that have labels."""
    labelled = [episode for episode in pool.episodes if episode.spans()]
    if not labelled:
        raise PoolError(
            f"The pool '{pool.root}' has no labelled sub-tasks (column subtask_index), which a "
            "segmenter learns from."
        )
    count = min(USUAL_LABELLED, len(labelled)) if config.labelled is None else config.labelled
    if not 1 <= count <= len(labelled):
        raise ConfigError(f"labelled is {count}; choose 1 to {len(labelled)}.")
    return {episode.index for episode in _draw(labelled, count, config.network.seed)}


def _draw(episodes: Sequence[Demonstration], count: int, seed: int) -> list[Demonstration]:
    """Return at most `count` random ones in their order."""
    rng = np.random.default_rng(seed)
    drawn = rng.permutation(len(episodes))[:count]
    return [episodes[number] for number in sorted(drawn)]


def _shown(episodes: Sequence[Demonstration]) -> set[str]:
    return {span.subtask for episode in episodes for span in episode.spans()}


def _never_shown(
    chosen: Sequence[Demonstration], others: Sequence[Demonstration]
) -> tuple[str, ...]:
    return tuple(sorted(_shown(others) - _shown(chosen)))


def labelled_videos(
    episodes: Sequence[Demonstration],
    features: Sequence[NDArray[np.float32]],
    subtasks: tuple[str, ...],
) -> list[LabelledVideo]:
    """Return features and labels at each moment; frames of no sub-task get the label T."""
    columns = [index_from_spans(e.spans(), subtasks, e.length) for e in episodes]
    videos = []
    for episode, column, moments in zip(episodes, columns, features, strict=True):
        labels = column[sampled_frames(episode.length, len(moments))]
        labels = np.where(labels == NO_SUBTASK, len(subtasks), labels)
        videos.append(LabelledVideo(f"of demonstration {episode.index}", moments, labels))
    return videos


def least_seconds(
    videos: Sequence[LabelledVideo], n_labels: int, rate: float, told: float | None = None
) -> tuple[float, ...]:
    """Return the least length of a run of each label [s], for videos of `rate` moments a second."""
    if told is not None:
        return (told,) * n_labels
    return tuple(moments / rate for moments in least_lengths(videos, n_labels))


def _learn_effects(
    pool: Source,
    episodes: Sequence[Demonstration],
    features: Sequence[NDArray[np.float32]],
    frames: FrameSource,
) -> EffectReader | None:
    """Return what reads the effects of labelled demonstrations; None where they are too few."""
    if len(episodes) < FEWEST_DEMOS:
        return None
    rests = [
        rest_features(moments, episode.length, episode.spans(), frame_rate(pool))
        for moments, episode in zip(features, episodes, strict=True)
    ]
    done = [[span.subtask for span in episode.spans()] for episode in episodes]
    return fit_effects(rests, done, frames)


def _record(
    pool: Source, config: FitConfig, result: FitResult, history: Sequence[float], seconds: float
) -> dict[str, Any]:
    """Return what segmenter.json says about the fit, enough to repeat it."""
    return {
        "config": asdict(config),
        "pool_hash": pool.content_hash(),
        "labelled": list(result.labelled),
        "never_shown": list(result.never_shown),
        "metrics": scores_json(result.scores),
        "effects": result.effects,
        "history": list(history),
        "versions": {name: version(name) for name in ("teasim", "torch", "numpy")},
        "seconds": round(seconds, 3),
    }
