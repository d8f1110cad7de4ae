"""Judge real people's annotated sequences by the default score and by baselines.

Which ones are wrong is read for counting only.

FOLDER holds data sets in the MS-TCN form: 50salads (with predictions), captaincook4d and tea_unh,
the latter two with labels.csv. A data set that is not there is left out.
"""

import argparse
import csv
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from filtering.judging.baselines import BASELINES
from filtering.judging.norm.cut import cut_of
from filtering.judging.norm.norm_score import score_steps
from filtering.judging.norm.steps import StepList, count_steps, steps_of_frames
from filtering.judging.thresholds import probability_incorrect
from teasim.common.statistics import auroc
from teasim.pool.mstcn.folder import MSTCNFolder

DRESSING = ("add_oil", "add_vinegar", "add_salt", "add_pepper", "mix_dressing")
"""What the paper removes from salads that begin with it (section 4.2)."""
NO_STEPS = ("action_start", "action_end")
VISIBLE = ("Missing Step", "Order Error")
"""Errors that a list of steps can show."""

NORM = "norm"
"""Name of the default score."""
CRITICAL = ("add_tea_bag", "add_water", "turn_off_oven")
"""What the paper's Seq_3 leaves out."""

Drawn = tuple[list[StepList], list[bool]]
"""A pool, and which of its demonstrations are incorrect."""


@dataclass(frozen=True)
class Judged:
    """What was said about a pool of D demonstrations."""

    losses: dict[str, np.ndarray]
    """(D,) by the default score, NORM, and by every baseline."""
    flagged: np.ndarray
    """(D,) flags of the default score."""
    probabilities: np.ndarray
    """(D,) how probable it says it is that a demonstration is incorrect."""
    wrong: np.ndarray
    """(D,) the truth."""

    @property
    def areas(self) -> dict[str, float]:
        """AUROC of every score."""
        return {name: auroc(losses, self.wrong) for name, losses in self.losses.items()}


def judge(demos: Sequence[StepList], wrong: Sequence[bool]) -> Judged:
    """Score one pool."""
    n_subtasks = 1 + max(max(demo.labels) for demo in demos)
    losses = score_steps(count_steps(demos, n_subtasks)).losses
    every = {NORM: losses, **{name: baseline(demos) for name, baseline in BASELINES.items()}}
    return Judged(every, losses > cut_of(losses), probability_incorrect(losses), np.array(wrong))


def salads(
    root: Path, k: int, pools: int, *, correct_ones: int = 10, true_labels: bool = False
) -> Iterator[Drawn]:
    """Draw cutting-first salads and k whose dressing is removed, as segmented by a network."""
    folder = MSTCNFolder.open(root)
    dressing = [folder.names.index(name) for name in DRESSING]
    dropped = [folder.names.index(name) for name in NO_STEPS]
    correct, wrong = [], []
    for video in folder.videos:
        truth, seen = folder.truth(video), folder.predictions(video)
        assert truth is not None
        seen = truth if true_labels else seen
        begins = next(label for label in truth.tolist() if label not in dropped)
        if begins in dressing:
            seen = seen[~np.isin(truth, dressing)]
        steps = steps_of_frames(np.where(np.isin(seen, dropped), -1, seen))
        (wrong if begins in dressing else correct).append(steps)
    for seed in range(pools):
        rng = np.random.default_rng([k, seed])
        good = rng.choice(len(correct), correct_ones, replace=False)
        bad = rng.choice(len(wrong), k, replace=False)
        demos = [correct[index] for index in good] + [wrong[index] for index in bad]
        yield demos, [False] * correct_ones + [True] * k


def recipes(root: Path) -> Iterator[tuple[str, Drawn]]:
    """Read every recipe of CaptainCook4D: missing steps and order errors against correct ones."""
    for folder in sorted(path for path in root.iterdir() if path.is_dir()):
        rows = [
            row
            for row in _labels(folder)
            if row["correct"] == "1" or any(kind in row["errors"] for kind in VISIBLE)
        ]
        demos = [_steps(MSTCNFolder.open(folder), row["video"]) for row in rows]
        yield folder.name, (demos, [row["correct"] == "0" for row in rows])


