"""Two policies on the same episodes: a difference is judged seed by seed.

Both start in the same scenes, so what makes a scene hard falls out of the comparison. Whether an
episode reached the goal, or left the oven on, is compared by McNemar's exact test; the policy
accuracy by resampling the pairs of episodes.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from policies.play.evaluation import Scores
from teasim.common.errors import ConfigError
from teasim.common.statistics import Difference, bootstrap_difference, mcnemar


@dataclass(frozen=True)
class Discordance:
    """What one policy did and the other did not, counted over the same episodes."""

    first: int
    """Episodes in which the first alone did it."""
    second: int
    """Episodes in which the second alone did it."""
    p_value: float
    """Chance of so uneven a split if the policies were alike (McNemar's exact test)."""


@dataclass(frozen=True)
class Comparison:
    """The first policy beside the second, in one mode."""

    mode: str
    """`deterministic` or `sampled` decisions."""
    episodes: int
    """Pairs of episodes."""
    policy_accuracy: Difference
    """Policy accuracy (strict) of the first minus that of the second."""
    success: Discordance
    """Episodes that reached the goal."""
    unsafe: Discordance
    """Episodes that ended with the oven on."""


def compare(first: Mapping[str, Scores], second: Mapping[str, Scores]) -> tuple[Comparison, ...]:
    """Compare the scores of two policies mode by mode.

    Raises:
        ConfigError: they were not played on the same seeds.
    """
    return tuple(_compare(first[mode], second[mode]) for mode in first)


def comparison_text(comparisons: tuple[Comparison, ...], other: str) -> str:
    """Write the comparisons with the policy called `other` in a few lines."""
    lines = []
    for c in comparisons:
        lines += [
            f"{c.mode} decisions, beside {other} on the same {c.episodes} episodes",
            f"  policy accuracy  {c.policy_accuracy}",
            f"  goal reached     {_text(c.success)}",
            f"  oven left on     {_text(c.unsafe)}",
        ]
    return "\n".join(lines)


def comparison_json(comparisons: tuple[Comparison, ...]) -> dict[str, Any]:
    """Turn comparisons into what JSON can hold; shares are in [0, 1]."""
    return {comparison.mode: asdict(comparison) for comparison in comparisons}


def _compare(first: Scores, second: Scores) -> Comparison:
    if [e.seed for e in first.episodes] != [e.seed for e in second.episodes]:
        raise ConfigError("Two policies can only be compared on the same seeds.")
    return Comparison(
        first.mode,
        len(first.episodes),
        bootstrap_difference(_correct(first), _correct(second)),
        _discordance([e.success for e in first.episodes], [e.success for e in second.episodes]),
        _discordance([e.unsafe for e in first.episodes], [e.unsafe for e in second.episodes]),
    )


def _correct(scores: Scores) -> list[tuple[int, int]]:
    """Correct and all actions of every episode."""
    return [(episode.n_correct, len(episode.actions)) for episode in scores.episodes]


def _discordance(first: list[bool], second: list[bool]) -> Discordance:
    pairs = list(zip(first, second, strict=True))
    one, two = pairs.count((True, False)), pairs.count((False, True))
    return Discordance(one, two, mcnemar(one, two))


def _text(found: Discordance) -> str:
    return (
        f"in {found.first} episodes by this one alone, in {found.second} by the other alone, "
        f"p = {found.p_value:.3f}"
    )
