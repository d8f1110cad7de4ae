"""Data sets of several tasks are judged task by task: what one needs, another lacks rightly."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from filtering.config import AGREEMENT, CLUSTERING, FilterConfig
from filtering.demo_filter import FEWEST_DEMOS, DemoFilter, TaskFound
from filtering.judging.explain import Finding
from filtering.moments.suitable import UnsuitableError
from filtering.segmentation.segments import Segmentation
from teasim.common.errors import ConfigError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Span
from teasim.pool.selection import tasks_of
from teasim.pool.soundness import require_sound
from teasim.pool.source import Source
from teasim.pool.views.part import Part

USUAL = {
    "weights_": 1.0,
    "losses_": 0.0,
    "probabilities_": 0.0,
    "trust_": 1.0,
    "flagged_": False,
}
"""What is told of a demonstration that is not judged."""
MOST_NAMED = 10
"""Most tasks that a message names; a data set may have hundreds."""

Fits = Mapping[str, DemoFilter]
"""The filter of each task that was judged."""
Rows = Mapping[str, Sequence[int]]
"""Per task the positions of its demonstrations in the pool."""


def of_task(pool: Source, task: str) -> Source:
    """Return the demonstrations of one task.

    Raises:
        ConfigError: the pool has none.
        PoolError: the pool is damaged.
    """
    tasks = tasks_of(pool)
    if task not in tasks:
        named = [f"'{name}'" for name in tasks if name]
        more = f" and {len(named) - MOST_NAMED} more" if len(named) > MOST_NAMED else ""
        choices = f"choose from {', '.join(named[:MOST_NAMED])}{more}" if named else "it names none"
        raise ConfigError(f"'{pool.root}' has no task '{task}'; {choices}.")
    require_sound(pool)
    return Part(pool, [pool.episodes[row] for row in tasks[task]])


def fit_by_task(config: FilterConfig, pool: Source, *, workers: Workers = IN_PROCESS) -> DemoFilter:
    """Judge the demonstrations of each task of a pool by themselves.

    Each gets the weights that it gets in a pool of its task alone. A task that cannot be judged,
    because its demonstrations are too few or their videos do not show one task, keeps them all,
    with weight 1 and a reason. Where no task has enough, as where each demonstration is described
    in words of its own, all are judged together.

    Args:
        config: the settings.
        pool: what to filter.
        workers: where the work runs.

    Raises:
        ConfigError, PoolError: see `DemoFilter.fit`.
    """
    tasks = tasks_of(pool)
    enough = [task for task, rows in tasks.items() if len(rows) >= FEWEST_DEMOS]
    if len(tasks) < 2 or not enough:
        return DemoFilter(config).fit(pool, workers=workers)
    require_sound(pool)
    fits: dict[str, DemoFilter] = {}
    refusals: dict[str, UnsuitableError] = {}
    for task in enough:
        part = Part(pool, [pool.episodes[row] for row in tasks[task]])
        try:
            fits[task] = DemoFilter(config).fit(part, workers=workers)
        except UnsuitableError as refusal:
            refusals[task] = refusal
    if not fits:
        raise refusals[enough[0]]
    return _joined(config, pool, tasks, fits, refusals)


def _joined(
    config: FilterConfig,
    pool: Source,
    tasks: Rows,
    fits: Fits,
    refusals: Mapping[str, UnsuitableError],
) -> DemoFilter:
    """Put the results of the tasks into one filter, in the order of the pool."""
    whole, count, each = DemoFilter(config), len(pool.episodes), list(fits.values())

    def spread(usual: Any, found: Mapping[str, Sequence[Any]]) -> list[Any]:
        values = [usual] * count
        for task in fits:
            for row, value in zip(tasks[task], found[task], strict=True):
                values[row] = value
        return values

    for name, usual in USUAL.items():
        setattr(
            whole, name, np.array(spread(usual, {t: getattr(f, name) for t, f in fits.items()}))
        )
    whole.tasks_ = tuple(_task(task, rows, fits, refusals) for task, rows in tasks.items())
    reasons = spread("", {t: f.reasons_ for t, f in fits.items()})
    for task in whole.tasks_:
        for row in () if task.judged else task.rows:
            reasons[row] = task.words[0]
    whole.reasons_ = tuple(reasons)
    findings = {t: _findings(f, t, tasks[t]) for t, f in fits.items()}
    whole.findings_ = tuple(spread((), findings))
    whole.group_names_, whole.groups_ = _groups(tasks, fits, count)
    whole.chosen_ = each[0].chosen_
    whole.cameras_ = _cameras(pool, [fit.cameras_ for fit in each])
    whole.looked_at_ = _cameras(pool, [fit.looked_at_ for fit in each])
    whole.effects_ = any(fit.effects_ for fit in each)
    whole.decision_, whole.objective_, whole.summary_ = None, None, None
    whole.threshold_ = max(fit.threshold_ for fit in each)
    names = dict.fromkeys(
        name for task, fit in fits.items() for name in _step_names(fit, task).values()
    )
    spans = spread((), {t: _spans(f, t) for t, f in fits.items()})
    whole.segments_ = Segmentation(tuple(names), tuple(spans), cameras=each[0].segments_.cameras)
    whole.words_ = tuple(
        f"Task '{task.name}': {words}" if task.judged else words
        for task in sorted(whole.tasks_, key=lambda one: not one.judged)
        for words in task.words
    )
    stages = dict.fromkeys(stage for fit in each for stage in fit.timings_)
    whole.timings_ = {s: sum(fit.timings_.get(s, 0.0) for fit in each) for s in stages}
    whole._identify(pool)
    return whole


def _task(
    task: str, rows: Sequence[int], fits: Fits, refusals: Mapping[str, UnsuitableError]
) -> TaskFound:
    """Return what was found about a task, or why it was not judged."""
    name, words = " ".join(task.split()), ""
    if task in refusals:
        words = f"The task '{name}' is not judged, so that all of it is kept: {refusals[task]}"
    elif task not in fits:
        words = (
            "Too few demonstrations to judge, so that all are kept: "
            f"{len(rows)} of the task '{name}'."
        )
    told = (words,) if words else fits[task].words_
    return TaskFound(name, tuple(rows), judged=not words, words=told)


def _cameras(pool: Source, used: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return the cameras that any task used, in the order of the first and then of the pool."""
    some = {camera for cameras in used for camera in cameras}
    return tuple(dict.fromkeys((*used[0], *(c for c in pool.cameras if c in some))))


