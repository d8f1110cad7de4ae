"""Execute many random demonstrations without pictures and check them against the robot's limits.

The exit code is 1 if a demonstration does not follow its plan, spills, collides, or exceeds a speed
limit of YuMi.
"""

import argparse
import sys
from dataclasses import dataclass
from functools import partial

import numpy as np

from teasim.common.errors import SkillError
from teasim.common.parallel import run
from teasim.common.workers import Workers, default_jobs
from teasim.generation.plan import DemoPlan
from teasim.generation.recording import mismatch
from teasim.rollout import demonstrate
from teasim.task.mistakes import Plan, spoil
from teasim.task.recipes import (
    INCORRECT,
    OPTIMAL,
    SEQ_1,
    SEQ_2,
    SEQUENCES,
    SUBOPTIMAL,
    random_order,
)
from teasim.world.monitor import PENETRATION_LIMIT, TCP_SPEED_LIMIT, Monitor, Pair
from teasim.world.simulation import Simulation


@dataclass(frozen=True)
class Report:
    """Measurements of one demonstration."""

    seed: int
    """Seed of its layout, style and mistakes."""
    as_planned: bool
    """Whether exactly the planned sub-tasks were recognised, in order."""
    what: str
    """Steps, and the difference from the plan."""
    spilled: float
    """Spilled amount [ml or g]."""
    joint_speed: float
    """Largest joint speed as a share of its limit."""
    tcp_speed: float
    """Largest speed of a tool centre point [m/s]."""
    penetration: float
    """Largest depth of a contact [m]."""
    forbidden: tuple[Pair, ...]
    """Pairs of roles that touched and must not."""
    seconds: float
    """Length of the demonstration [s]."""

    @property
    def complaints(self) -> list[str]:
        """One phrase per limit that is exceeded."""
        found = [] if self.as_planned else [self.what]
        found += [f"{first} touches {second}" for first, second in self.forbidden]
        if self.joint_speed > 1:
            found.append(f"a joint at {self.joint_speed:.0%} of its speed")
        if self.tcp_speed > TCP_SPEED_LIMIT:
            found.append(f"a hand at {self.tcp_speed:.2f} m/s")
        if self.penetration > PENETRATION_LIMIT:
            found.append(f"a contact {1000 * self.penetration:.1f} mm deep")
        return found


def plan(arguments: argparse.Namespace, rng: np.random.Generator) -> Plan:
    """Draw the plan of one demonstration."""
    if arguments.mistake:
        return spoil(Plan(SEQ_1), arguments.mistake, rng)
    if arguments.sequence == INCORRECT:
        return spoil(Plan(SEQ_1), ["skip", "skip+skip"][rng.integers(2)], rng)
    orders = {OPTIMAL: SEQ_1, SUBOPTIMAL: SEQ_2}
    return Plan(orders.get(arguments.sequence) or random_order(rng))


def check(arguments: argparse.Namespace, seed: int) -> Report:
    """Execute and measure one random demonstration."""
    rng = np.random.default_rng([2, seed])
    demo = DemoPlan(seed, arguments.sequence, plan(arguments, rng))
    simulation = Simulation()
    monitor = Monitor(simulation)
    try:
        for _ in demonstrate(simulation, demo.plan, rng, match_length=arguments.match_length):
            pass
        what = mismatch(demo, simulation)
    except SkillError as error:
        what = str(error)
    return Report(
        seed=seed,
        as_planned=not what,
        what=f"{', '.join(demo.plan.steps)}: {what}",
        spilled=sum(simulation.liquids.spilled.values()),
        joint_speed=monitor.joint_speed,
        tcp_speed=monitor.tcp_speed,
        penetration=monitor.penetration,
        forbidden=monitor.forbidden,
        seconds=float(simulation.data.time),
    )


def main() -> int:
    """Run the check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=50, help="number of demonstrations")
    parser.add_argument("--first-seed", type=int, default=0, help="seed of the first one")
    parser.add_argument("--jobs", type=int, default=default_jobs(), help="number of processes")
    parser.add_argument(
        "--sequence", choices=SEQUENCES, default=OPTIMAL, help="order of the sub-tasks"
    )
    parser.add_argument(
        "--mistake", default="", help="a mistake in Seq_1: NAME[@SUBTASK][+NAME...]"
    )
    parser.add_argument("--match-length", action="store_true", help="add rests that match lengths")
    given = parser.parse_args()
    if given.seeds < 1 or given.jobs < 1:
        parser.error("--seeds and --jobs have to be 1 or more")
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    reports = run(
        partial(check, given), seeds, workers=Workers(given.jobs), description="demonstrations"
    )
    bad = [report for report in reports if report.complaints]
    for report in bad:
        print(f"seed {report.seed}: {'; '.join(report.complaints)}")
    print(f"as planned          {sum(r.as_planned for r in reports)} of {len(reports)}")
    print(f"without complaint   {len(reports) - len(bad)} of {len(reports)}")
    print(f"mean length         {np.mean([r.seconds for r in reports]):.1f} s")
    print(f"most spilled        {max(r.spilled for r in reports):.1f} ml or g")
    print(f"fastest joint       {max(r.joint_speed for r in reports):.0%} of its limit")
    print(f"fastest hand        {max(r.tcp_speed for r in reports):.2f} m/s")
    print(f"deepest contact     {1000 * max(r.penetration for r in reports):.2f} mm")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
