"""Scores as text, as JSON and as JUnit XML for a build server."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from policies.play.evaluation import Scores
from policies.play.outcomes import Outcomes
from policies.play.rollout import Episode
from teasim.common.errors import ConfigError
from teasim.common.files import write_bytes, write_json
from teasim.common.statistics import Rate


@dataclass(frozen=True)
class Bar:
    """The least policy accuracy (strict, deterministic decisions) that passes."""

    percent: float

    def __post_init__(self) -> None:
        """Raise ConfigError for a bar that is no percentage, or looks like a fraction."""
        if not 0 <= self.percent <= 100:
            raise ConfigError(f"A policy accuracy of {self.percent} % cannot be; choose 0 to 100.")
        if 0 < self.percent <= 1:
            raise ConfigError(
                f"The least policy accuracy is in percent: {self.percent} would be "
                f"{self.percent} %; write {100 * self.percent:g} for that share."
            )

    def passed(self, scores: Mapping[str, Scores]) -> bool:
        """Tell whether the deterministic decisions reach the bar."""
        return 100 * scores["deterministic"].policy_accuracy.value >= self.percent


def summary(scores: Mapping[str, Scores]) -> str:
    """Write the main rates in a few lines, with 95 % intervals."""
    lines = []
    for name, s in scores.items():
        lines += [
            f"{name} decisions, {len(s.episodes)} episodes",
            f"  policy accuracy  {s.policy_accuracy}   lenient {s.lenient_accuracy}",
            f"  goal reached     {s.success}   oven left on {s.unsafe}   spilled {s.spills}",
            *(f"  {subtask:<16} done in {done}" for subtask, done in s.completion.items()),
        ]
    return "\n".join(lines)


def as_json(scores: Mapping[str, Scores]) -> dict[str, Any]:
    """Turn scores into what JSON can hold; rates in percent, null without trials."""
    return {name: _scores_json(s) for name, s in scores.items()}


def write_scores(path: Path, scores: Mapping[str, Scores], about: Mapping[str, Any]) -> None:
    """Write `scores` and what they are `about` (JSON-able) to `path`."""
    write_json(path, {**about, "scores": as_json(scores)})


def write_junit(path: Path, scores: Mapping[str, Scores], bar: Bar | None) -> None:
    """Write one test suite per mode, one case per episode and one for the bar.

    Only the bar can fail, so the file and the exit code say the same. An episode's text lists its
    actions.
    """
    root = ElementTree.Element("testsuites", name="teasim evaluate")
    for name, s in scores.items():
        checked = bar if name == "deterministic" else None
        failed = checked is not None and not checked.passed(scores)
        suite = ElementTree.SubElement(
            root,
            "testsuite",
            name=f"teasim.evaluate.{name}",
            tests=str(len(s.episodes) + (checked is not None)),
            failures=str(int(failed)),
            errors="0",
        )
        if checked is not None:
            _bar_case(suite, checked, s, failed)
        for episode in s.episodes:
            case = _case(suite, name, f"episode {episode.seed}")
            ElementTree.SubElement(case, "system-out").text = _story(episode)
    ElementTree.indent(root)
    data = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    write_bytes(path, data)


def _bar_case(suite: ElementTree.Element, bar: Bar, scores: Scores, failed: bool) -> None:
    case = _case(suite, scores.mode, f"policy accuracy at least {bar.percent:g} %")
    text = f"policy accuracy {scores.policy_accuracy}"
    if failed:
        ElementTree.SubElement(case, "failure", message=text)
    else:
        ElementTree.SubElement(case, "system-out").text = text


def _case(suite: ElementTree.Element, mode: str, name: str) -> ElementTree.Element:
    return ElementTree.SubElement(suite, "testcase", classname=f"teasim.evaluate.{mode}", name=name)


def _story(episode: Episode) -> str:
    steps = [
        action.name if action.correct else f"{action.name} (reference: {action.reference})"
        for action in episode.actions
    ]
    end = "goal reached" if episode.success else "goal not reached"
    return f"{', '.join(steps)}: {end}{', oven left on' if episode.unsafe else ''}"


def _scores_json(scores: Scores) -> dict[str, Any]:
    return {
        "policy_accuracy": rate_json(scores.policy_accuracy),
        "lenient_accuracy": rate_json(scores.lenient_accuracy),
        **outcomes_json(scores),
        "episodes": [asdict(episode) for episode in scores.episodes],
    }


def outcomes_json(scores: Outcomes) -> dict[str, Any]:
    """Turn what episodes come to into what JSON can hold; rates in percent."""
    return {
        "success": rate_json(scores.success),
        "unsafe": rate_json(scores.unsafe),
        "spills": rate_json(scores.spills),
        "completion": {name: rate_json(rate) for name, rate in scores.completion.items()},
        "violations": scores.violations,
    }


def rate_json(rate: Rate) -> dict[str, Any]:
    """Turn a rate into what JSON can hold, in percent."""
    return {
        "percent": 100 * rate.value if rate.trials else None,
        "low_percent": 100 * rate.low,
        "high_percent": 100 * rate.high,
        "hits": rate.hits,
        "trials": rate.trials,
    }
