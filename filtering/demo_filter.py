"""The filter of figure 1 of the paper: segments, features, weights, threshold."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.config import AGREEMENT, CLUSTERING, COMBINED, MOMENTS, FilterConfig
from filtering.effects.logged import log_surprises
from filtering.effects.rests import changes, look_at_rests
from filtering.effects.surprise import effect_surprises
from filtering.features.config import POOLED
from filtering.features.extraction import segment_features
from filtering.features.reduction import reduce_features
from filtering.judging.evidence import Evidence
from filtering.judging.explain import ODD, Finding, explain, kept_though
from filtering.judging.judgement import Judgement
from filtering.judging.judges import judge_named
from filtering.judging.summary import PoolSummary, summarise
from filtering.judging.thresholds import DIGITS, group_weights, probability_incorrect
from filtering.segmentation.segmenter import segmenter_named
from filtering.segmentation.segments import Segmentation, labels_at
from filtering.vision.frame_features import FrameSource
from filtering.vision.frames import chosen_cameras, frame_rate, main_camera
from teasim.common.errors import ConfigError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool.selection import task_line
from teasim.pool.soundness import require_sound
from teasim.pool.source import Source
from teasim.pool.weight_table import WeightRow

if TYPE_CHECKING:
    from filtering.judging.decision.decide import PoolDecision
    from filtering.moments.score import MomentScore
    from filtering.moments.suitable import Comparable

FEWEST_DEMOS = 3
"""Least number of demonstrations; fewer have no majority."""
FEW_DEMOS = 4
"""Number of demonstrations up to which `caution` warns of the limits of the result."""
TOO_SHORT = "Some videos are too short for moments, so that only the found sub-tasks are judged."
"""Note on a pool with videos of few moments."""
NOT_THE_SAME = (
    "The sub-tasks that the segmenter '{}' finds are not the same in all videos; those that "
    "clustering finds are judged instead."
)
"""Note on a pool whose segmenter is not confirmed by the counterparts of moments."""
COST_UNUSED = (
    "The cost of a miss was not used: it is for the learned decision, which did not judge."
)
"""Note on a cost that was given in vain."""
ABOUT_PICTURES = ("cameras", "frames_per_segment", "background", "features", "backbone")
"""Settings that need pictures."""


def caution(count: int) -> str | None:
    """Return a warning for a small pool of `count` demonstrations, None for a larger one.

    Of three demonstrations, a cut between clusters does not even flag one that lacks a step.
    """
    if count > FEW_DEMOS:
        return None
    return (
        f"With {count} demonstrations a majority is {count // 2 + 1}: a mistake that 2 of them "
        "share looks like usual behaviour, and even the mistake of a single one may not be flagged."
    )


def instead(usual: tuple[str, ...], used: tuple[str, ...]) -> str:
    """Return a note that other cameras are used than usual."""
    return (
        f"The pictures of {', '.join(usual)} show nothing that the videos have in common; "
        f"{', '.join(used)} is used instead."
    )


@dataclass(frozen=True)
class TaskFound:
    """What was found about one task of a pool of several."""

    name: str
    """The task."""
    rows: tuple[int, ...]
    """Positions of its demonstrations in the pool."""
    judged: bool
    """Whether they were judged; if not, all are kept."""
    words: tuple[str, ...]
    """Sentences about the task as a whole."""


class DemoFilter:
    """Gives every demonstration of a pool a weight; labels of correctness are never read.

    Ten step lists, of which the last one lacks a step:

        >>> import tempfile
        >>> from pathlib import Path
        >>> import numpy as np
        >>> from filtering import DemoFilter, FilterConfig
        >>> from teasim.pool.mstcn.folder import write_predictions
        >>> from teasim.pool.readers.registry import open_source
        >>> folder = Path(tempfile.mkdtemp())
        >>> usual, short = np.repeat([0, 1, 2], 5), np.repeat([0, 2], 5)
        >>> videos = {f"video_{n}": usual for n in range(9)} | {"video_9": short}
        >>> write_predictions(folder, ("boil", "pour", "stir"), videos, {}, {})
        >>> pool = open_source(folder)
        >>> fitted = DemoFilter(FilterConfig(segmenter="predictions")).fit(pool)
        >>> [pool.episodes[n].name for n in np.flatnonzero(fitted.flagged_)]
        ['video_9']
        >>> print(fitted.reasons_[9])
        After boil (frames 0-5) 'pour' was expected, 'stir' was seen at frame 5; 'pour' is missing \
