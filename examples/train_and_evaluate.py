"""Train a policy on what the filter kept, and run it in the simulator.

    python examples/train_and_evaluate.py POOL FOLDER

POOL is a pool of tea-making, for example that of `first_pool.py`.
"""

import sys
from pathlib import Path

from filtering import DemoFilter
from policies import EvaluationConfig, TrainSettings, evaluate, load_policy, train
from teasim import Pool
from teasim.pool.weight_table import write_weight_table

EPISODES = 2
"""Episodes that are run; a score that is reported needs 50 or more."""


def main(root: Path, folder: Path) -> None:
    """Filter the pool, train a policy on the kept demonstrations, and score it."""
    folder.mkdir(parents=True)
    table = folder / "weights.csv"
    write_weight_table(table, DemoFilter().fit(Pool.open(root)).table())
    print(train(TrainSettings(root, folder / "policy", learner="bc-rnn", weights=table)))
    scores = evaluate(load_policy(folder / "policy"), EvaluationConfig(episodes=EPISODES))
    for mode, found in scores.items():
        print(f"{mode}: {100 * found.policy_accuracy.value:.0f} % of the decisions are correct")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
