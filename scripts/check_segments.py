"""Find the sub-tasks of pools drawn from rendered ones without labels, and count what is right.

Found sub-tasks are matched to the true ones one-to-one, once for a whole pool. Labels are read for
counting only. With --without-rests the moments of least motion are cut out first, because a
segmenter that lives on pauses fails where there are none. Exit code 1 when the mean accuracy is
below --least.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from filtering.segmentation.unlabelled.clustering import RATE, looks, subtask_count
from filtering.segmentation.unlabelled.discovery import Discovery, discover
from filtering.vision.frame_features import FrameSource, sampled_frames
from filtering.vision.frames import main_camera
from teasim.common.workers import IN_PROCESS
from teasim.pool import Pool
from teasim.pool.types import index_from_spans


def main() -> int:
    """Run the check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sources", type=Path, nargs="+", help="rendered pools, put together")
    parser.add_argument("--pools", type=int, default=10, help="number of pools drawn")
    parser.add_argument("--size", type=int, default=14, help="demonstrations in each")
    parser.add_argument("--subtasks", default="auto", help="how many to look for")
    parser.add_argument("--without-rests", type=float, default=0.0, help="share of moments cut out")
    parser.add_argument("--least", type=float, default=80.0, help="accuracy aimed at [%%]")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    bank = [video for source in arguments.sources for video in read(source)]
    bank = [without_rests(*video, arguments.without_rests) for video in bank]
    rng = np.random.default_rng(arguments.seed)
    accuracies = []
    for number in range(arguments.pools):
        drawn = [bank[i] for i in rng.permutation(len(bank))[: arguments.size]]
        videos, truths = zip(*drawn, strict=True)
        found = discover(videos, subtask_count(arguments.subtasks))
        sure = np.concatenate([video.max(axis=1) for video in found.posteriors]).mean()
        accuracies.append(matched_accuracy(found, truths))
        print(
            f"pool {number}: {found.posteriors[0].shape[1]} sub-tasks, {accuracies[-1]:.1f} % of "
            f"the moments right, mean probability {sure:.3f}",
            flush=True,
        )
    print(f"mean {np.mean(accuracies):.1f} %, worst {min(accuracies):.1f} %")
    return int(np.mean(accuracies) < arguments.least)


def read(root: Path) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return features and true labels of the moments of every demonstration of a pool."""
    pool = Pool.open(root)
    videos = looks(
        pool.episodes, pool.fps, FrameSource((main_camera(pool),), RATE), workers=IN_PROCESS
    )
    columns = [index_from_spans(e.spans(), pool.subtasks, e.length) for e in pool.episodes]
    return [
        (video, np.asarray(column)[sampled_frames(len(column), len(video))])
        for video, column in zip(videos, columns, strict=True)
    ]


def without_rests(
    video: np.ndarray, labels: np.ndarray, share: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cut the moments out that differ least from a neighbour."""
    motion = np.abs(np.diff(video, axis=0)).mean(axis=1)
    still = np.minimum(np.append(motion[0], motion), np.append(motion, motion[-1]))
    kept = np.sort(np.argsort(still, kind="stable")[round(share * len(video)) :])
    return video[kept], labels[kept]


def matched_accuracy(found: Discovery, truths: tuple[np.ndarray, ...]) -> float:
    """Return the share of moments whose sub-task is right [%]."""
    labels, truth = np.concatenate(found.labels), np.concatenate(truths)
    counts = np.zeros((labels.max() + 1, truth.max() + 1))
    np.add.at(counts, (labels, truth), 1)
    return float(100 * counts[linear_sum_assignment(-counts)].sum() / counts.sum())


if __name__ == "__main__":
    sys.exit(main())
