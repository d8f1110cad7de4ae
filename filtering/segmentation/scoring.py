"""Measures of the segments of a pool whose true segments were logged."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from filtering.segmentation.metrics import (
    OVERLAPS,
    TOLERANCES,
    LabelPair,
    SegmentationScores,
    segmentation_scores,
)
from filtering.segmentation.segments import Segmentation
from teasim.common.errors import PoolError
from teasim.pool.mstcn.folder import PREDICTIONS, TRUTH, MSTCNFolder
from teasim.pool.source import Demonstration
from teasim.pool.types import index_from_spans

ScoresByPart = dict[str, SegmentationScores]
"""Measures by UNSEEN and LABELLED."""
UNSEEN = "unseen"
"""Demonstrations whose labels the segmenter did not use."""
LABELLED = "labelled"
"""Demonstrations that the segmenter was fitted to."""


def score_episodes(episodes: Sequence[Demonstration], found: Segmentation) -> ScoresByPart:
    """Return the measures of each part; a part without logged segments is left out.

    Args:
        episodes: the demonstrations that were segmented.
        found: their segments.

    Raises:
        PoolError: logged spans are damaged.
    """
    parts: dict[str, list[LabelPair]] = {UNSEEN: [], LABELLED: []}
    for number, episode in enumerate(episodes):
        pair = label_pair(episode, number, found)
        if pair is not None:
            parts[LABELLED if episode.demo_id in found.labelled else UNSEEN].append(pair)
    return {part: segmentation_scores(pairs) for part, pairs in parts.items() if pairs}


def scores_table(scores: ScoresByPart) -> str:
    """Return the measures as lines of text, one per part [%]."""
    heads = ["videos", "accuracy", "edit"]
    heads += [f"F1@{k}" for k in OVERLAPS] + [f"sub-tasks@{p}" for p in TOLERANCES]
    width = max(map(len, ["", *scores])) + 2
    lines = [" " * width + "  ".join(heads)]
    for part, s in scores.items():
        rates = [s.accuracy, s.edit, *s.f1.values(), *s.subtask_accuracy.values()]
        cells = [str(s.videos), *(f"{rate:.1f}" for rate in rates)]
        row = "  ".join(f"{cell:>{len(head)}}" for cell, head in zip(cells, heads, strict=True))
        lines.append(f"{part:<{width}}{row}")
    return "\n".join(lines)


def scores_json(scores: ScoresByPart) -> dict[str, Any]:
    """Return the measures in a form that JSON can hold."""
    return {part: asdict(s) for part, s in scores.items()}


def label_pair(episode: Demonstration, number: int, found: Segmentation) -> LabelPair | None:
    """Return true and predicted labels of demonstration `number`; None without logged segments."""
    logged = episode.spans()
    if not logged:
        return None
    names = tuple(dict.fromkeys([*found.subtasks, *(span.subtask for span in logged)]))
    truth, predicted = (
        index_from_spans(spans, names, episode.length) for spans in (logged, found.spans[number])
    )
    return LabelPair(np.asarray(truth), np.asarray(predicted))


def folder_pair(folder: MSTCNFolder, video: str) -> LabelPair:
    """Return the truth and the stored predictions of a video of an MS-TCN folder.

    Raises:
        PoolError: one of them is missing or damaged, or they differ in length.
    """
    truth, predicted = folder.truth(video), folder.predictions(video)
    if truth is None:
        raise PoolError(f"The video '{video}' of '{folder.root}' has no {TRUTH}.")
    if len(truth) != len(predicted):
        raise PoolError(
            f"{TRUTH}/{video}.txt of '{folder.root}' has {len(truth)} labels "
            f"but {PREDICTIONS}/{video}.txt has {len(predicted)}."
        )
    return LabelPair(truth, predicted)
