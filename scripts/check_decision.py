"""Measure the learned decision beside the cut between clusters of losses.

Fresh drawn pools (seed 900001, of which none was used for fitting), step lists of tea, and the data
sets of FOLDER, in the form that check_sequences.py reads. Which demonstrations are incorrect is
read for counting only.
"""

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from check_sequences import Drawn, clean_teas, recipes, salads, teas

from filtering.judging.config import DECISIONS, JudgingConfig
from filtering.judging.decision.calibration import calibration
from filtering.judging.decision.decide import decide
from filtering.judging.decision.prior.pools import draw_pool
from filtering.judging.evidence import Evidence
from filtering.judging.judges import Judgement, by_norm
from filtering.judging.norm.steps import StepList
from filtering.judging.thresholds import probability_incorrect
from teasim.pool import Span
from teasim.task.recipes import CRITICAL, PRECEDENCE, SEQ_1, SEQ_2

FRESH = 900001
"""Seed of the drawn pools."""
MOST_INCORRECT = 0.44
"""Largest share of incorrect demonstrations in the pools of recipes."""
SUBSETS = 10
"""Random subsets of each recipe."""


@dataclass(frozen=True)
class Result:
    """What one decision says about a pool of D demonstrations."""

    flagged: np.ndarray
    """(D,) who is called incorrect."""
    p: np.ndarray
    """(D,) probability of being incorrect."""
    groups: np.ndarray
    """(D,) group."""
    words: tuple[str, ...]
    """What is said about the pool; nothing where clusters decide."""


def evidence(demos: Sequence[StepList], *, told: bool) -> Evidence:
    """Return step lists as evidence."""
    spans = []
    for demo in demos:
        stops = np.cumsum(demo.lengths).tolist()
        starts = [0, *stops[:-1]]
        spans.append(
            tuple(Span(str(a), b, c) for a, b, c in zip(demo.labels, starts, stops, strict=True))
        )
    number = 1 + max(max(demo.labels) for demo in demos)
    return Evidence(tuple(map(str, range(number))), tuple(spans), told=told)


def judge(
    demos: Sequence[StepList], decision: str, groups: str = "auto", *, told: bool = True
) -> Result:
    """Judge one pool, whose segments are told or those of a segmenter."""
    config = JudgingConfig(decision=decision, groups=groups)
    found: Judgement = by_norm(evidence(demos, told=told), config)
    learned = found.decision
    return Result(
        found.grouping.flagged,
        probability_incorrect(found.losses) if learned is None else learned.probabilities,
        found.grouping.groups,
        () if learned is None else learned.words,
    )


class Row(NamedTuple):
    """Pools of one kind."""

    name: str
    """What they are."""
    pools: Iterable[Drawn]
    """The pools."""
    told: bool = True
    """Whether their segments are told; otherwise a segmenter found them."""


def subsets(root: Path) -> dict[str, list[Drawn]]:
    """Return pools of the recipes: all, at most MOST_INCORRECT, one incorrect, none."""
    rng = np.random.default_rng(0)
    made: dict[str, list[Drawn]] = {"all": [], "<= 44 %": [], "correct + 1": [], "clean": []}
    for _, (demos, wrong) in recipes(root):
        good, bad = np.flatnonzero(~np.array(wrong)), np.flatnonzero(wrong)
        most = min(int(MOST_INCORRECT / (1 - MOST_INCORRECT) * len(good) + 1e-9), len(bad))
        chosen = [rng.choice(bad, most, replace=False) for _ in range(SUBSETS)]
        kinds = {"all": [bad], "<= 44 %": chosen, "correct + 1": bad[:, None], "clean": [bad[:0]]}
        for name, sets in kinds.items():
            made[name] += [_pool(demos, good, some) for some in sets]
    return made


def _pool(demos: Sequence[StepList], good: np.ndarray, bad: np.ndarray) -> Drawn:
    return [demos[i] for i in [*good, *bad]], [False] * len(good) + [True] * len(bad)


Steps = Sequence[str]
Kind = Callable[[np.random.Generator], Steps]
"""Draws one demonstration."""


def seq_3(rng: np.random.Generator) -> Steps:
    """Leave one or two critical steps out of Seq_1."""
    out = rng.permutation(CRITICAL)[: rng.integers(1, 3)]
    return [name for name in SEQ_1 if name not in out]


