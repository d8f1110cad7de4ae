"""Demonstrations that are drawn out: their length and their motion say nothing about the steps."""

import numpy as np
import pytest

from teasim.constants import SUBTASKS
from teasim.rollout import demonstrate
from teasim.skills.pace import STRETCH, TYPICAL_SECONDS, Pace, idle
from teasim.skills.style import Style
from teasim.task.mistakes import Plan
from teasim.task.recipes import SEQ_1
from teasim.world.bodies.embodiments import EMBODIMENTS
from teasim.world.monitor import TCP_SPEED_LIMIT, Monitor
from teasim.world.simulation import Simulation
from teasim.world.station import nominal_layout


@pytest.mark.parametrize("embodiment", EMBODIMENTS)
def test_the_length_is_drawn_alike_whatever_is_to_be_done(embodiment):
    assert set(TYPICAL_SECONDS[embodiment]) == set(SUBTASKS)
    whole = sum(TYPICAL_SECONDS[embodiment].values())
    for seed in range(20):
        full = Pace(SEQ_1, embodiment, np.random.default_rng(seed))
        short = Pace(SEQ_1[:2], embodiment, np.random.default_rng(seed))
        assert full.length == short.length
        assert STRETCH[0] * whole <= full.length <= STRETCH[1] * whole


def test_rests_use_up_the_time_to_spare_and_never_more():
    for seed in range(20):
        pace, elapsed = Pace(SEQ_1, "yumi", np.random.default_rng(seed)), 0.0
        for position, name in enumerate(SEQ_1):
            rest = pace.rest(position, elapsed, Style())
            assert rest >= 0
            elapsed += rest + TYPICAL_SECONDS["yumi"][name]
        assert elapsed <= pace.length
        assert pace.rest(6, pace.length, Style()) == 0.0


@pytest.mark.parametrize("embodiment", EMBODIMENTS)
def test_whoever_waits_sways_touches_nothing_and_is_back_in_the_end(embodiment):
    simulation = Simulation(embodiment)
    simulation.reset(nominal_layout())
    for seed in range(3):
        monitor, start = Monitor(simulation), simulation.target.copy()
        targets = np.array(list(idle(simulation, 6.0, np.random.default_rng(seed))))
        assert len(targets) == 60
        assert targets[-1] == pytest.approx(start)
        arms = targets[:, :-2].reshape(60, 2, -1)
        assert (np.ptp(arms, axis=0).max(axis=1) > 0.1).all()  # both of them move
        for target in targets:
            simulation.step(target)
        assert monitor.forbidden == ()
        assert monitor.tcp_speed < TCP_SPEED_LIMIT
        simulation.observers.clear()


@pytest.mark.slow
def test_a_short_plan_takes_as_long_as_it_is_meant_to():
    simulation = Simulation()
    plan, rng = Plan(("turn_on_oven",)), np.random.default_rng(0)
    steps = list(demonstrate(simulation, plan, rng, match_length=True))
    typical = sum(TYPICAL_SECONDS["yumi"].values())
    assert STRETCH[0] * typical - 0.2 <= len(steps) / 10 <= STRETCH[1] * typical + 0.2
    assert simulation.subtasks_done == plan.steps


def test_a_rest_of_no_length_draws_nothing():
    simulation = Simulation()
    simulation.reset(nominal_layout())
    rng, untouched = np.random.default_rng(0), np.random.default_rng(0)
    assert list(idle(simulation, 0.0, rng)) == []
    assert rng.random() == untouched.random()
