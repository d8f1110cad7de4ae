"""Using a fitted segmenter on a pool or an MS-TCN folder (`teasim segment predict`)."""

from pathlib import Path

import numpy as np

from filtering.segmentation.metrics import LabelPair, segmentation_scores
from filtering.segmentation.mstcn.checkpoint import load_segmenter
from filtering.segmentation.mstcn.segmenter import MSTCNSegmenter
from filtering.segmentation.scoring import UNSEEN, ScoresByPart, score_episodes, scores_json
from filtering.segmentation.segments import decode
from teasim.common.files import check_new_folder, write_json
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool.mstcn.folder import MSTCNFolder, is_mstcn_folder, write_predictions
from teasim.pool.readers.registry import open_source
from teasim.pool.soundness import print_notes, require_sound
from teasim.pool.source import Source
from teasim.pool.types import NO_SUBTASK, index_from_spans

METRICS_FILE = "metrics.json"
"""Name of the file of measures in the output folder."""


def predict(
    segmenter_folder: Path, source: Path, out: Path, *, workers: Workers = IN_PROCESS
) -> ScoresByPart:
    """Segment a pool or an MS-TCN folder and write the result to the new folder `out`.

    `out` is an MS-TCN folder: mapping.txt, predictions, posteriors and, where the true labels are
    known, groundTruth and METRICS_FILE.

    Returns:
        Measures by part of the pool, empty without true labels.

    Raises:
        CheckpointError: the folder of the segmenter holds none, or a damaged one.
        ConfigError: the segmenter does not fit the videos, or `out` is in use.
        PoolError: a video or a file is missing or damaged.
    """
    check_new_folder(out)
    segmenter = load_segmenter(segmenter_folder)
    if is_mstcn_folder(source):
        scores = _predict_folder(segmenter, MSTCNFolder.open(source), out)
    else:
        scores = _predict_pool(segmenter, open_source(source), out, workers)
    if scores:
        write_json(out / METRICS_FILE, scores_json(scores))
    return scores


def _predict_pool(
    segmenter: MSTCNSegmenter, pool: Source, out: Path, workers: Workers
) -> ScoresByPart:
    require_sound(pool)
    print_notes(pool)
    found = segmenter.segment(pool, workers=workers)
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


def _predict_folder(segmenter: MSTCNSegmenter, folder: MSTCNFolder, out: Path) -> ScoresByPart:
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
