"""Outcomes of episodes at either level: the goal, violations, and which sub-tasks took effect."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from teasim.common.statistics import Rate, rate


@dataclass(frozen=True, kw_only=True)
class Played:
    """What the environment reported of an episode; subclasses add what the policy did."""

    seed: int
    """Seed of the environment and of sampled decisions."""
    success: bool
    """Whether the goal was reached."""
    subtasks_done: tuple[str, ...]
    """Sub-tasks that took effect, in order."""
    violations: tuple[str, ...]
    """Keys of the violations, as the environment reports them."""
    kinds: dict[str, bool]
    """Per kind of violation, in the environment's words: whether it occurred."""


@dataclass(frozen=True)
class Outcomes:
    """Outcomes of the episodes of one mode; all rates with 95 % intervals."""

    mode: str
    """`deterministic` or `sampled` decisions."""
    success: Rate
    """Share of episodes that reach the goal."""
    completion: dict[str, Rate]
    """Per sub-task: share of episodes in which it took effect."""
    violations: dict[str, Rate]
    """Per kind of violation, in the environment's words: share of episodes in which it occurred."""
    violation_counts: dict[str, int]
    """Per key of a violation: number of episodes in which it occurred."""


def tally(mode: str, episodes: Sequence[Played], subtasks: Sequence[str]) -> dict[str, Any]:
    """Return the fields of `Outcomes` for `episodes`."""
    count = len(episodes)
    keys = Counter(key for episode in episodes for key in set(episode.violations))
    kinds = dict.fromkeys(kind for episode in episodes for kind in episode.kinds)

    def share(happened: Sequence[bool]) -> Rate:
        return rate(sum(happened), count)

    return {
        "mode": mode,
        "success": share([e.success for e in episodes]),
        "completion": {n: share([n in e.subtasks_done for e in episodes]) for n in subtasks},
        "violations": {kind: share([e.kinds.get(kind, False) for e in episodes]) for kind in kinds},
        "violation_counts": dict(sorted(keys.items())),
    }


def outcome_lines(outcomes: Outcomes) -> list[str]:
    """Write the outcomes in lines for the terminal."""
    rates = {"goal reached": outcomes.success, **outcomes.violations}
    return [
        *(f"  {words:<16} {rate}" for words, rate in rates.items()),
        *(f"  {subtask:<16} done in {done}" for subtask, done in outcomes.completion.items()),
    ]


def outcomes_json(outcomes: Outcomes) -> dict[str, Any]:
    """Turn outcomes into what JSON can hold; rates in percent."""
    return {
        "success": rate_json(outcomes.success),
        "completion": {name: rate_json(rate) for name, rate in outcomes.completion.items()},
        "violations": {words: rate_json(rate) for words, rate in outcomes.violations.items()},
        "violation_counts": outcomes.violation_counts,
    }


def rate_json(rate: Rate) -> dict[str, Any]:
    """Turn a rate into what JSON can hold, in percent; null without trials."""
    return {
        "percent": 100 * rate.value if rate.trials else None,
        "low_percent": 100 * rate.low,
        "high_percent": 100 * rate.high,
        "hits": rate.hits,
        "trials": rate.trials,
    }
