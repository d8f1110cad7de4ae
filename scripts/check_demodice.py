"""When DemoDICE tells correct demonstrations from erring ones, and when it is behaviour cloning.

Three decisions one after the other, 0 or 1 each; the state says which of them is next, and holds
numbers that have nothing to do with it. Two demonstrations are known to be good, and seven of
twelve of all err in the second decision. A line has the mean weight of the second decision of
other correct demonstrations and of erring ones, where those known to be good have the weight 1.
"""

import argparse

import numpy as np

from policies.data.samples import DecisionSamples, ObservationSpec
from policies.learners.demodice import DemoDICE, DemoDICEConfig

STEPS = 3
"""Decisions of a demonstration."""
ERRING = 7 / 12
"""Share of the demonstrations that err."""
KNOWN = (0, 1)
"""Demonstrations that are known to be good."""
CASES: tuple[tuple[int, int, dict[str, float]], ...] = (
    *((12, others, {"nu_penalty": 0.0}) for others in (1, 5, 20)),
    (12, 1, {"nu_penalty": 0.0, "ratio_steps": 3000}),
    *((12, others, {"nu_penalty": 0.01}) for others in (1, 5, 20, 150)),
    *((12, others, {"nu_penalty": 0.1}) for others in (1, 5, 20, 150)),
    *((12, others, {"nu_penalty": 0.01, "gradient_penalty": 10.0}) for others in (1, 5, 20)),
    *((96, others, {"nu_penalty": 0.0}) for others in (1, 20)),
    *((96, others, {"nu_penalty": 0.01}) for others in (1, 20)),
)
"""Demonstrations, numbers that have nothing to do with the decision, and settings."""


def main() -> None:
    """Print a line per case and mean over the seeds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="draws of the unrelated numbers")
    arguments = parser.parse_args()
    print("demos  unrelated  settings" + " " * 40 + "other correct  erring")
    for count, others, settings in CASES:
        found = [weights(count, others, settings, seed) for seed in range(arguments.seeds)]
        correct, erring = np.mean(found, axis=0)
        said = ", ".join(f"{name}={value:g}" for name, value in settings.items())
        print(f"{count:>5}  {others:>9}  {said:<46}  {correct:>13.3f}  {erring:>6.3f}", flush=True)


def weights(count: int, others: int, settings: dict[str, float], seed: int) -> tuple[float, float]:
    """Return the weight of other correct demonstrations and of erring ones in one draw."""
    samples = demonstrations(count, others, seed)
    config = DemoDICEConfig(experts=KNOWN, steps=1, **settings)  # type: ignore[arg-type]
    learner = DemoDICE(config).fit(samples, np.ones(count))
    found = learner.decision_weights_.reshape(-1, STEPS)[:, 1]
    # The learner orders demonstrations by content; the second states say which is which.
    shown, asked = learner.samples_.low_dim[1::STEPS], samples.low_dim[1::STEPS]
    owner = (shown[:, None] == asked).all(axis=2).argmax(axis=1)
    known = np.isin(owner, KNOWN)
    errs = learner.samples_.labels[1::STEPS] == 1
    unit = found[known].mean()
    return float(found[~known & ~errs].mean() / unit), float(found[errs].mean() / unit)


def demonstrations(count: int, others: int, seed: int) -> DecisionSamples:
    """Return `count` demonstrations whose states hold `others` unrelated numbers."""
    labels = np.zeros((count, STEPS), dtype=np.int64)
    labels[count - round(ERRING * count) :, 1] = 1
    unrelated = np.random.default_rng(seed).normal(size=(labels.size, others))
    states = np.hstack([np.tile(np.eye(STEPS), (count, 1)), unrelated]).astype(np.float32)
    names = tuple(f"number_{n}" for n in range(states.shape[1]))
    return DecisionSamples(
        np.zeros((labels.size, 1, 0, 0, 1, 1), dtype=np.float16),
        states,
        labels.ravel(),
        np.repeat(np.arange(count), STEPS),
        ObservationSpec((), 0, 0, names),
        ("0", "1"),
    )


if __name__ == "__main__":
    main()
