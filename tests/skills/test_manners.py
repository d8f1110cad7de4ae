"""Laws of sub-tasks done in vain: all or some of the motion, none of the effect, nothing broken."""

import numpy as np
import pytest

from teasim.skills.library import SKILLS, perform
from teasim.skills.style import Style
from teasim.task.mistakes import ABANDONED, INEFFECTIVE, MISSING_THE_CUP
from teasim.task.scoring import spills
from teasim.world.bodies.embodiments import EMBODIMENTS
from teasim.world.monitor import PENETRATION_LIMIT, Monitor
from tests.skills.test_skills import home, poses, prepare, station

CASES = [(e, s, m) for e in EMBODIMENTS for s in SKILLS for m in (INEFFECTIVE, ABANDONED)]


@pytest.fixture(scope="module", params=CASES, ids=str)
def vain(request):
    embodiment, subtask, manner = request.param
    simulation = station(3, embodiment)
    prepare(simulation, subtask)
    before, earlier = poses(simulation), len(simulation.events)
    monitor = Monitor(simulation)
    for target in perform(subtask, simulation, Style(), manner):
        simulation.step(target)
    return subtask, manner, simulation, simulation.events[earlier:], before, monitor


def test_nothing_comes_of_it(vain):
    subtask, manner, simulation, happened, _, _ = vain
    assert happened == ()
    missed = manner == INEFFECTIVE and subtask in MISSING_THE_CUP
    expected = (f"spilled_{subtask.removeprefix('add_')}",) if missed else ()
    assert spills(simulation.liquids.spilled) == expected


def test_the_arms_end_at_ready_and_nothing_is_bumped_into(vain):
    _, _, simulation, _, _, monitor = vain
    assert simulation.joint_state()[:-2] == pytest.approx(home(simulation.embodiment), abs=1e-2)
    assert monitor.forbidden == ()
    assert monitor.penetration < PENETRATION_LIMIT


def test_all_is_put_back_but_a_bag_beside_the_cup(vain):
    subtask, manner, simulation, _, before, _ = vain
    after = poses(simulation)
    dropped = {"tea_bag"} if (subtask, manner) == ("add_tea_bag", INEFFECTIVE) else set()
    for name in set(before) - dropped:
        moved = np.linalg.norm(after[name][:3] - before[name][:3])
        assert moved < 0.015, name
    for name in dropped:
        assert np.linalg.norm(after[name][:2] - after["cup"][:2]) > 0.06
        assert after[name][2] < 0.05