def _labels(folder: Path) -> list[dict[str, str]]:
    with (folder / "labels.csv").open() as file:
        return list(csv.DictReader(file))


def _steps(folder: MSTCNFolder, video: str) -> StepList:
    truth = folder.truth(video)
    assert truth is not None
    return steps_of_frames(truth)


def teas(root: Path, k: int, pools: int) -> Iterator[Drawn]:
    """Draw 10 correct full-length teas and k of which one or two critical steps are deleted."""
    folder = MSTCNFolder.open(root)
    critical = [folder.names.index(name) for name in CRITICAL]
    correct = [row["video"] for row in _labels(root) if row["correct"] == "1"]
    full = [
        video for video in correct if len(set(_steps(folder, video).labels)) >= len(folder.names)
    ]
    for seed in range(pools):
        rng = np.random.default_rng([k, seed])
        drawn = [_steps(folder, full[i]) for i in rng.choice(len(full), 10 + k, replace=False)]
        for index in range(10, 10 + k):
            drawn[index] = _without(drawn[index], rng.permutation(critical)[: 1 + seed % 2])
        yield drawn, [False] * 10 + [True] * k


def clean_teas(root: Path, pools: int) -> Iterator[Drawn]:
    """Draw 12 correct teas, some without milk or sugar."""
    folder = MSTCNFolder.open(root)
    correct = [row["video"] for row in _labels(root) if row["correct"] == "1"]
    for seed in range(pools):
        drawn = np.random.default_rng([0, seed]).choice(len(correct), 12, replace=False)
        yield [_steps(folder, correct[i]) for i in drawn], [False] * 12


def _without(demo: StepList, labels: np.ndarray) -> StepList:
    kept = [k for k, label in enumerate(demo.labels) if label not in labels]
    return StepList(tuple(demo.labels[k] for k in kept), tuple(demo.lengths[k] for k in kept))


def main() -> int:
    """Print one line per kind of pool."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of the data sets")
    parser.add_argument("--pools", type=int, default=100, help="random pools per row")
    arguments = parser.parse_args()
    root: Path = arguments.folder
    _print_head()
    if (root / "50salads").is_dir():
        for k in (1, 2, 4, 6):
            _print(f"50-Salads, predicted, 10 + {k}", salads(root / "50salads", k, arguments.pools))
    if (root / "captaincook4d").is_dir():
        found = list(recipes(root / "captaincook4d"))
        for name, drawn in found:
            _print(f"CaptainCook4D, {name}", [drawn])
        _print("CaptainCook4D, all recipes", [drawn for _, drawn in found])
    if (root / "tea_unh").is_dir():
        for k in (1, 4, 8):
            _print(f"UNH tea, deletions, 10 + {k}", teas(root / "tea_unh", k, arguments.pools))
    return 0


def _print_head() -> None:
    names = "".join(f"{name[:9]:>10}" for name in (NORM, *BASELINES))
    print(f"{'AUROC of':34}{names}  | {NORM}: accuracy  recall  falsely flagged  Brier")


def _print(name: str, pools: Iterable[Drawn]) -> None:
    judged = [judge(*drawn) for drawn in pools]
    areas = "".join(
        f"{np.mean([found.areas[score] for found in judged]):10.3f}" for score in (NORM, *BASELINES)
    )
    right = np.mean([(found.flagged == found.wrong).mean() for found in judged])
    recall = np.mean([found.flagged[found.wrong].mean() for found in judged])
    false = np.mean([found.flagged[~found.wrong].sum() for found in judged])
    brier = np.mean([((found.probabilities - found.wrong) ** 2).mean() for found in judged])
    print(
        f"{name:34}{areas}  | {100 * right:12.1f} % {100 * recall:6.1f} % {false:15.2f}"
        f" {brier:6.3f}",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main())
