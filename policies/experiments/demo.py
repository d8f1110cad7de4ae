"""The whole method on a small pool: pool -> filter -> two policies -> scores -> report.

The question (the paper, section 4.3): is a policy better without the demonstrations that the filter
flags? The labels of the pool are read only to score the filter.
"""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from filtering.config import FilterConfig
from filtering.demo_filter import FEWEST_DEMOS, DemoFilter
from filtering.output import write_filter_output
from filtering.report import ReportSection, render_report
from filtering.report.views import demo_views
from policies.checkpoint import save_policy
from policies.data.demos import DemosConfig, load_decisions
from policies.data.samples import DecisionSamples
from policies.data.weighting import demo_weights
from policies.experiments.generating import generate_pool
from policies.experiments.score_section import score_section, sentences
from policies.learners.bc_rnn import BCRNN, BCRNNConfig
from policies.learners.subtask_policy import SubtaskPolicy
from policies.play.evaluation import Scores, evaluate_all
from policies.play.results import as_json
from policies.play.results import summary as rates
from policies.settings import DemoSettings, EvaluationConfig
from teasim.common import parallel
from teasim.common.errors import ConfigError
from teasim.common.files import check_new_folder, write_json
from teasim.pool import Pool
from teasim.pool.weight_table import read_weight_table

ALL = "all demonstrations"
KEPT = "without the flagged"


@dataclass(frozen=True)
class DemoResult:
    """Result of the demo."""

    flagged: tuple[int, ...]
    """Episodes the filter flagged."""
    incorrect: tuple[int, ...]
    """Episodes that are incorrect by their labels."""
    scores: Mapping[str, Mapping[str, Scores]]
    """Training set -> mode -> scores; one training set if the filter flags none or all."""
    seconds: Mapping[str, float]
    """Wall time of each stage [s]."""


class Stopwatch:
    """Wall time of stages that follow one another."""

    def __init__(self) -> None:
        """Start now."""
        self.seconds: dict[str, float] = {}
        self._began = time.perf_counter()

    def lap(self, stage: str) -> None:
        """End `stage` and start the next."""
        now = time.perf_counter()
        self.seconds[stage] = round(now - self._began, 1)
        self._began = now


def run_demo(settings: DemoSettings) -> str:
    """Run everything in the new folder `settings.out` and return the summary to print.

    Raises:
        ConfigError: the folder is in use, or the pool would be too small to filter.
        TeasimError: the pool could not be generated.
    """
    trial = EvaluationConfig(settings.episodes, environment=settings.environment)
    check_size(settings)
    check_new_folder(settings.out)
    out, workers, watch = settings.out, settings.workers, Stopwatch()
    counts = {name: getattr(settings, name) for name in ("seq1", "seq3", "seed")}
    pool = generate_pool(out / "pool", counts, workers)
    watch.lap("generate")
    fitted = DemoFilter(FilterConfig(segmenter=settings.segmenter))
    fitted.fit(pool, workers=workers)
    write_filter_output(out / "filter", pool, fitted)
    watch.lap("filter")
    sets = training_sets(pool, out / "filter" / "weights.csv")
    policies = train_policies(pool, sets, settings)
    watch.lap("train")
    found = evaluate_all(list(policies.values()), trial, workers=workers)
    scores = dict(zip(policies, found, strict=True))
    watch.lap("evaluate")
    result = DemoResult(
        tuple(row.episode_index for row in fitted.table() if row.flagged),
        tuple(e.index for e in pool.episodes if e.record is not None and not e.record.correct),
        scores,
        watch.seconds,
    )
    write_report(out / "report.html", pool, fitted, result)
    write_json(out / "demo.json", as_record(result, settings))
    return summary(result, out)


def check_size(settings: DemoSettings) -> None:
    """Raise ConfigError for numbers of demonstrations that cannot be filtered."""
    seq1, seq3 = settings.seq1, settings.seq3
    if min(seq1, seq3) < 0 or seq1 + seq3 < FEWEST_DEMOS:
        raise ConfigError(
            f"The demo needs {FEWEST_DEMOS} demonstrations or more, "
            f"not --seq1 {seq1} --seq3 {seq3}."
        )
    if seq3 >= seq1:
        raise ConfigError(
            f"--seq3 {seq3} is not fewer than --seq1 {seq1}, but the filter takes "
            "what most demonstrations do for correct; ask for fewer incorrect ones."
        )


def training_sets(pool: Pool, table: Path) -> dict[str, NDArray[np.float64]]:
    """Weights (D,) of all of `pool`, and of what is left without the flagged demonstrations.

    The second is missing if the filter flags none, or all.
    """
    sets = {ALL: demo_weights(pool, table, "ignore")}
    if len({row.flagged for row in read_weight_table(table)}) == 2:
        sets[KEPT] = demo_weights(pool, table, "discard")
    return sets


def train_policies(
    pool: Pool, sets: Mapping[str, NDArray[np.float64]], settings: DemoSettings
) -> dict[str, SubtaskPolicy]:
    """Clone behaviour from each of the training `sets` and save the policies.

    The policies are recurrent, and see the pictures of all cameras and the joint positions.
    """
    samples = load_decisions(pool, DemosConfig("pixels_agent_pos"), workers=settings.workers)
    config = BCRNNConfig(seed=settings.seed)
    fit = partial(_fit, samples, config)
    learned = parallel.run(
        fit, list(sets.values()), workers=settings.workers, description="policies"
    )
    policies = dict(zip(sets, learned, strict=True))
    for name, policy in policies.items():
        weights = sets[name].tolist()
        training = {"learner": "bc-rnn", "settings": asdict(config), "weights": weights}
        run = settings.out / "policies" / name.replace(" ", "_")
        save_policy(policy, run, training=training)
    return policies


def _fit(
    samples: DecisionSamples, config: BCRNNConfig, weights: NDArray[np.float64]
) -> SubtaskPolicy:
    return BCRNN(config).fit(samples, weights).policy_


def write_report(path: Path, pool: Pool, fitted: DemoFilter, result: DemoResult) -> None:
    """Write the filter's report with a section on the scores of the policies."""
    render_report(
        path,
        demos=demo_views(pool, fitted, path.parent),
        threshold=fitted.threshold_,
        subtasks=fitted.segments_.subtasks,
        sections=[ReportSection("What that does to a policy", score_section(result.scores))],
    )


def as_record(result: DemoResult, settings: DemoSettings) -> dict[str, Any]:
    """Return the settings and the result as JSON can hold them."""
    config = {k: v for k, v in asdict(settings).items() if k not in ("out", "workers")}
    return {
        "version": version("teasim"),
        "config": config,
        "flagged": result.flagged,
        "incorrect": result.incorrect,
        "scores": {name: as_json(by_mode) for name, by_mode in result.scores.items()},
        "seconds": result.seconds,
    }


def summary(result: DemoResult, out: Path) -> str:
    """Write in a few lines what was found and where the report is."""
    missed = sorted(set(result.incorrect) - set(result.flagged))
    wrong = sorted(set(result.flagged) - set(result.incorrect))
    lines = [
        f"flagged:    {_listed(result.flagged)}",
        f"incorrect:  {_listed(result.incorrect)}   (by the labels of the pool)",
        f"missed:     {_listed(missed)}   falsely flagged: {_listed(wrong)}",
        *(f"policy on {name}:\n{rates(by_mode)}" for name, by_mode in result.scores.items()),
        *sentences(result.scores),
        f"report:     {out / 'report.html'}",
    ]
    return "\n".join(lines)


def _listed(episodes: tuple[int, ...] | list[int]) -> str:
    return ", ".join(map(str, episodes)) or "none"
