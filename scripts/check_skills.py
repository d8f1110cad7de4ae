"""Carry out many random demonstrations without pictures and report what a real robot would mind.

Exit code 1 when a demonstration does not come out as planned, spills, bumps into something, or
moves faster than a YuMi can.
"""

import argparse
import sys
from dataclasses import dataclass
from functools import partial

import numpy as np

from teasim.errors import SkillError
from teasim.parallel import default_jobs, run
from teasim.rollout import demonstrate
from teasim.task.mistakes import Plan, mistake
from teasim.task.recipes import INCORRECT, OPTIMAL, SEQ_1, SEQ_2, SEQUENCES, SUBOPTIMAL
from teasim.task.scoring import judge, spills
from teasim.world.monitor import PENETRATION_LIMIT, TCP_SPEED_LIMIT, Monitor, Pair
from teasim.world.simulation import Simulation


@dataclass(frozen=True)
class Report:
    """What one demonstration came to."""

    seed: int
    """Seed of its layout, style and mistakes."""
    as_planned: bool
    """The planned sub-tasks happened, in order, and the goal was reached if it was to be."""
    what: str
    """Why not, or nothing."""
    spilled: float
    """Amount on the table [ml or g]."""
    spoiled: tuple[str, ...]
    """Contents of which more than the tolerance was spilled."""
    joint_speed: float
    """Largest joint speed as a share of its limit."""
    tcp_speed: float
    """Largest speed of a tool centre point [m/s]."""
    penetration: float
    """Deepest penetration of a contact [m]."""
    forbidden: tuple[Pair, ...]
    """What touched and must not."""
    seconds: float
    """Length of the demonstration [s]."""

    @property
    def complaints(self) -> list[str]:
        """Everything that is not as it should be."""
        found = [] if self.as_planned else [self.what]
        found += self.spoiled
        found += [f"{first} touches {second}" for first, second in self.forbidden]
        if self.joint_speed > 1:
            found.append(f"a joint at {self.joint_speed:.0%} of its speed")
        if self.tcp_speed > TCP_SPEED_LIMIT:
            found.append(f"a hand at {self.tcp_speed:.2f} m/s")
        if self.penetration > PENETRATION_LIMIT:
            found.append(f"a contact {1000 * self.penetration:.1f} mm deep")
        return found


def check(sequence: str, seed: int) -> Report:
    """Carry out one random demonstration."""
    rng = np.random.default_rng([2, seed])
    plan = {OPTIMAL: Plan(SEQ_1), SUBOPTIMAL: Plan(SEQ_2)}.get(sequence, Plan(SEQ_1))
    for _ in range(1 + seed % 2 if sequence == INCORRECT else 0):
        plan = mistake("skip")(plan, rng)
    simulation = Simulation()
    monitor, what = Monitor(simulation), ""
    try:
        for _ in demonstrate(simulation, plan.steps, rng):
            pass
    except SkillError as error:
        what = str(error)
    done, spilled = simulation.subtasks_done, simulation.liquids.spilled
    verdict = judge(done, oven_on=simulation.oven_on, spilled=spilled)
    good = not what and done == plan.steps and verdict.success == (not plan.mistakes)
    return Report(
        seed=seed,
        as_planned=good,
        what=what or f"happened: {', '.join(done)}",
        spilled=sum(spilled.values()),
        spoiled=spills(spilled),
        joint_speed=monitor.joint_speed,
        tcp_speed=monitor.tcp_speed,
        penetration=monitor.penetration,
        forbidden=monitor.forbidden,
        seconds=float(simulation.data.time),
    )


def main() -> int:
    """Check the demonstrations asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=50, help="number of demonstrations")
    parser.add_argument("--first-seed", type=int, default=0, help="seed of the first one")
    parser.add_argument("--jobs", type=int, default=default_jobs(), help="processes to work in")
    parser.add_argument("--sequence", choices=SEQUENCES, default=OPTIMAL, help="what to make")
    given = parser.parse_args()
    if given.seeds < 1 or given.jobs < 1:
        parser.error("--seeds and --jobs have to be 1 or more")
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    reports = run(
        partial(check, given.sequence), seeds, jobs=given.jobs, description="demonstrations"
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
