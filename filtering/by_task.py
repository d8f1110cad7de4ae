"""Data sets of several tasks are judged task by task: what one needs, another lacks rightly."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from filtering.config import FilterConfig
from filtering.demo_filter import FEWEST_DEMOS, DemoFilter
from filtering.segmentation.segments import Segmentation
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Span
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


def tasks_of(pool: Source) -> dict[str, list[int]]:
    """Return per task, in the order of first occurrence, the numbers of its demonstrations."""
    found: dict[str, list[int]] = {}
    for number, episode in enumerate(pool.episodes):
        found.setdefault(episode.task, []).append(number)
    return found


def fit_by_task(config: FilterConfig, pool: Source, *, workers: Workers = IN_PROCESS) -> DemoFilter:
    """Judge the demonstrations of each task of a pool by themselves.

    Each gets the weights that it gets in a pool of its task alone. A task with too few
    demonstrations to be judged keeps them all, with weight 1 and a note. Where no task has enough,
    as where each demonstration is described in words of its own, all are judged together.

    Args:
        config: the settings.
        pool: what to filter.
        workers: where the work runs.

    Raises:
        ConfigError, PoolError: see `DemoFilter.fit`.
    """
    tasks = tasks_of(pool)
    judged = {task: rows for task, rows in tasks.items() if len(rows) >= FEWEST_DEMOS}
    if len(tasks) < 2 or not judged:
        return DemoFilter(config).fit(pool, workers=workers)
    require_sound(pool)
    fits = [
        DemoFilter(config).fit(Part(pool, [pool.episodes[n] for n in rows]), workers=workers)
        for rows in judged.values()
    ]
    joined = _joined(config, pool, judged, fits)
    joined.words_ += tuple(
        f"Too few demonstrations to judge, so that all are kept: {len(rows)} of the task '{task}'."
        for task, rows in tasks.items()
        if task not in judged
    )
    return joined


def _joined(
    config: FilterConfig,
    pool: Source,
    judged: Mapping[str, Sequence[int]],
    fits: Sequence[DemoFilter],
) -> DemoFilter:
    """Put the results of the tasks into one filter, in the order of the pool."""
    whole, count = DemoFilter(config), len(pool.episodes)
    places = list(judged.values())

    def spread(name: str, usual: Any) -> list[Any]:
        values = [usual] * count
        for rows, fit in zip(places, fits, strict=True):
            for row, value in zip(rows, getattr(fit, name), strict=True):
                values[row] = value
        return values

    for name, usual in USUAL.items():
        setattr(whole, name, np.array(spread(name, usual)))
    whole.reasons_, whole.findings_ = tuple(spread("reasons_", "")), tuple(spread("findings_", ()))
    whole.group_names_, whole.groups_ = _groups(fits, places, count)
    whole.chosen_, whole.cameras_ = fits[0].chosen_, fits[0].cameras_
    whole.decision_, whole.objective_, whole.summary_ = None, None, None
    whole.threshold_ = max(fit.threshold_ for fit in fits)
    whole.segments_ = _segments(judged, fits, count)
    looked_at = {camera for fit in fits for camera in fit.looked_at_}
    whole.looked_at_ = tuple(camera for camera in pool.cameras if camera in looked_at)
    whole.words_ = tuple(
        f"Task '{task}': {words}"
        for task, fit in zip(judged, fits, strict=True)
        for words in fit.words_
    )
    stages = dict.fromkeys(stage for fit in fits for stage in fit.timings_)
    whole.timings_ = {s: sum(fit.timings_.get(s, 0.0) for fit in fits) for s in stages}
    return whole


def _groups(
    fits: Sequence[DemoFilter], places: Sequence[Sequence[int]], count: int
) -> tuple[tuple[str, ...], NDArray[np.int64]]:
    """Return the names of all groups, the kept one first, and (D,) the group of each."""
    named = [fit.group_names_ or tuple(f"group {n}" for n in range(3)) for fit in fits]
    names = tuple(dict.fromkeys((named[0][0], *(name for each in named for name in each))))
    groups = np.zeros(count, dtype=np.int64)
    for rows, fit, each in zip(places, fits, named, strict=True):
        groups[list(rows)] = [names.index(each[g]) if g else 0 for g in fit.groups_]
    return names, groups


def _segments(
    judged: Mapping[str, Sequence[int]], fits: Sequence[DemoFilter], count: int
) -> Segmentation:
    """Return the segments of all; those that were found are named by their task too."""
    spans: list[tuple[Span, ...]] = [()] * count
    names: dict[str, None] = {}
    for (task, rows), fit in zip(judged.items(), fits, strict=True):
        found = fit.segments_
        new = {n: n if found.posteriors is None else f"{task}: {n}" for n in found.subtasks}
        names |= dict.fromkeys(new.values())
        for row, own in zip(rows, found.spans, strict=True):
            spans[row] = tuple(Span(new[s.subtask], s.start, s.stop) for s in own)
    return Segmentation(tuple(names), tuple(spans), cameras=fits[0].segments_.cameras)
