"""Scores of either level as text and as JSON."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from policies.play.evaluation import Scores
from policies.play.joint_evaluation import MotionScores
from policies.play.outcomes import outcome_lines, outcomes_json, rate_json


def summary(scores: Mapping[str, Scores]) -> str:
    """Write the main rates of a policy over sub-tasks in a few lines, with 95 % intervals."""
    lines = []
    for mode, s in scores.items():
        lines += [
            f"{mode} decisions, episodes: {len(s.episodes)}",
            f"  policy accuracy  {s.policy_accuracy}   lenient {s.lenient_accuracy}",
            *outcome_lines(s),
        ]
    return "\n".join(lines)


def motion_summary(scores: Mapping[str, MotionScores]) -> str:
    """Write the main rates of a joint-level policy in a few lines, with 95 % intervals."""
    lines = []
    for mode, s in scores.items():
        count = len(s.subtasks)
        low, high = count * s.done.low, count * s.done.high
        stops = [f"{subtask} in {times}" for subtask, times in s.stopped_after.items()]
        lines += [
            f"{mode} decisions, episodes: {len(s.episodes)}",
            f"  sub-tasks done   {s.mean_done:.2f} of {count} per episode ({low:.2f}-{high:.2f})",
            *outcome_lines(s),
            f"  stopped after    {', '.join(stops) or 'nothing'}",
        ]
    return "\n".join(lines)


def as_json(scores: Mapping[str, Scores]) -> dict[str, Any]:
    """Turn the scores of a policy over sub-tasks into what JSON can hold.

    Rates are in percent, null without trials.
    """
    return {mode: _scores_json(s) for mode, s in scores.items()}


def motion_json(scores: Mapping[str, MotionScores]) -> dict[str, Any]:
    """Turn the scores of a joint-level policy into what JSON can hold; rates in percent."""
    return {mode: _motion_json(s) for mode, s in scores.items()}


def _scores_json(scores: Scores) -> dict[str, Any]:
    return {
        "policy_accuracy": rate_json(scores.policy_accuracy),
        "lenient_accuracy": rate_json(scores.lenient_accuracy),
        **outcomes_json(scores),
        "episodes": [asdict(episode) for episode in scores.episodes],
    }


def _motion_json(scores: MotionScores) -> dict[str, Any]:
    return {
        "subtasks_done": scores.mean_done,
        "done": rate_json(scores.done),
        **outcomes_json(scores),
        "stopped_after": scores.stopped_after,
        "episodes": [asdict(episode) | {"last": episode.last} for episode in scores.episodes],
    }
