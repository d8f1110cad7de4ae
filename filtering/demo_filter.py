"""The filter as figure 1 of the paper draws it: segments, features, weights, threshold."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.background import subtraction_named
from filtering.explain import Finding, explain, find_strange_steps
from filtering.features.description import POOLED, check_description, describe_segments
from filtering.features.reduction import reduce_features
from filtering.frames import chosen_cameras, main_camera
from filtering.segmentation.segmenter import segmenter_named
from filtering.segmentation.segments import Segmentation
from filtering.sequence import transitions
from filtering.thresholds import GROUPS
from filtering.verdict import Verdict, judge_named
from filtering.weights.problem import Problem
from filtering.weights.score import score
from filtering.weights.solvers import Solution, solver_named
from filtering.weights.steps import StepCounts, StepList, count_steps
from teasim.errors import ConfigError
from teasim.pool import Pool
from teasim.pool.weight_table import WeightRow

FEWEST_DEMOS = 3
"""With fewer demonstrations there is no majority to agree with."""


@dataclass(frozen=True)
class FilterConfig:
    """How a pool is filtered."""

    segmenter: str = "truth"
    """Where segments come from: truth (the labels logged in the pool), clustering (the videos
    alone), or the folder of a fitted segmenter; the last two read no logged label."""
    subtasks: str = "auto"
    """Number of sub-tasks that clustering looks for; auto finds it out."""
    score: str = "norm"
    """What demonstrations are judged by: norm (omissions, order and next steps against what most
    of the pool does) or equation3 (the paper's next-step model)."""
    solver: str = "annealed"
    """Solver of equation 3: annealed."""
    groups: str = "auto"
    """Number of groups: auto, 1 (nothing is flagged), 2 or 3."""
    cameras: tuple[str, ...] = ()
    """Cameras whose pictures are used; empty means the main one."""
    frames_per_segment: int = 64
    """Most frames looked at in a segment (paper section 3.2)."""
    background: str = "median"
    """Background subtraction: none, median or mog2."""
    features: str = POOLED
    """What describes a segment: pooled (nothing is learned), or the folder of a segmenter that was
    fitted with features (they keep to the camera, frames and background they were learned from)."""
    trusted_share: float = 0.5
    """M / D, share of demonstrations that equation 3 trusts."""
    ridge: float = 0.01
    """Strength of the penalty on lambda [nats per unit squared]."""

    def __post_init__(self) -> None:
        """Refuse settings that name nothing or are out of range.

        Raises:
            ConfigError: in one sentence, with the choices.
        """
        segmenter_named(self.segmenter, self.subtasks)
        judge_named(self.score)
        solver_named(self.solver)
        subtraction_named(self.background)
        check_description(self.features)
        if self.groups not in GROUPS:
            raise ConfigError(
                f"Unknown number of groups '{self.groups}'; choose {', '.join(GROUPS)}."
            )
        if self.frames_per_segment < 1:
            raise ConfigError(f"frames_per_segment is {self.frames_per_segment}; choose 1 or more.")
        if not 0.0 < self.trusted_share < 1.0:
            raise ConfigError(
                f"trusted_share is {self.trusted_share}; choose a share between 0 and 1."
            )
        if not self.ridge > 0.0:
            raise ConfigError(f"ridge is {self.ridge}; choose a number above 0.")


class DemoFilter:
    """Gives every demonstration of a pool a weight, without reading whether it is correct.

    After `fit`, in the order of `pool.episodes`:
        weights_ (D,): in [0, 1], 1 for a usual demonstration.
        losses_ (D,): surprise [nats], higher is worse.
        flagged_ (D,): True where it is called incorrect.
        groups_ (D,): group, 0 is the best.
        reasons_: a sentence for each flagged demonstration, else "".
        findings_: strange steps of each demonstration, the worst first.
        threshold_: weight below which a demonstration is flagged, 0 when nothing is.
        trust_ (D,): w of equation 3, in [0, 1], sum M.
        objective_: value of equation 3 [nats per step]; trusted_: M.
        segments_: the segments used.
        cameras_: the cameras used.
        timings_: seconds per stage.
    """

    weights_: NDArray[np.float64]
    losses_: NDArray[np.float64]
    flagged_: NDArray[np.bool_]
    groups_: NDArray[np.int64]
    reasons_: tuple[str, ...]
    findings_: tuple[tuple[Finding, ...], ...]
    threshold_: float
    trust_: NDArray[np.float64]
    objective_: float
    trusted_: float
    segments_: Segmentation
    cameras_: tuple[str, ...]
    timings_: dict[str, float]

    def __init__(self, config: FilterConfig | None = None) -> None:
        """Prepare a filter; without `config` with the default settings."""
        self.config = FilterConfig() if config is None else config

    def fit(self, pool: Pool, *, jobs: int = 1) -> Self:
        """Weigh the demonstrations of `pool`, which is not modified.

        Args:
            pool: what to filter.
            jobs: worker processes that look at videos; the result does not depend on it.

        Raises:
            ConfigError: the pool has too few demonstrations, or no camera of that name.
            PoolError: the pool is damaged or has no labelled sub-tasks.
        """
        config = self.config
        self.timings_ = {}
        self._check(pool)
        self.cameras_ = chosen_cameras(pool, config.cameras) or (main_camera(pool),)
        with self._timed("segments"):
            segmenter = segmenter_named(config.segmenter, config.subtasks, self.cameras_)
            self.segments_ = segmenter(pool, jobs=jobs)
        with self._timed("features"):
            features = describe_segments(
                config.features,
                pool,
                self.segments_.spans,
                cameras=self.cameras_,
                frames_per_segment=config.frames_per_segment,
                background=config.background,
                jobs=jobs,
            )
        # The matrices are small: more BLAS threads only wait for each other.
        with self._timed("weights"), threadpool_limits(limits=1, user_api="blas"):
            rows = transitions(
                reduce_features(features), self.segments_.labels(), len(self.segments_.subtasks)
            )
            problem = Problem(rows, config.ridge)
            self.trusted_ = config.trusted_share * len(pool.episodes)
            solution = solver_named(config.solver)(problem, self.trusted_)
            surprises = score(problem, solution)
            judge = judge_named(config.score)
            self._learn(solution, judge(self._counts(), surprises, config.groups))
        findings = find_strange_steps(
            rows, surprises, self.segments_.spans, self.segments_.subtasks
        )
        self.findings_ = tuple(findings)
        self.reasons_ = tuple(
            explain(found, pool.fps) if flagged else ""
            for found, flagged in zip(findings, self.flagged_, strict=True)
        )
        self._identify(pool)
        return self

    def table(self) -> tuple[WeightRow, ...]:
        """Return the weight table (contract 2), one row per demonstration."""
        return tuple(
            WeightRow(
                demo_id=demo_id,
                episode_index=index,
                weight=float(self.weights_[row]),
                loss=float(self.losses_[row]),
                flagged=bool(self.flagged_[row]),
                group=int(self.groups_[row]),
                reason=self.reasons_[row],
            )
            for row, (demo_id, index) in enumerate(self._identities)
        )

    def _check(self, pool: Pool) -> None:
        count = len(pool.episodes)
        if count < FEWEST_DEMOS:
            raise ConfigError(
                f"The pool '{pool.root}' has {count} demonstrations; a filter needs "
                f"{FEWEST_DEMOS} or more."
            )
        if self.config.groups != "auto" and int(self.config.groups) > count:
            raise ConfigError(
                f"{self.config.groups} groups were asked for but there are only {count} "
                "demonstrations."
            )

    def _counts(self) -> StepCounts:
        demos = [
            StepList(tuple(labels), tuple(span.stop - span.start for span in spans))
            for labels, spans in zip(self.segments_.labels(), self.segments_.spans, strict=True)
        ]
        return count_steps(demos, len(self.segments_.subtasks))

    def _learn(self, solution: Solution, verdict: Verdict) -> None:
        self.weights_ = verdict.weights
        self.losses_ = verdict.losses
        self.trust_ = solution.weights
        self.objective_ = solution.objective
        self.groups_ = verdict.grouping.groups
        self.flagged_ = verdict.grouping.flagged
        self.threshold_ = verdict.grouping.threshold

    def _identify(self, pool: Pool) -> None:
        self._identities = [(episode.demo_id, episode.index) for episode in pool.episodes]

    @contextmanager
    def _timed(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.timings_[stage] = time.perf_counter() - start