def legal(rng: np.random.Generator) -> Steps:
    """Draw any order that respects the precedence."""
    order: list[str] = []
    while len(order) < len(SEQ_1):
        able = [n for n in SEQ_1 if n not in order and set(PRECEDENCE[n]) <= set(order)]
        order.append(str(rng.choice(able)))
    return order


def optional(rng: np.random.Generator) -> Steps:
    """Leave out milk and sugar, each with probability one half."""
    out = [name for name in ("add_milk", "add_sugar") if rng.random() < 0.5]
    assert set(out) <= set(SEQ_1)
    return [name for name in SEQ_1 if name not in out]


def extra(rng: np.random.Generator) -> Steps:
    """Add a foreign step to Seq_1."""
    place = int(rng.integers(len(SEQ_1) + 1))
    return [*SEQ_1[:place], "foreign", *SEQ_1[place:]]


def repeated(rng: np.random.Generator) -> Steps:
    """Repeat a step of Seq_1 later, not directly after itself."""
    first = int(rng.integers(len(SEQ_1) - 1))
    place = int(rng.integers(first + 2, len(SEQ_1) + 1))
    return [*SEQ_1[:place], SEQ_1[first], *SEQ_1[place:]]


def constant(order: Steps) -> Kind:
    """Always do the same."""
    return lambda _: order


def tea(parts: Sequence[tuple[Kind, int, bool]], pools: int, row: int) -> Iterator[Drawn]:
    """Draw pools of step lists: kinds, how many of each, and whether they are incorrect."""
    names = [*SEQ_1, "foreign"]
    for number in range(pools):
        rng = np.random.default_rng([row, number])
        demos, wrong = [], []
        for kind, count, incorrect in parts:
            for _ in range(count):
                labels = tuple(names.index(name) for name in kind(rng))
                lengths = np.exp(rng.normal(4.0, 0.2, len(labels))).astype(int) + 1
                demos.append(StepList(labels, tuple(lengths.tolist())))
                wrong.append(incorrect)
        yield demos, wrong


def three_people(pools: int) -> Iterator[Drawn]:
    """Draw pools of three people with one legal order each: 5 + 5 + 4."""
    for number in range(pools):
        rng = np.random.default_rng([50, number])
        parts = [(constant(legal(rng)), count, False) for count in (5, 5, 4)]
        yield from tea(parts, 1, 1000 + number)


def tea_rows(pools: int) -> Iterator[Row]:
    """Yield the rows of step lists."""
    usual = constant(SEQ_1)
    yield Row("12 seq_1", tea([(usual, 12, False)], pools, 1))
    for name, kind in (("seq_2", constant(SEQ_2)), ("seq_3", seq_3)):
        for k in (1, 2, 4, 6, 8):
            yield Row(
                f"10 seq_1 + {k} {name}", tea([(usual, 10, False), (kind, k, True)], pools, k)
            )
    for name, kind in (("extra", extra), ("repeat", repeated)):
        for k in (1, 2, 4):
            yield Row(
                f"10 seq_1 + {k} {name}", tea([(usual, 10, False), (kind, k, True)], pools, k)
            )
    yield Row("14 legal orders", tea([(legal, 14, False)], pools, 2))
    yield Row("three people, 5 + 5 + 4", three_people(pools))
    yield Row("14 with optional milk, sugar", tea([(optional, 14, False)], pools, 3))
    omits = constant([name for name in SEQ_1 if name != CRITICAL[0]])
    yield Row("8 lack a step, 6 do not", tea([(omits, 8, True), (usual, 6, False)], pools, 4))


def folder_rows(root: Path, pools: int) -> Iterator[Row]:
    """Yield the rows of the data sets that are there."""
    if (root / "captaincook4d").is_dir():
        for name, drawn in subsets(root / "captaincook4d").items():
            yield Row(f"CaptainCook4D, {name}", drawn)
    if (root / "50salads").is_dir():
        for source, true_labels in (("true", True), ("predicted", False)):
            for k in (0, 1, 2, 4, 6):
                count = 10 if k else 12
                drawn = salads(
                    root / "50salads", k, pools, correct_ones=count, true_labels=true_labels
                )
                yield Row(f"50-Salads, {source}, {count} + {k}", drawn, true_labels)
    if (root / "tea_unh").is_dir():
        yield Row("UNH tea, clean", clean_teas(root / "tea_unh", pools))
        for k in (1, 4, 8):
            yield Row(f"UNH tea, deletions, 10 + {k}", teas(root / "tea_unh", k, pools))


