"""The main job, small, start to end: pool -> filter -> two policies -> scores -> report.

The question (the paper, section 4.3): is a policy better when the demonstrations that the filter
flags are left out? The labels of the pool are read for scoring the filter only.
"""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from importlib.metadata import entry_points, version
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
from policies.experiments.score_section import score_section, sentences
from policies.learners.bc_rnn import BCRNN, BCRNNConfig
from policies.learners.subtask_policy import SubtaskPolicy
from policies.play.evaluation import EvaluationConfig, Scores, evaluate_all
from policies.play.results import as_json
from policies.play.results import summary as rates
from policies.play.rollout import EnvironmentConfig
from teasim.common import parallel
from teasim.common.errors import ConfigError
from teasim.common.files import check_new_folder, write_json
from teasim.pool import Pool
from teasim.pool.weight_table import read_weight_table

ALL = "all demonstrations"
KEPT = "without the flagged"


@dataclass(frozen=True)
class DemoConfig:
    """Size and seed of the demo; the defaults take about three minutes on two cores."""

    seq1: int = 10
    """Correct demonstrations (Seq_1)."""
    seq3: int = 4
    """Incorrect demonstrations (Seq_3)."""
    episodes: int = 12
    """Evaluation episodes per policy and mode."""
    seed: int = 0
    """Seed of the pool, the filter and the learner."""
    frames_per_segment: int = 16
    """Frames the filter looks at in each segment; fewer than its default, for speed."""
    environment: EnvironmentConfig = field(
        default_factory=partial(EnvironmentConfig, max_actions=10)
    )
    """The world the policies are tried out in; 7 actions make tea, and who needs 3 more is lost."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a pool that cannot be filtered, or no episode."""
        if min(self.seq1, self.seq3) < 0 or self.seq1 + self.seq3 < FEWEST_DEMOS:
            raise ConfigError(
                f"The demo needs {FEWEST_DEMOS} demonstrations or more, "
                f"not --seq1 {self.seq1} --seq3 {self.seq3}."
            )
        if self.seq3 >= self.seq1:
            raise ConfigError(
                f"--seq3 {self.seq3} is not fewer than --seq1 {self.seq1}, but the filter takes "
                "what most demonstrations do for correct; ask for fewer incorrect ones."
            )
        EvaluationConfig(self.episodes)


@dataclass(frozen=True)
class Findings:
    """What the demo found out."""

    flagged: tuple[int, ...]
    """Episodes the filter flagged."""
    incorrect: tuple[int, ...]
    """Episodes that are incorrect by their labels."""
    scores: Mapping[str, Mapping[str, Scores]]
    """Training set -> mode -> scores; one training set if the filter leaves none or all."""
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


def run_demo(out: Path, config: DemoConfig, *, jobs: int) -> str:
    """Do everything in the new folder `out` and return the summary to print.

    Raises:
        ConfigError: `out` is in use.
        TeasimError: the pool could not be generated.
    """
    check_new_folder(out)
    watch = Stopwatch()
    pool = generate_pool(out / "pool", config, jobs)
    watch.lap("generate")
    fitted = DemoFilter(FilterConfig(frames_per_segment=config.frames_per_segment))
    fitted.fit(pool, jobs=jobs)
    write_filter_output(out / "filter", pool, fitted)
    watch.lap("filter")
    policies = train_policies(pool, out / "filter" / "weights.csv", out / "policies", config, jobs)
    watch.lap("train")
    trial = EvaluationConfig(episodes=config.episodes, environment=config.environment)
    found = evaluate_all(list(policies.values()), trial, jobs=jobs)
    scores = dict(zip(policies, found, strict=True))
    watch.lap("evaluate")
    findings = Findings(
        tuple(row.episode_index for row in fitted.table() if row.flagged),
        tuple(e.index for e in pool.episodes if e.record is not None and not e.record.correct),
        scores,
        watch.seconds,
    )
    write_report(out / "report.html", pool, fitted, findings)
    write_json(out / "demo.json", as_record(findings, config))
    return summary(findings, out)


def generate_pool(path: Path, config: DemoConfig, jobs: int) -> Pool:
    """Generate the pool by the verb of the command line: policies never import the world.

    Raises:
        TeasimError: what the verb says, in its own sentence.
    """
    (verb,) = entry_points(group="teasim.verbs", name="generate")
    numbers = {"seq1": config.seq1, "seq3": config.seq3, "seed": config.seed, "jobs": jobs}
    options = [word for name, number in numbers.items() for word in (f"--{name}", str(number))]
    verb.load()([str(path), *options])
    return Pool.open(path)


def train_policies(
    pool: Pool, table: Path, out: Path, config: DemoConfig, jobs: int
) -> dict[str, SubtaskPolicy]:
    """Clone behaviour from all of `pool`, and again without what the weight `table` flags.

    From the state, with a memory: what differs between the two is then what they were shown, not
    what can be made out in a picture. The second is left out where the filter flags nothing, or
    everything.
    """
    sets = {ALL: demo_weights(pool, table, "ignore")}
    if len({row.flagged for row in read_weight_table(table)}) == 2:
        sets[KEPT] = demo_weights(pool, table, "discard")
    samples = load_decisions(pool, DemosConfig(observe="state"), jobs=jobs)
    settings = BCRNNConfig(seed=config.seed)
    fit = partial(_fit, samples, settings)
    learned = parallel.run(fit, list(sets.values()), jobs=jobs, description="policies")
    policies = dict(zip(sets, learned, strict=True))
    for name, policy in policies.items():
        weights = sets[name].tolist()
        training = {"learner": "bc-rnn", "settings": asdict(settings), "weights": weights}
        save_policy(policy, out / name.replace(" ", "_"), training=training)
    return policies


def _fit(
    samples: DecisionSamples, config: BCRNNConfig, weights: NDArray[np.float64]
) -> SubtaskPolicy:
    return BCRNN(config).fit(samples, weights).policy_


def write_report(path: Path, pool: Pool, fitted: DemoFilter, findings: Findings) -> None:
    """Write the filter's page with the policies' scores at its end."""
    render_report(
        path,
        demos=demo_views(pool, fitted),
        threshold=fitted.threshold_,
        subtasks=fitted.segments_.subtasks,
        sections=[ReportSection("What that does to a policy", score_section(findings.scores))],
    )


def as_record(findings: Findings, config: DemoConfig) -> dict[str, Any]:
    """Everything that was found, as JSON can hold it."""
    return {
        "version": version("teasim"),
        "config": asdict(config),
        "flagged": findings.flagged,
        "incorrect": findings.incorrect,
        "scores": {name: as_json(by_mode) for name, by_mode in findings.scores.items()},
        "seconds": findings.seconds,
    }


def summary(findings: Findings, out: Path) -> str:
    """Say in a few lines what was found and where to read on."""
    missed = sorted(set(findings.incorrect) - set(findings.flagged))
    wrong = sorted(set(findings.flagged) - set(findings.incorrect))
    lines = [
        f"flagged:    {_listed(findings.flagged)}",
        f"incorrect:  {_listed(findings.incorrect)}   (by the labels of the pool)",
        f"missed:     {_listed(missed)}   falsely flagged: {_listed(wrong)}",
        *(f"policy on {name}:\n{rates(by_mode)}" for name, by_mode in findings.scores.items()),
        *sentences(findings.scores),
        f"report:     {out / 'report.html'}",
    ]
    return "\n".join(lines)


def _listed(episodes: tuple[int, ...] | list[int]) -> str:
    return ", ".join(map(str, episodes)) or "none"
