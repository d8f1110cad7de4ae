"""Compare the solvers of equation 3: what they reach against the certified optimum, and how fast.

The instances are pools like tea-making ones and ones without any structure. Exit code 1 when
`annealed` is more than 1e-3 nats per step above the certified lower bound in more than a tenth of
them, or loses against SLSQP, or a pool of 10,000 demonstrations takes more than 30 s.
"""

import argparse
import sys
import time
from collections.abc import Sequence

import numpy as np
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.judging.equation3.annealed import Annealed
from filtering.judging.equation3.exact import Exact
from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.published import Published
from filtering.judging.equation3.score import score
from filtering.judging.equation3.sequence import transitions
from filtering.judging.norm.norm_score import score_steps
from filtering.judging.norm.steps import StepList, count_steps

RIDGE = 0.01
"""The filter's default."""
CLOSE = 1e-3
"""How far above the certified lower bound counts as reached [nats per step]."""
CERTIFIED = 0.9
"""Share of CLOSE by which the lower bound may lie below the best that `exact` found."""
ENOUGH = 0.9
"""Share of the instances in which it has to be reached."""
LARGE = 10_000
"""Demonstrations of the large pool."""
SECONDS = 30.0
"""How long the large pool may take [s]."""

ORDER = (0, 1, 2, 3, 4, 5, 6)
CRITICAL = (1, 4, 5)


def pool(
    orders: Sequence[Sequence[int]], n_features: int, noise: float, rng: np.random.Generator
) -> Problem:
    """Give every segment its sub-task's features (mean squared length 1) and noise."""
    n_subtasks = 1 + max(max(order) for order in orders)
    means = rng.normal(size=(n_subtasks, n_features))
    features = [
        means[list(order)] + noise * rng.normal(size=(len(order), n_features)) for order in orders
    ]
    scale = np.sqrt(np.mean([np.sum(row**2) for rows in features for row in rows]))
    return Problem(transitions([f / scale for f in features], orders, n_subtasks), RIDGE)


def tea_orders(count: int, rng: np.random.Generator) -> list[tuple[int, ...]]:
    """Draw up to half of the demonstrations without one or two critical steps."""
    orders = [ORDER] * count
    for index in range(int(rng.integers(0, count // 2))):
        dropped = rng.choice(CRITICAL, size=rng.integers(1, 3), replace=False)
        orders[index] = tuple(step for step in ORDER if step not in dropped)
    return orders


def instance(number: int) -> tuple[str, Problem]:
    """Return an instance of 6 to 16 demonstrations; even numbers are like tea, odd ones random.

    Few are large, because a certificate for a large one takes long: D = 6 + int(11 u^3) for u
    uniform in [0, 1). Tea: 5 to 7 steps, 3 features. Random: 1 to 3 steps of 2 to 4 sub-tasks, 2
    features, as much noise as there is difference.
    """
    rng = np.random.default_rng([1, number])
    count = 6 + int(11 * rng.random() ** 3)
    if number % 2 == 0:
        return "tea", pool(tea_orders(count, rng), 3, float(rng.uniform(0.1, 0.6)), rng)
    labels = int(rng.integers(2, 5))
    lengths = rng.integers(1, 4, size=count)
    return "random", pool([rng.integers(0, labels, size=n).tolist() for n in lengths], 2, 1.0, rng)


def check_optimum(instances: int) -> bool:
    """Count in how many instances the certified optimum is reached."""
    gaps: dict[str, list[float]] = {"tea": [], "random": []}
    largest = 0
    began = time.process_time()
    for number in range(instances):
        kind, problem = instance(number)
        trusted = problem.rows.n_demos / 2
        certified = Exact(CERTIFIED * CLOSE).fit(problem, trusted)
        gaps[kind].append(Annealed().fit(problem, trusted).objective_ - certified.lower_bound_)
        largest = max(largest, problem.rows.n_demos)
        if (number + 1) % 10 == 0 or number + 1 == instances:
            _tell(gaps, largest, time.process_time() - began)
    every = np.array(gaps["tea"] + gaps["random"])
    return bool(np.mean(every <= CLOSE) >= ENOUGH)


def _tell(gaps: dict[str, list[float]], largest: int, seconds: float) -> None:
    """Print how often the optimum was reached so far, and the largest gap."""
    shares = ", ".join(
        f"{kind} {sum(gap <= CLOSE for gap in values)} of {len(values)}"
        for kind, values in gaps.items()
    )
    worst = max(max(values, default=0.0) for values in gaps.values())
    print(
        f"reached: {shares}; D up to {largest}, largest gap {worst:.4f} nats per step, "
        f"{seconds:.0f} s of CPU",
        flush=True,
    )


def check_speed(demos: int) -> bool:
    """Time `annealed` against SLSQP on the same problem, ridge included."""
    rng = np.random.default_rng(2)
    problem = pool(tea_orders(demos, rng), 32, 0.3, rng)
    found = {}
    for name, solver in (("annealed", Annealed()), ("SLSQP", Published(RIDGE))):
        began = time.perf_counter()
        found[name] = solver.fit(problem, demos / 2).objective_
        seconds = time.perf_counter() - began
        print(f"D = {demos}: {name:8} {found[name]:.4f} nats per step, {seconds:.1f} s", flush=True)
    return found["annealed"] <= found["SLSQP"] + 1e-6


def check_large(demos: int) -> bool:
    """Time equation 3 with its score, and the default score, on a large pool."""
    rng = np.random.default_rng(3)
    orders = tea_orders(demos, rng)
    problem = pool(orders, 32, 0.3, rng)
    began = time.perf_counter()
    score(problem, Annealed().fit(problem, demos / 2))
    middle = time.perf_counter()
    steps = [StepList(tuple(order), (10,) * len(order)) for order in orders]
    score_steps(count_steps(steps, len(ORDER)))
    ended = time.perf_counter()
    print(f"D = {demos}: equation 3 {middle - began:.1f} s, default score {ended - middle:.1f} s")
    return max(middle - began, ended - middle) <= SECONDS


def main() -> int:
    """Run the checks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--instances", type=int, default=200, help="small problems to solve")
    parser.add_argument("--demos", type=int, default=200, help="pool size against SLSQP")
    parser.add_argument("--large", type=int, default=LARGE, help="size of the large pool")
    arguments = parser.parse_args()
    with threadpool_limits(limits=1, user_api="blas"):
        passed = [
            check_optimum(arguments.instances) if arguments.instances else True,
            check_speed(arguments.demos) if arguments.demos else True,
            check_large(arguments.large) if arguments.large else True,
        ]
    return int(not all(passed))


if __name__ == "__main__":
    sys.exit(main())