def _groups(tasks: Rows, fits: Fits, count: int) -> tuple[tuple[str, ...], NDArray[np.int64]]:
    """Return the names of all groups, the kept one first, and (D,) the group of each."""
    named = {
        task: fit.group_names_ or tuple(f"group {n}" for n in range(3))
        for task, fit in fits.items()
    }
    first = next(iter(named.values()))[0]
    names = tuple(dict.fromkeys((first, *(name for each in named.values() for name in each))))
    groups = np.zeros(count, dtype=np.int64)
    for task, fit in fits.items():
        groups[list(tasks[task])] = [names.index(named[task][g]) if g else 0 for g in fit.groups_]
    return names, groups


def _step_names(fit: DemoFilter, task: str) -> dict[str, str]:
    """Return what each sub-task is called in the whole; those found are numbered per task."""
    found = fit.chosen_.segmenter in (AGREEMENT, CLUSTERING)
    return {name: f"{task}: {name}" if found else name for name in fit.segments_.subtasks}


def _spans(fit: DemoFilter, task: str) -> list[tuple[Span, ...]]:
    """Return the segments of the demonstrations of a task, named as in the whole."""
    names = _step_names(fit, task)
    return [
        tuple(replace(span, subtask=names[span.subtask]) for span in spans)
        for spans in fit.segments_.spans
    ]


def _findings(fit: DemoFilter, task: str, rows: Sequence[int]) -> list[tuple[Finding, ...]]:
    """Return the findings about a task, with sub-tasks and demonstrations as in the whole."""
    names = _step_names(fit, task)

    def told(one: Finding) -> Finding:
        there = one.counterpart
        expected = one.expected and names.get(one.expected, one.expected)
        moved = there and replace(there, demo=rows[there.demo])
        return replace(one, expected=expected, counterpart=moved)

    return [tuple(told(one) for one in found) for found in fit.findings_]
