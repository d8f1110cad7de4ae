"""PPO from a cloned policy and from nothing: learning curves, and scores in physics.

POLICY is a folder made by `teasim train --observe state`. Every seed learns in TeaMakingEvents-v0.
The scores are of scenes in physics (TeaMakingSubtasks-v0) that no policy has seen, the same for
all; each seed is compared with the cloned policy on the same scenes.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from policies import EvaluationConfig, load_policy
from policies.data.demos import DemosConfig, load_decisions
from policies.learners.subtask_policy import SubtaskPolicy
from policies.play.comparison import compare, comparison_text
from policies.play.evaluation import MODES, Scores, evaluate_all
from policies.ppo import PPOConfig, Update, improve, untrained
from teasim.pool import Pool

TENTHS = 10
"""Points of a printed learning curve."""


def main() -> int:
    """Learn, print the curves, score in physics; 1 unless every seed ends above the clone."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pool", type=Path, help="pool that the policy was cloned from")
    parser.add_argument("policy", type=Path, help="folder of a cloned policy that sees the state")
    parser.add_argument("--decisions", type=int, default=PPOConfig.decisions, help="per seed")
    parser.add_argument("--seeds", type=int, default=3, help="number of seeds")
    parser.add_argument("--episodes", type=int, default=50, help="scenes in physics, per mode")
    arguments = parser.parse_args()
    cloned = load_policy(arguments.policy)
    if not isinstance(cloned, SubtaskPolicy):
        parser.error(f"'{arguments.policy}' holds no policy over sub-tasks.")
    samples = load_decisions(Pool.open(arguments.pool), DemosConfig(observe="state"))
    policies = {"cloned": cloned}
    for name, start in {"cloned": cloned, "nothing": untrained(samples)}.items():
        for seed in range(arguments.seeds):
            config = PPOConfig(decisions=arguments.decisions, seed=seed)
            config = config if name == "cloned" else replace(config, kept=0)
            policy, curve = improve(start, config)
            policies[f"PPO from {name}, seed {seed}"] = policy
            print_curve(f"PPO from {name}, seed {seed}", curve)
    config = EvaluationConfig(episodes=arguments.episodes)
    scores = dict(zip(policies, evaluate_all(list(policies.values()), config), strict=True))
    print_scores(scores)
    above = [
        mode[name].policy_accuracy.value > mode["cloned"].policy_accuracy.value
        for mode in ({n: s[m] for n, s in scores.items()} for m in MODES)
        for name in mode
        if name.startswith("PPO from cloned")
    ]
    return 0 if all(above) else 1


def print_curve(name: str, curve: tuple[Update, ...]) -> None:
    """Print the share of episodes that reached the goal in each tenth of the decisions."""
    parts = np.array_split(np.array([u.success for u in curve if u.success is not None]), TENTHS)
    shown = " ".join(f"{100 * part.mean():5.1f}" for part in parts if len(part))
    print(
        f"{name}, {curve[-1].decisions} decisions; goal reached [%] in each tenth:\n  {shown}",
        flush=True,
    )


def print_scores(scores: dict[str, dict[str, Scores]]) -> None:
    """Print the scores of every policy in physics, and its comparison with the cloned one."""
    for mode in MODES:
        print(f"{mode} decisions in physics")
        for name, of in scores.items():
            s = of[mode]
            print(f"  {name:26} policy accuracy {s.policy_accuracy}  goal {s.success}")
    for name, of in scores.items():
        if name.startswith("PPO from cloned"):
            print(f"{name}\n{comparison_text(compare(of, scores['cloned']), 'the cloned one')}")


if __name__ == "__main__":
    sys.exit(main())
