"""Episodes of a policy of either level in an ablation, and their scores as JSON and back."""

from collections.abc import Mapping
from typing import Any

from policies.experiments.ablation_config import AblationConfig
from policies.play.environments import World
from policies.play.evaluation import MODES, Scores, play, score
from policies.play.joint_evaluation import MotionScores, evaluate_motion, score_motion
from policies.play.joint_rollout import MotionEpisode
from policies.play.results import as_json, motion_json
from policies.play.rollout import Action, Episode
from policies.settings import EnvironmentConfig, EvaluationConfig
from teasim.common.statistics import Rate

AnyScores = Scores | MotionScores
"""Scores of one mode at either level."""


def play_cell(
    policy: Any, level: str, config: AblationConfig, world: World
) -> dict[str, AnyScores]:
    """Score a policy in the episodes of the ablation, in both modes.

    Args:
        policy: the policy.
        level: subtask or joint.
        config: the ablation.
        world: environments for policies over sub-tasks.
    """
    if level == "joint":
        place = EnvironmentConfig(config.joint_env_id)
        return dict(
            evaluate_motion(policy, EvaluationConfig(config.episodes, config.first_seed, place))
        )
    seeds = range(config.first_seed, config.first_seed + config.episodes)
    played = play(world(policy.spec), policy, seeds)
    return {mode: score(mode, played[mode], policy.action_names) for mode in MODES}


def scores_json(scores: Mapping[str, AnyScores]) -> dict[str, Any]:
    """Turn the scores of a cell into what JSON can hold."""
    steps = {mode: s for mode, s in scores.items() if isinstance(s, Scores)}
    motions = {mode: s for mode, s in scores.items() if isinstance(s, MotionScores)}
    return as_json(steps) | motion_json(motions)


def scores_from_json(record: Mapping[str, Any]) -> dict[str, AnyScores]:
    """Return the scores that a cell was recorded with."""
    found: dict[str, AnyScores] = {}
    for mode, saved in record["scores"].items():
        if record["level"] == "joint":
            found[mode] = score_motion(mode, [_motion(e) for e in saved["episodes"]])
        else:
            episodes = [_episode(e) for e in saved["episodes"]]
            found[mode] = score(mode, episodes, record["actions"])
    return found


def merged(found: list[AnyScores]) -> AnyScores:
    """Return the scores over the episodes of several training seeds."""
    steps = [s for s in found if isinstance(s, Scores)]
    if steps:
        return score(steps[0].mode, [e for s in steps for e in s.episodes], ())
    motions = [s for s in found if isinstance(s, MotionScores)]
    return score_motion(motions[0].mode, [e for s in motions for e in s.episodes])


def main_rate(scores: AnyScores) -> Rate:
    """Return policy accuracy, or at the joint level the share of the sub-tasks that took effect."""
    return scores.policy_accuracy if isinstance(scores, Scores) else scores.done


def hits_by_scene(found: list[AnyScores]) -> list[tuple[int, int]]:
    """Return the hits and trials of `main_rate` per scene, over the training seeds."""
    return [
        (sum(hits for hits, _ in scene), sum(trials for _, trials in scene))
        for scene in zip(*map(_hits, found), strict=True)
    ]


def hits_by_policy(found: list[AnyScores]) -> list[tuple[int, int]]:
    """Return the hits and trials of `main_rate` per policy, over the scenes."""
    return [
        (sum(hits for hits, _ in scenes), sum(trials for _, trials in scenes))
        for scenes in map(_hits, found)
    ]


def _hits(scores: AnyScores) -> list[tuple[int, int]]:
    if isinstance(scores, Scores):
        return [(episode.n_correct, len(episode.actions)) for episode in scores.episodes]
    return [(len(set(e.subtasks_done)), len(e.subtasks)) for e in scores.episodes]


def _episode(saved: dict[str, Any]) -> Episode:
    return Episode(**(_tuples(saved) | {"actions": tuple(Action(**a) for a in saved["actions"])}))


def _motion(saved: dict[str, Any]) -> MotionEpisode:
    fields = {name: value for name, value in saved.items() if name != "last"}
    return MotionEpisode(**(_tuples(fields) | {"subtasks": tuple(saved["subtasks"])}))


def _tuples(saved: dict[str, Any]) -> dict[str, Any]:
    return saved | {name: tuple(saved[name]) for name in ("subtasks_done", "violations")}
