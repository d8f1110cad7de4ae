"""Scores of a joint-level policy as text and as JSON."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from policies.play.joint_evaluation import MotionScores
from policies.play.results import outcomes_json, rate_json


def motion_summary(scores: Mapping[str, MotionScores]) -> str:
    """Write how far the policy gets in a few lines, with 95 % intervals."""
    lines = []
    for name, s in scores.items():
        count = len(s.subtasks)
        low, high = count * s.done.low, count * s.done.high
        stops = [f"{subtask} in {times}" for subtask, times in s.stopped_after.items()]
        lines += [
            f"{name} decisions, episodes: {len(s.episodes)}",
            f"  sub-tasks done   {mean_done(s):.2f} of {count} per episode ({low:.2f}-{high:.2f})",
            f"  goal reached     {s.success}   oven left on {s.unsafe}   spilled {s.spills}",
            *(f"  {subtask:<16} done in {done}" for subtask, done in s.completion.items()),
            f"  stopped after    {', '.join(stops) or 'nothing'}",
        ]
    return "\n".join(lines)


def mean_done(scores: MotionScores) -> float:
    """Mean number of sub-tasks that took effect in an episode."""
    return len(scores.subtasks) * scores.done.value


def motion_json(scores: Mapping[str, MotionScores]) -> dict[str, Any]:
    """Turn scores into what JSON can hold; rates in percent."""
    return {name: _scores_json(s) for name, s in scores.items()}


def _scores_json(scores: MotionScores) -> dict[str, Any]:
    return {
        "subtasks_done": mean_done(scores),
        "done": rate_json(scores.done),
        **outcomes_json(scores),
        "stopped_after": scores.stopped_after,
        "episodes": [asdict(episode) | {"last": episode.last} for episode in scores.episodes],
    }