def table(rows: Iterable[Row], decisions: Sequence[str]) -> None:
    """Print one line per row, then the calibration of each decision over all rows."""
    everything: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {name: [] for name in decisions}
    print(f"{'':32}" + "".join(f"| {name}: recall accused silent brier " for name in decisions))
    for name, drawn, told in rows:
        pools = list(drawn)
        text, words = f"{name:32}", ""
        for decision in decisions:
            found = [judge(demos, decision, told=told) for demos, _ in pools]
            truths = [np.array(wrong) for _, wrong in pools]
            everything[decision] += [(r.p, t) for r, t in zip(found, truths, strict=True)]
            text += _cells(found, truths, len(decision))
            words = _commonest(found) or words
        print(text + words, flush=True)
    for decision, pairs in everything.items():
        if pairs:
            p, t = (np.concatenate(part) for part in zip(*pairs, strict=True))
            print(f"{decision}: {_calibration_text(p, t)}")


def _cells(found: Sequence[Result], truths: Sequence[np.ndarray], pad: int) -> str:
    recall = [r.flagged[t].mean() for r, t in zip(found, truths, strict=True) if t.any()]
    accused = np.array([(r.flagged & ~t).sum() for r, t in zip(found, truths, strict=True)])
    silent = np.mean([not r.flagged.any() for r in found])
    brier = np.mean([((r.p - t) ** 2).mean() for r, t in zip(found, truths, strict=True)])
    shown = f"{np.mean(recall):6.2f}" if recall else "     -"
    return f"| {'':{pad}} {shown} {accused.mean():7.2f} {silent:6.2f} {brier:5.3f} "


def _commonest(found: Sequence[Result]) -> str:
    """Return how often each word is said about the pools."""
    said = [word.split(":")[0] for result in found for word in result.words]
    names, counts = np.unique(said, return_counts=True)
    parts = [f"{name} {count / len(found):.2f}" for name, count in zip(names, counts, strict=True)]
    return "| " + ", ".join(parts) if said else ""


def _calibration_text(p: np.ndarray, truth: np.ndarray) -> str:
    found = calibration(p, truth.astype(float))
    diagram: Iterable[tuple[int, float, float]] = found["diagram"]  # type: ignore[assignment]
    bins = " ".join(f"{mean:.2f}>{share:.2f}({number})" for number, mean, share in diagram)
    numbers = [found[name] for name in ("ece", "brier", "brier of the base rate")]
    return (
        "ECE {:.3f}, Brier {:.3f}, of the base rate {:.3f}; mean p > share (number): ".format(
            *numbers
        )
        + bins
    )


def fresh(pools: int) -> None:
    """Print the calibration on fresh drawn pools."""
    found, truth, accused = [], [], []
    for number in range(pools):
        drawn = draw_pool(np.random.default_rng([FRESH, number]))
        result = decide(drawn.observed, cost=2.0)
        found.append(result.probabilities)
        truth.append(drawn.incorrect)
        if not drawn.incorrect.any():
            accused.append(result.flagged.sum())
    p, t = np.concatenate(found), np.concatenate(truth)
    flagged = p > 1 / 3
    print(f"{pools} drawn pools: {_calibration_text(p, t)}")
    print(
        f"recall {flagged[t].mean():.2f}, precision {t[flagged].mean():.2f}, "
        f"accused per clean pool {np.mean(accused):.2f}"
    )


def three_kinds(pools: int) -> None:
    """Print how often 6 + 4 + 2 is grouped exactly right."""
    parts = [(constant(SEQ_1), 6, False), (constant(SEQ_2), 4, True), (seq_3, 2, True)]
    truth = np.repeat([0, 1, 2], [6, 4, 2])
    for groups in ("3", "auto"):
        for decision in DECISIONS:
            right = [
                np.array_equal(judge(demos, decision, groups).groups, truth)
                for demos, _ in tea(parts, pools, 20)
            ]
            print(f"6 + 4 + 2, groups {groups}, {decision}: right in {np.mean(right):.2f}")


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", help="folder of the data sets")
    parser.add_argument("--pools", type=int, default=50, help="random pools per row")
    parser.add_argument("--drawn", type=int, default=500, help="fresh drawn pools")
    arguments = parser.parse_args()
    fresh(arguments.drawn)
    table(tea_rows(arguments.pools), DECISIONS)
    three_kinds(arguments.pools)
    if arguments.folder is not None:
        table(folder_rows(arguments.folder, arguments.pools), DECISIONS)
    return 0


if __name__ == "__main__":
    sys.exit(main())
