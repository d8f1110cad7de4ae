"""The filter as figure 1 of the paper draws it: segments, features, weights, threshold."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.config import FilterConfig
from filtering.effects.rests import changes, look_at_rests
from filtering.effects.surprise import effect_surprises
from filtering.features.description import describe_segments
from filtering.features.reduction import reduce_features
from filtering.judging.explain import Finding, explain
from filtering.judging.thresholds import probability_incorrect
from filtering.judging.verdict import Evidence, Verdict, judge_named
from filtering.segmentation.segmenter import segmenter_named
from filtering.segmentation.segments import Segmentation
from filtering.vision.frame_features import FrameSource
from filtering.vision.frames import chosen_cameras, frame_rate, main_camera
from teasim.common.errors import ConfigError
from teasim.pool.soundness import require_sound
from teasim.pool.source import Source
from teasim.pool.weight_table import WeightRow

FEWEST_DEMOS = 3
"""With fewer demonstrations there is no majority to agree with."""
FEW_DEMOS = 4
"""With so few or fewer, what can be said of them has a limit that is told: `caution`."""
ABOUT_PICTURES = ("cameras", "frames_per_segment", "background", "features")
"""Settings that mean nothing for step lists."""


def caution(count: int) -> str | None:
    """Return what cannot be said of a pool of `count` demonstrations, None if it is large enough.

    The score `norm` leaves even one missing step of one in three unflagged.
    """
    if count > FEW_DEMOS:
        return None
    return (
        f"With {count} demonstrations a majority is {count // 2 + 1}: a mistake that 2 of them "
        "share cannot be told from what is usual, and even that of a single one may not be flagged."
    )


class DemoFilter:
    """Gives every demonstration of a pool a weight, without reading whether it is correct.

    After `fit`, in the order of `pool.episodes`:
        weights_ (D,): in [0, 1], 1 for a usual demonstration.
        losses_ (D,): surprise [nats], higher is worse.
        probabilities_ (D,): of being incorrect, see `thresholds.probability_incorrect`.
        flagged_ (D,): True where it is called incorrect.
        groups_ (D,): group, 0 is the best.
        group_names_: what each group has in common; empty where only the weights tell.
        reasons_: a sentence for each flagged demonstration, else "".
        findings_: strange steps of each demonstration, the one that is named first.
        threshold_: weight below which a demonstration is flagged, 0 when nothing is.
        trust_ (D,): how much it shapes what is usual, in [0, 1]; w of equation 3 sums to M.
        objective_: value of equation 3 [nats per step]; None for another score.
        segments_: the segments used.
        cameras_: those whose pictures show segments and states; effects are looked at in all
            cameras of the pool unless some are named.
        timings_: seconds per stage.
    """

    weights_: NDArray[np.float64]
    losses_: NDArray[np.float64]
    probabilities_: NDArray[np.float64]
    flagged_: NDArray[np.bool_]
    groups_: NDArray[np.int64]
    group_names_: tuple[str, ...]
    reasons_: tuple[str, ...]
    findings_: tuple[tuple[Finding, ...], ...]
    threshold_: float
    trust_: NDArray[np.float64]
    objective_: float | None
    segments_: Segmentation
    cameras_: tuple[str, ...]
    timings_: dict[str, float]

    def __init__(self, config: FilterConfig | None = None) -> None:
        """Prepare a filter; without `config` with the default settings."""
        self.config = FilterConfig() if config is None else config

    def fit(self, pool: Source, *, jobs: int = 1) -> Self:
        """Weigh the demonstrations of `pool`, which is not modified.

        Args:
            pool: what to filter.
            jobs: worker processes that look at videos; the result does not depend on it.

        Raises:
            ConfigError: the pool has too few demonstrations, no camera of that name, or no pictures
                where a setting is about them.
            PoolError: the pool is damaged or has no labelled sub-tasks.
        """
        self.timings_ = {}
        self._check(pool)
        require_sound(pool)
        self.cameras_ = self._cameras(pool)
        with self._timed("segments"):
            self.segments_ = self._segments(pool, jobs)
        with self._timed("features"):
            evidence = self._evidence(pool, jobs)
        # The matrices are small: more BLAS threads only wait for each other.
        with self._timed("weights"), threadpool_limits(limits=1, user_api="blas"):
            self._learn(judge_named(self.config.score)(evidence, self.config.rule()))
        self.reasons_ = tuple(
            explain(found, pool.fps) if flagged else ""
            for found, flagged in zip(self.findings_, self.flagged_, strict=True)
        )
        self._identities = [(episode.demo_id, episode.index) for episode in pool.episodes]
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

    def _check(self, pool: Source) -> None:
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

    def _cameras(self, pool: Source) -> tuple[str, ...]:
        """Return the cameras to look at, none where there are no pictures."""
        if pool.cameras:
            return chosen_cameras(pool, self.config.cameras) or (main_camera(pool),)
        for setting in ABOUT_PICTURES:
            if getattr(self.config, setting) != getattr(FilterConfig, setting):
                raise ConfigError(
                    f"'{pool.root}' has no pictures, which {setting} is about; leave it out."
                )
        return ()

    def _segments(self, pool: Source, jobs: int) -> Segmentation:
        segmenter = segmenter_named(self.config.segmenter, self.config.subtasks, self.cameras_)
        return segmenter(pool, jobs=jobs)

    def _evidence(self, pool: Source, jobs: int) -> Evidence:
        """Return what the score asks for; looking at pictures is what takes time."""
        known = Evidence(self.segments_.subtasks, self.segments_.spans)
        if self.config.score == "equation3":
            return replace(known, states=self._states(pool, jobs))
        if self.config.effects and pool.cameras:
            return replace(known, idle=self._idle(pool, known, jobs))
        return known

    def _idle(self, pool: Source, known: Evidence, jobs: int) -> list[NDArray[np.float64]]:
        """Return per demonstration (q,): surprise that so little came of each segment [nats]."""
        source = FrameSource(self.config.cameras or pool.cameras)
        rests = look_at_rests(
            pool.episodes, self.segments_.spans, frame_rate(pool), source, jobs=jobs
        )
        return effect_surprises([changes(rest) for rest in rests], known.labels)

    def _states(self, pool: Source, jobs: int) -> list[NDArray[np.float64]]:
        """Return per demonstration (q, N): what its segments look like, else which they are."""
        if not pool.cameras:
            eye = np.eye(len(self.segments_.subtasks))
            return [eye[labels] for labels in self.segments_.labels()]
        features = describe_segments(
            self.config.features,
            pool,
            self.segments_.spans,
            cameras=self.cameras_,
            frames_per_segment=self.config.frames_per_segment,
            background=self.config.background,
            jobs=jobs,
        )
        return reduce_features(features)

    def _learn(self, verdict: Verdict) -> None:
        self.weights_ = verdict.weights
        self.losses_ = verdict.losses
        self.probabilities_ = probability_incorrect(verdict.losses)
        self.trust_ = verdict.trust
        self.objective_ = verdict.objective
        self.groups_ = verdict.grouping.groups
        self.group_names_ = verdict.grouping.names
        self.flagged_ = verdict.grouping.flagged
        self.threshold_ = verdict.grouping.threshold
        self.findings_ = verdict.findings

    @contextmanager
    def _timed(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.timings_[stage] = time.perf_counter() - start
