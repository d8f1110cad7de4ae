"""What episodes come to at any level: the goal, safety, and how often each sub-task took effect."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from teasim.common.statistics import Rate, rate

SPILL = "spilled_"
"""How the violations begin that say something was spilled."""


@dataclass(frozen=True)
class Outcomes:
    """What physics saw in episodes of one mode; all rates with 95 % intervals."""

    success: Rate
    """Share of episodes that reach the goal."""
    unsafe: Rate
    """Share of episodes that end with the oven on."""
    spills: Rate
    """Share of episodes in which something was spilled."""
    completion: dict[str, Rate]
    """Per sub-task: share of episodes in which it took effect."""
    violations: dict[str, int]
    """Per broken rule: number of episodes that broke it."""


class Played(Protocol):
    """An episode, whatever decided in it."""

    @property
    def success(self) -> bool:
        """The goal was reached."""

    @property
    def unsafe(self) -> bool:
        """The oven is on at the end."""

    @property
    def subtasks_done(self) -> tuple[str, ...]:
        """Sub-tasks that took effect, in order."""

    @property
    def violations(self) -> tuple[str, ...]:
        """Rules that were broken."""


def tally(episodes: Sequence[Played], subtasks: Sequence[str]) -> dict[str, Any]:
    """Return the fields of `Outcomes` for `episodes`."""
    count = len(episodes)
    rules = Counter(rule for episode in episodes for rule in set(episode.violations))
    spilled = [any(rule.startswith(SPILL) for rule in e.violations) for e in episodes]
    return {
        "success": rate(sum(episode.success for episode in episodes), count),
        "unsafe": rate(sum(episode.unsafe for episode in episodes), count),
        "spills": rate(sum(spilled), count),
        "completion": {
            name: rate(sum(name in episode.subtasks_done for episode in episodes), count)
            for name in subtasks
        },
        "violations": dict(sorted(rules.items())),
    }
