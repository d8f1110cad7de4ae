"""Evaluate a saved policy of either level: print its scores, write them, compare, apply the bar."""

from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from policies.checkpoint import AnyPolicy, load_policy
from policies.foreign import ForeignPolicy, adopt, is_named
from policies.learners.motion_policy import JointPolicy
from policies.learners.subtask_policy import SubtaskPolicy
from policies.play.comparison import compare, comparison_json, comparison_text
from policies.play.evaluation import evaluate_all
from policies.play.joint_evaluation import evaluate_motion
from policies.play.junit import Bar, write_junit
from policies.play.results import as_json, motion_json, motion_summary, summary
from policies.settings import EvaluateSettings
from teasim.common.errors import ConfigError
from teasim.common.files import write_json


def run_evaluation(settings: EvaluateSettings) -> int:
    """Evaluate the policy `settings.run` and print its scores.

    Returns:
        0, or 1 if the policy accuracy is below `settings.min_policy_accuracy`.

    Raises:
        CheckpointError: the folder holds no policy, or one for another environment.
        ConfigError: a setting does not fit the policy, the environment cannot be made, or the
            policy named in place of a folder is none.
    """
    for path in (settings.json, settings.junit):
        check_file(path)
    policy = _find_policy(settings.run, settings)
    if isinstance(policy, JointPolicy):
        return _evaluate_joints(policy, settings)
    return _evaluate_subtasks(policy, settings)


def _find_policy(run: Path, settings: EvaluateSettings) -> AnyPolicy | ForeignPolicy:
    """Return the policy in the folder `run`, or the one that MODULE:NAME names."""
    return adopt(str(run), settings.environment) if is_named(run) else load_policy(run)


def check_file(path: Path | None) -> None:
    """Raise ConfigError if `path`, when given, is a folder."""
    if path is not None and path.is_dir():
        raise ConfigError(f"The output file '{path}' is a folder; name a file in it.")


def _evaluate_subtasks(policy: SubtaskPolicy | ForeignPolicy, settings: EvaluateSettings) -> int:
    minimum = settings.min_policy_accuracy
    bar = None if minimum is None else Bar(minimum)
    rivals = [] if settings.against is None else [_find_rival(settings.against, settings)]
    scores, *others = evaluate_all([policy, *rivals], settings, workers=settings.workers)
    record = _record(settings, "subtask")
    print(summary(scores))
    for other in others:
        found = compare(scores, other)
        record |= {"against": str(settings.against), "comparison": comparison_json(found)}
        print(comparison_text(found, str(settings.against)))
    if settings.json:
        write_json(settings.json, record | {"scores": as_json(scores)})
    if settings.junit:
        write_junit(settings.junit, scores, bar)
    if bar is None or bar.passed(scores):
        return 0
    print(f"policy accuracy is below {bar.percent:g} %")
    return 1


def _find_rival(run: Path, settings: EvaluateSettings) -> SubtaskPolicy | ForeignPolicy:
    """Return a policy that a policy over sub-tasks can be compared with."""
    policy = _find_policy(run, settings)
    if isinstance(policy, JointPolicy):
        raise ConfigError(
            f"'{run}' holds a policy of the joint level; a comparison needs two over sub-tasks."
        )
    return policy


def _evaluate_joints(policy: JointPolicy, settings: EvaluateSettings) -> int:
    asked = (settings.min_policy_accuracy, settings.against, settings.junit, settings.video)
    if any(option is not None for option in asked):
        raise ConfigError(
            "A policy at the joint level chooses no sub-tasks; leave out --min-policy-accuracy, "
            "--against, --junit and --video."
        )
    scores = evaluate_motion(policy, settings, workers=settings.workers)
    print(motion_summary(scores))
    if settings.json:
        write_json(settings.json, _record(settings, "joint") | {"scores": motion_json(scores)})
    return 0


def _record(settings: EvaluateSettings, level: str) -> dict[str, Any]:
    """What the scores are about, as JSON can hold it."""
    world = asdict(settings.environment.at_level(level))
    return {"run": str(settings.run), "version": version("teasim"), "world": world}
