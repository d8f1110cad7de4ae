"""The bar that a policy must reach, and its scores as JUnit XML for a build server."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from policies.play.evaluation import Scores
from policies.play.rollout import Episode
from teasim.common.errors import ConfigError
from teasim.common.files import write_bytes


@dataclass(frozen=True)
class Bar:
    """The least policy accuracy (strict, deterministic decisions) that passes."""

    percent: float
    """Policy accuracy [%], 0 to 100."""

    def __post_init__(self) -> None:
        """Raise ConfigError for what is no percentage, or looks like a fraction."""
        if not 0 <= self.percent <= 100:
            raise ConfigError(
                f"The least policy accuracy is {self.percent} %; choose a number from 0 to 100."
            )
        if 0 < self.percent <= 1:
            raise ConfigError(
                f"The least policy accuracy is in percent: {self.percent} would be "
                f"{self.percent} %; write {100 * self.percent:g} for that share."
            )

    def passed(self, scores: Mapping[str, Scores]) -> bool:
        """Tell whether the deterministic decisions reach the bar."""
        return 100 * scores["deterministic"].policy_accuracy.value >= self.percent


def write_junit(path: Path, scores: Mapping[str, Scores], bar: Bar | None) -> None:
    """Write one test suite per mode, with one case per episode and one for the bar.

    Only the bar can fail, so the file and the exit code agree. The text of an episode lists its
    actions.
    """
    root = ElementTree.Element("testsuites", name="teasim evaluate")
    for mode, s in scores.items():
        checked = bar if mode == "deterministic" else None
        failed = checked is not None and not checked.passed(scores)
        suite = ElementTree.SubElement(
            root,
            "testsuite",
            name=f"teasim.evaluate.{mode}",
            tests=str(len(s.episodes) + (checked is not None)),
            failures=str(int(failed)),
            errors="0",
        )
        if checked is not None:
            _bar_case(suite, checked, s, failed)
        for episode in s.episodes:
            case = _case(suite, mode, f"episode {episode.seed}")
            ElementTree.SubElement(case, "system-out").text = _account(episode)
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


def _account(episode: Episode) -> str:
    """List the actions, whether the goal was reached, and what was violated."""
    steps = [
        action.name if action.correct else f"{action.name} (reference: {action.reference})"
        for action in episode.actions
    ]
    end = "goal reached" if episode.success else "goal not reached"
    violated = [kind for kind, occurred in episode.kinds.items() if occurred]
    return f"{', '.join(steps)}: {', '.join([end, *violated])}"