from the whole video.

    After `fit`, in the order of `pool.episodes`:
        weights_ (D,): in [0, 1], 1 for a usual demonstration.
        losses_ (D,): surprise [nats], higher is worse.
        probabilities_ (D,): probability of being incorrect, of the learned decision or else of
            `probability_incorrect`.
        decision_: the learned decision; None where clusters decided.
        flagged_ (D,): True for demonstrations called incorrect.
        groups_ (D,): group, 0 is the best.
        group_names_: what each group has in common; empty where only the weights define it.
        reasons_: a sentence for each flagged demonstration, and for each kept one whose weight is
            below 0.8, else "".
        findings_: unusual steps of each demonstration, the most important one first.
        summary_: ways of carrying out the task, and risks of steps; None for the score moments.
        words_: sentences about the pool as a whole.
        tasks_: the tasks, where several were judged one by one; see `filtering.by_task`.
        threshold_: weight below which a demonstration is flagged; 0 when there is none.
        trust_ (D,): influence on the norm, in [0, 1]; w of equation 3, of sum M.
        objective_: value of equation 3 [nats per step]; None for another score.
        segments_: the segments used, or those shown with the score moments.
        chosen_: the settings with `auto` replaced by what it stands for in this pool.
        cameras_: cameras used for segments and states; effects use all cameras of the pool unless
            some are named.
        looked_at_: cameras whose pictures were looked at.
        effects_: whether segments were examined for what they change, in the pictures or, without
            them, in the log of the environment.
        timings_: seconds per stage.
    """

    weights_: NDArray[np.float64]
    losses_: NDArray[np.float64]
    probabilities_: NDArray[np.float64]
    decision_: "PoolDecision | None"
    flagged_: NDArray[np.bool_]
    groups_: NDArray[np.int64]
    group_names_: tuple[str, ...]
    reasons_: tuple[str, ...]
    findings_: tuple[tuple[Finding, ...], ...]
    summary_: PoolSummary | None
    words_: tuple[str, ...]
    tasks_: tuple[TaskFound, ...]
    threshold_: float
    trust_: NDArray[np.float64]
    objective_: float | None
    segments_: Segmentation
    chosen_: FilterConfig
    cameras_: tuple[str, ...]
    looked_at_: tuple[str, ...]
    effects_: bool
    timings_: dict[str, float]

    def __init__(self, config: FilterConfig | None = None) -> None:
        """Keep the settings; None means the defaults."""
        self.config = FilterConfig() if config is None else config

    def fit(self, pool: Source, *, workers: Workers = IN_PROCESS) -> Self:
        """Weigh the demonstrations of `pool`, which is not modified.

        Args:
            pool: what to filter.
            workers: where the work runs; the result does not depend on it.

        Raises:
            ConfigError: the pool has too few demonstrations, lacks a camera, or has no pictures
                although a setting needs them.
            UnsuitableError: nothing but videos is looked at, and they do not show one task.
            PoolError: the pool is damaged or has no labelled sub-tasks.
        """
        self.timings_, self._notes = {}, tuple[str, ...]()
        self.tasks_, self.effects_ = (), False
        self._check(pool)
        require_sound(pool)
        self.chosen_ = self.config.for_source(pool)
        self._knows_steps = self.chosen_.score != MOMENTS
        self.cameras_ = self._cameras(pool)
        self._seen: set[str] = set()
        self._learn(self._judge(pool, workers), pool.fps)
        self._sum_up()
        self.looked_at_ = tuple(camera for camera in pool.cameras if camera in self._seen)
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
                p_incorrect=float(self.probabilities_[row]),
                task=task,
            )
            for row, (demo_id, index, task) in enumerate(self._identities)
        )

    def _identify(self, pool: Source) -> None:
        """Keep what `table` says of each demonstration beside the verdict; a task is one line."""
        self._identities = [(e.demo_id, e.index, task_line(e)) for e in pool.episodes]

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
        """Return the cameras to use, none where there are no pictures."""
        if pool.cameras:
            return chosen_cameras(pool, self.config.cameras) or (main_camera(pool),)
        usual = {setting.name: setting.default for setting in fields(FilterConfig)}
        for name in ABOUT_PICTURES:
            if getattr(self.config, name) != usual[name]:
                raise ConfigError(
                    f"'{pool.root}' has no pictures; leave out {name}, which needs them."
                )
        return ()

    def _judge(self, pool: Source, workers: Workers) -> Judgement:
        score = self.chosen_.score
        if score not in (MOMENTS, COMBINED) and self.chosen_.segmenter != CLUSTERING:
            return self._by_segments(pool, workers)
        seen = self._compare(pool, workers)
        if score == MOMENTS:
            return self._by_moments(pool, seen, workers)
        if score == COMBINED:
            return self._by_both(pool, seen, workers)
        return self._by_segments(pool, workers)

    def _compare(self, pool: Source, workers: Workers) -> "Comparable":
        """Look at the videos; leave out cameras that show nothing that the videos have in common.

        Without a named camera the main one is used, or else the next one that is of use.
        """
        # Imported here because step lists need neither torch nor videos.
        from filtering.moments.score import look
        from filtering.moments.suitable import UnsuitableError, comparable

        others = () if self.config.cameras else pool.cameras
        trials = [chosen_cameras(pool, self.cameras_)]
        trials += [(camera,) for camera in others if camera not in self.cameras_]
        refusals: list[UnsuitableError] = []
        for cameras in trials:
            self._seen.update(cameras)
            with self._timed("features"):
                seen = look(pool, pool.episodes, cameras, workers=workers)
            try:
                with self._timed("moments"):
                    found = comparable(seen)
            except UnsuitableError as refusal:
                refusals.append(refusal)
                continue
            self.cameras_ = tuple(found.videos)
            self._notes = (instead(trials[0], cameras),) if refusals else found.notes
            return found
        raise refusals[0]

    def _by_both(self, pool: Source, seen: "Comparable", workers: Workers) -> Judgement:
        """Judge by sub-tasks and by moments; the graver verdict counts."""
        from filtering.judging.combined import CONFIRMED, combine, doubts, unless_alone

        by_segments = self._by_segments(pool, workers)
        if not seen.found:
            self._notes += (TOO_SHORT,)
            return self._cut(by_segments)
        by_moments, score = self._moments(pool, seen)
        by_segments, confirmed = self._by_confirmed(pool, by_segments, score, workers)
        against = doubts(confirmed, score.one_order)
        self._notes += against
        self._knows_steps = confirmed >= CONFIRMED
        norm = None if against else by_segments
        if norm and self.chosen_.segmenter == CLUSTERING:
            norm = unless_alone(norm, score.strengths, score.kept)
        return self._cut(combine(norm, by_moments, pool.fps, self.config.groups))

    def _confirmed(self, pool: Source, score: "MomentScore") -> float:
        """Return how far the counterparts of moments confirm the segments, at most 1."""
        from filtering.moments.confirmed import confirmation

        found = list(score.counterparts.values())
        lengths = [episode.length for episode in pool.episodes]
        labels = labels_at(self.segments_, lengths, found[0].lengths)
        return max(confirmation(one, labels) for one in found)

    def _by_confirmed(
        self, pool: Source, by_segments: Judgement, score: "MomentScore", workers: Workers
    ) -> tuple[Judgement, float]:
        """Return the judgement by sub-tasks, and how far counterparts confirm these.

        Sub-tasks of another segmenter that are not confirmed give way to those of clustering, if
        these are.
        """
        from filtering.judging.combined import CONFIRMED

        chosen, segments, confirmed = self.chosen_, self.segments_, self._confirmed(pool, score)
        if confirmed >= CONFIRMED or chosen.segmenter == CLUSTERING:
            return by_segments, confirmed
        self.chosen_ = replace(chosen, segmenter=CLUSTERING)
        by_clusters, again = self._by_segments(pool, workers), self._confirmed(pool, score)
        if again >= CONFIRMED:
            self._notes += (NOT_THE_SAME.format(chosen.segmenter),)
            return by_clusters, again
        self.chosen_, self.segments_ = chosen, segments
        return by_segments, confirmed

    def _by_moments(self, pool: Source, seen: "Comparable", workers: Workers) -> Judgement:
        """Judge by counterparts between the videos; segments only serve to show."""
        from filtering.segmentation.unlabelled.agreed import agreed_segments

        judgement, score = self._moments(pool, seen, self.config.groups)
        with self._timed("segments"):
            if self.chosen_.segmenter == AGREEMENT:
                lengths = [episode.length for episode in pool.episodes]
                self.segments_ = agreed_segments(score.counterparts, lengths)
            else:
                self.segments_ = self._segments(pool, workers)
        return self._cut(judgement)

    def _moments(
        self, pool: Source, seen: "Comparable", groups: str = "auto"
    ) -> "tuple[Judgement, MomentScore]":
        # Imported here because step lists need neither torch nor videos.
        from filtering.judging.moments import (
            Timeline,
            judge_moments,
            told_of_actors,
            told_of_looks,
        )

        episodes = pool.episodes
        timeline = Timeline([e.length for e in episodes], [e.name for e in episodes], pool.fps)
        with self._timed("moments"):
            judgement, score = judge_moments(seen, timeline, groups)
        self._notes += told_of_looks(score.looks, timeline.names)
        self._notes += told_of_actors(score.actors, timeline.names)
        return judgement, score

    def _cut(self, judgement: Judgement) -> Judgement:
        """Apply a threshold that was asked for."""
        if self.config.threshold == "auto":
            return judgement
        grouping = group_weights(judgement.weights, self.config.groups, self.config.threshold)
        return replace(judgement, grouping=grouping)

    def _by_segments(self, pool: Source, workers: Workers) -> Judgement:
        """Judge by the sub-tasks and what is seen of them."""
        with self._timed("segments"):
            self.segments_ = self._segments(pool, workers)
        with self._timed("features"):
            evidence = self._evidence(pool, workers)
        # The matrices are small: several BLAS threads would only wait for each other.
        with self._timed("weights"), threadpool_limits(limits=1, user_api="blas"):
            settings = self.chosen_
            if settings.score == COMBINED:
                settings = replace(settings, score="norm", groups="auto", threshold="auto")
            return judge_named(settings.score)(evidence, settings)

    def _segments(self, pool: Source, workers: Workers) -> Segmentation:
        chosen = self.chosen_
        segmenter = segmenter_named(chosen.segmenter, chosen.subtasks, self.cameras_)
        found = segmenter(pool, workers=workers)
        self._seen.update(found.cameras)
        return found

    def _evidence(self, pool: Source, workers: Workers) -> Evidence:
        """Return the evidence that the score uses."""
        found = self.segments_
        known = Evidence(
            found.subtasks, found.spans, reliability=found.reliability(), told=found.told
        )
        if self.chosen_.score == "equation3":
            return replace(known, states=self._states(pool, workers))
        ineffective = self._ineffective(pool, known, workers) if self.config.effects else None
        self.effects_ = ineffective is not None
        return replace(known, ineffective=ineffective)

    def _ineffective(
        self, pool: Source, known: Evidence, workers: Workers
    ) -> list[NDArray[np.float64]] | None:
        """Return per demonstration (q,): how surprisingly little each segment changed [nats].

        It is seen in the pictures or, without them, in the log of the environment, if there is one.
        """
        spans = self.segments_.spans
        if not pool.cameras:
            return log_surprises(pool, spans, known.labels)
        source = FrameSource(self.config.cameras or pool.cameras)
        self._seen.update(source.cameras)
        rests = look_at_rests(pool.episodes, spans, frame_rate(pool), source, workers=workers)
        return effect_surprises([changes(rest) for rest in rests], known.labels)

    def _states(self, pool: Source, workers: Workers) -> list[NDArray[np.float64]]:
        """Return per demonstration (q, N): features of its segments; one-hot without pictures."""
        if not pool.cameras:
            eye = np.eye(len(self.segments_.subtasks))
            return [eye[labels] for labels in self.segments_.labels()]
        spans = self.segments_.spans
        if self.config.features != POOLED:
            # Imported here because cached pooled features need no torch.
            from filtering.features.checkpoint import load_features

            learned = load_features(Path(self.config.features))
            self._seen.add(learned.look.camera)
            return reduce_features(learned.describe(pool, spans, workers=workers))
        self._seen.update(self.cameras_)
        features = segment_features(
            pool,
            spans,
            cameras=self.cameras_,
            frames_per_segment=self.config.frames_per_segment,
            background=self.config.background,
            workers=workers,
            backbone=self.config.network,
        )
        return reduce_features(features)

    def _learn(self, judgement: Judgement, fps: float | None) -> None:
        self.weights_ = judgement.weights
        self.losses_ = judgement.losses
        self.decision_ = judgement.decision
        self.probabilities_ = (
            probability_incorrect(judgement.losses)
            if judgement.probabilities is None
            else judgement.probabilities
        )
        self.trust_ = judgement.trust
        self.objective_ = judgement.objective
        self.groups_ = judgement.grouping.groups
        self.group_names_ = judgement.grouping.names
        self.flagged_ = judgement.grouping.flagged
        self.threshold_ = judgement.grouping.threshold
        self.findings_ = judgement.findings
        sentences = judgement.reasons or [
            explain(found, fps, judgement.otherwise) for found in judgement.findings
        ]
        self.reasons_ = tuple(
            sentence if flagged else kept_though(sentence) if weight < ODD else ""
            for sentence, flagged, weight in zip(
                sentences, self.flagged_, self.weights_.round(DIGITS), strict=True
            )
        )

    def _sum_up(self) -> None:
        """Say what holds for the pool as a whole."""
        self.summary_ = None
        if self._knows_steps:
            self.summary_ = summarise(self.segments_, self.weights_, self.flagged_, self.config)
        warning = caution(len(self.weights_))
        unused = self.config.cost != FilterConfig.cost and self.chosen_.decision != "learned"
        by_steps = self.summary_.words if self.summary_ else ()
        decided = [
            f"{words[0].upper()}{words[1:]}."
            for words in (self.decision_.words if self.decision_ else ())
        ]
        if self.chosen_.score == COMBINED:  # moments may see more than the found sub-tasks
            by_steps = tuple(
                words
                if words.startswith("No majority")
                else f"By the found sub-tasks: {words[0].lower()}{words[1:]}"
                for words in by_steps
            )
        self.words_ = (
            *self._notes,
            *decided,
            *by_steps,
            *([warning] if warning else []),
            *([COST_UNUSED] if unused else []),
        )

    @contextmanager
    def _timed(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.timings_[stage] = self.timings_.get(stage, 0.0) + time.perf_counter() - start
