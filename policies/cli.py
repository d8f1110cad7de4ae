"""The verbs of policies: options are read here, the work is done elsewhere.

Nothing heavy is imported before the options of a verb are understood.
"""

from collections.abc import Sequence

from policies.settings import (
    AblateSettings,
    DemoSettings,
    EvaluateSettings,
    ReproduceSettings,
    TrainSettings,
)
from teasim.common.cli import parse, resumable

EXAMPLES = {
    "train": (
        "teasim train pool --weights findings/weights.csv -o policy",
        "teasim train pool --learner bc --set steps=1000 --observe state -o cloned",
        "teasim train pool --learner ppo --from cloned -o improved",
    ),
    "evaluate": (
        "teasim evaluate policy --episodes 20 --json scores.json",
        "teasim evaluate policy --against other_policy --video videos",
        "teasim evaluate my_module:MyPolicy --episodes 20",
    ),
    "ablate": (
        "teasim ablate plan.toml -o results",
        "teasim ablate plan.toml -o results --jobs 2",
    ),
    "reproduce": (
        "teasim reproduce all --quick -o reproduced",
        "teasim reproduce table4 --salads 50salads -o reproduced --dry-run",
    ),
    "demo": (
        "teasim demo -o out",
        "teasim demo -o out --seq1 6 --seq3 2 --episodes 4",
    ),
}
"""Command lines shown below the help of each verb."""


def train(argv: Sequence[str] | None = None) -> int:
    """Train a policy on a pool of demonstrations."""
    settings = parse(TrainSettings, argv, verb="train", examples=EXAMPLES["train"])
    from policies.training import train

    print(train(settings))
    return 0


def evaluate(argv: Sequence[str] | None = None) -> int:
    """Run a trained policy in the environment and score it."""
    settings = parse(EvaluateSettings, argv, verb="evaluate", examples=EXAMPLES["evaluate"])
    from policies.scoring import run_evaluation

    return run_evaluation(settings)


@resumable
def ablate(argv: Sequence[str] | None = None) -> int:
    """Train and score policies over pools x filters x learners x seeds."""
    settings = parse(AblateSettings, argv, verb="ablate", examples=EXAMPLES["ablate"])
    from policies.experiments.ablation import run_ablation

    print(run_ablation(settings))
    return 0


@resumable
def reproduce(argv: Sequence[str] | None = None) -> int:
    """Reproduce the tables and figures of the paper."""
    settings = parse(ReproduceSettings, argv, verb="reproduce", examples=EXAMPLES["reproduce"])
    from policies.experiments.reproduce.run import run_reproduction

    print(run_reproduction(settings))
    return 0


def demo(argv: Sequence[str] | None = None) -> int:
    """Run the whole method on a small pool: generate, filter, train, evaluate, report."""
    settings = parse(DemoSettings, argv, verb="demo", examples=EXAMPLES["demo"])
    from policies.experiments.demo import run_demo

    print(run_demo(settings))
    return 0
