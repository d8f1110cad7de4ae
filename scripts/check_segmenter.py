"""Fit MS-TCN++ to the labelled demonstrations of some pools and score it on others.

POOL is FOLDER[=PARTICIPANT,...][:COUNT]: all demonstrations of a pool, those of some participants,
the first few of them. Videos alone are looked at; labels of what is tested only score.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from filtering.segmentation.config import MSTCNConfig
from filtering.segmentation.fit import labelled_videos, least_seconds
from filtering.segmentation.metrics import SegmentationScores
from filtering.segmentation.mstcn.segmenter import MSTCNSegmenter
from filtering.segmentation.mstcn.training import MSTCNLearner
from filtering.segmentation.scoring import score_episodes
from filtering.segmentation.segments import Segmentation
from filtering.vision.frame_features import FrameSource, frame_features
from teasim.common.workers import Workers
from teasim.pool import Episode, Pool


@dataclass(frozen=True)
class Part:
    """Some demonstrations of a pool."""

    name: str
    """Name in the table."""
    pool: Pool
    """Pool that they belong to."""
    episodes: tuple[Episode, ...]
    """The demonstrations."""


def part(text: str) -> Part:
    """Read POOL as the module's text describes it."""
    chosen, _, count = text.partition(":")
    path, _, participants = chosen.partition("=")
    pool = Pool.open(path)
    wanted = participants.split(",") if participants else None
    episodes = [e for e in pool.episodes if wanted is None or e.participant in wanted]
    kept = episodes[: int(count)] if count else episodes
    return Part(f"{Path(path).name}{text[len(path) :]}", pool, tuple(kept))


def fit(parts: Sequence[Part], arguments: argparse.Namespace, seed: int) -> MSTCNSegmenter:
    """Fit one network to all demonstrations of `parts`."""
    subtasks = parts[0].pool.subtasks
    source = FrameSource(tuple(arguments.cameras), arguments.rate)
    videos = []
    for p in parts:
        features = frame_features(p.episodes, p.pool.fps, source, workers=Workers(arguments.jobs))
        videos += labelled_videos(p.episodes, features, subtasks)
    n_labels = max(len(subtasks), 1 + max(int(video.labels.max()) for video in videos))
    config = MSTCNConfig(seed=seed, scaling=arguments.scaling, epochs=arguments.epochs)
    learner = MSTCNLearner(config).fit(videos, n_labels)
    labelled = frozenset(e.demo_id for p in parts for e in p.episodes)
    network = learner.network_
    fps = min(p.pool.fps for p in parts)
    shortest = least_seconds(videos, n_labels, source.rate_in(fps), arguments.shortest)
    return MSTCNSegmenter(network, subtasks, source, arguments.scaling, shortest, labelled)


def by_order(p: Part, found: Segmentation) -> dict[str, SegmentationScores]:
    """Return the scores of all demonstrations of a part, then by their order of sub-tasks."""
    groups: dict[str, list[int]] = {"all": list(range(len(p.episodes)))}
    for number, episode in enumerate(p.episodes):
        groups.setdefault(episode.record.sequence if episode.record else "unknown", []).append(
            number
        )
    return {
        name: next(iter(score_episodes(*_chosen(p, found, numbers)).values()))
        for name, numbers in groups.items()
    }


def _chosen(
    p: Part, found: Segmentation, numbers: Sequence[int]
) -> tuple[list[Episode], Segmentation]:
    spans = tuple(found.spans[number] for number in numbers)
    return [p.episodes[n] for n in numbers], Segmentation(found.subtasks, spans)


def main() -> int:
    """Print frame accuracy, edit and F1@50 of every test part, mean over seeds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--train", nargs="+", type=part, required=True, metavar="POOL")
    parser.add_argument("--test", nargs="+", type=part, required=True, metavar="POOL")
    parser.add_argument("--seeds", type=int, default=3, help="networks; seeds 0, 1, ...")
    parser.add_argument("--epochs", type=int, default=MSTCNConfig.epochs)
    parser.add_argument("--scaling", default=MSTCNConfig.scaling, help="video or training")
    parser.add_argument("--cameras", nargs="+", default=["left"])
    parser.add_argument("--rate", type=float, default=FrameSource.rate, help="moments/s looked at")
    parser.add_argument(
        "--shortest", type=float, help="least length of every segment [s]; default: learned"
    )
    parser.add_argument("--jobs", type=int, default=1, help="processes that look at videos")
    arguments = parser.parse_args()
    found: dict[tuple[str, str], list[SegmentationScores]] = {}
    for seed in range(arguments.seeds):
        segmenter = fit(arguments.train, arguments, seed)
        for p in arguments.test:
            segments = segmenter.segment_episodes(
                p.pool, p.episodes, workers=Workers(arguments.jobs)
            )
            for order, scores in by_order(p, segments).items():
                found.setdefault((p.name, order), []).append(scores)
    print(f"{'pool':24}{'order':10}{'videos':>7}  accuracy (lowest)   edit (lowest)  F1@50")
    for (name, order), scores in found.items():
        accuracy = np.array([s.accuracy for s in scores])
        edit = np.array([s.edit for s in scores])
        f1 = np.mean([s.f1[50] for s in scores])
        print(
            f"{name:24}{order:10}{scores[0].videos:7}"
            f"  {accuracy.mean():8.1f} ({accuracy.min():.1f})"
            f"  {edit.mean():8.1f} ({edit.min():.1f})  {f1:5.1f}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
