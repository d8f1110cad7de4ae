"""Two policies on the same episodes: a difference is judged seed by seed.

Both policies start in the same scenes, so the difficulty of a scene cancels. Goals reached and
violations are compared by McNemar's exact test, the policy accuracy by resampling the pairs of
episodes.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from policies.play.evaluation import Scores
from policies.play.rollout import Episode
from teasim.common.errors import ConfigError
from teasim.common.statistics import Difference, bootstrap_difference, mcnemar


@dataclass(frozen=True)
class Discordance:
    """Episodes in which an event occurred with one policy and not with the other."""

    first: int
    """Episodes in which it occurred with the first policy only."""
    second: int
    """Episodes in which it occurred with the second policy only."""
    p_value: float
    """Probability of a split at least as uneven for equal policies (McNemar's exact test)."""

    def __str__(self) -> str:
        return (
            f"with this one only in {self.first} episodes, with the other only in {self.second}, "
            f"p = {self.p_value:.3f}"
        )


@dataclass(frozen=True)
class Comparison:
    """The first policy against the second, in one mode."""

    mode: str
    """`deterministic` or `sampled` decisions."""
    episodes: int
    """Pairs of episodes."""
    policy_accuracy: Difference
    """Policy accuracy (strict) of the first minus that of the second."""
    success: Discordance
    """Episodes that reached the goal."""
    violations: dict[str, Discordance]
    """Per kind of violation, in the environment's words: episodes in which it occurred."""


def compare(first: Mapping[str, Scores], second: Mapping[str, Scores]) -> tuple[Comparison, ...]:
    """Compare the scores of two policies mode by mode.

    Raises:
        ConfigError: they were not evaluated on the same seeds.
    """
    return tuple(_compare(first[mode], second[mode]) for mode in first)


def comparison_text(comparisons: tuple[Comparison, ...], other: str) -> str:
    """Write the comparisons with the policy called `other` in a few lines."""
    lines = []
    for c in comparisons:
        found = {"policy accuracy": c.policy_accuracy, "goal reached": c.success, **c.violations}
        lines += [
            f"{c.mode} decisions, against {other} on the same {c.episodes} episodes",
            *(f"  {words:<16} {difference}" for words, difference in found.items()),
        ]
    return "\n".join(lines)


def comparison_json(comparisons: tuple[Comparison, ...]) -> dict[str, Any]:
    """Turn comparisons into what JSON can hold; shares are in [0, 1]."""
    return {comparison.mode: asdict(comparison) for comparison in comparisons}


def _compare(first: Scores, second: Scores) -> Comparison:
    if [e.seed for e in first.episodes] != [e.seed for e in second.episodes]:
        raise ConfigError("Two policies can only be compared on the same seeds.")

    pairs = list(zip(first.episodes, second.episodes, strict=True))
    kinds = dict.fromkeys([*first.violations, *second.violations])
    return Comparison(
        first.mode,
        len(first.episodes),
        bootstrap_difference(_correct(first), _correct(second)),
        _discordance([(one.success, two.success) for one, two in pairs]),
        {kind: _discordance([_occurred(kind, pair) for pair in pairs]) for kind in kinds},
    )


def _occurred(kind: str, pair: tuple[Episode, Episode]) -> tuple[bool, bool]:
    """Whether a kind of violation occurred in each episode of a pair."""
    return pair[0].kinds.get(kind, False), pair[1].kinds.get(kind, False)


def _discordance(pairs: list[tuple[bool, bool]]) -> Discordance:
    only_first, only_second = pairs.count((True, False)), pairs.count((False, True))
    return Discordance(only_first, only_second, mcnemar(only_first, only_second))


def _correct(scores: Scores) -> list[tuple[int, int]]:
    """Correct and all actions of every episode."""
    return [(episode.n_correct, len(episode.actions)) for episode in scores.episodes]
