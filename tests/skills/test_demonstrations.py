"""Whole demonstrations, from a random layout to a cup of tea."""

from itertools import groupby, zip_longest

import numpy as np
import pytest

from teasim.rollout import demonstrate, replay, run_subtask
from teasim.skills.library import perform
from teasim.skills.style import Style
from teasim.task.mistakes import Plan
from teasim.task.recipes import SEQ_1, SEQ_2
from teasim.task.scoring import judge
from teasim.world.monitor import PENETRATION_LIMIT, TCP_SPEED_LIMIT, Monitor
from teasim.world.simulation import Simulation
from teasim.world.station import nominal_layout


@pytest.mark.slow
@pytest.mark.parametrize("plan", [SEQ_1, SEQ_2], ids=["seq_1", "seq_2"])
@pytest.mark.parametrize("seed", [100, 101])
def test_a_sequence_makes_tea(plan, seed):
    simulation = Simulation()
    monitor = Monitor(simulation)
    steps = [s.position for s in demonstrate(simulation, Plan(plan), np.random.default_rng(seed))]
    assert simulation.subtasks_done == plan
    assert [position for position, _ in groupby(steps)] == list(range(len(plan)))
    verdict = judge(plan, oven_on=simulation.oven_on, spilled=simulation.liquids.spilled)
    assert (verdict.success, verdict.violations, verdict.unsafe) == (True, (), False)
    assert monitor.forbidden == ()
    assert monitor.penetration < PENETRATION_LIMIT
    assert monitor.joint_speed <= 1
    assert monitor.tcp_speed <= TCP_SPEED_LIMIT
    assert len(steps) == pytest.approx(simulation.data.time * 10)


def played(seed: int) -> np.ndarray:
    simulation = Simulation()
    rng = np.random.default_rng(seed)
    return np.array([step.target for step in demonstrate(simulation, Plan(("turn_on_oven",)), rng)])


def test_a_seed_gives_one_demonstration():
    assert played(0).tobytes() == played(0).tobytes()
    assert played(0).tobytes() != played(1).tobytes()


@pytest.mark.parametrize("carry_out", ["demonstrate", "replay"])
def test_without_randomisation_everything_begins_in_its_place(carry_out):
    simulation, nominal = Simulation(), Simulation()
    nominal.reset(nominal_layout())
    rng = np.random.default_rng(0)
    if carry_out == "demonstrate":
        next(demonstrate(simulation, Plan(("turn_on_oven",)), rng, randomize=False))
    else:
        next(replay(simulation, [nominal.target], rng, randomize=False))
    assert simulation.environment_state().tobytes() == nominal.environment_state().tobytes()


def test_the_simulation_stands_before_the_step_that_is_shown():
    simulation = Simulation()
    demonstration = demonstrate(simulation, Plan(("turn_on_oven",)), np.random.default_rng(0))
    for count, step in zip(range(5), demonstration, strict=False):
        assert simulation.data.time == pytest.approx(0.1 * count)
        assert (step.subtask, step.position) == ("turn_on_oven", 0)


def test_running_a_sub_task_tells_how_long_it_took():
    simulation = Simulation()
    simulation.reset(nominal_layout())
    steps = run_subtask(simulation, "turn_on_oven", Style())
    assert simulation.data.time == pytest.approx(0.1 * steps)
    assert simulation.subtasks_done == ("turn_on_oven",)


def test_two_demonstrations_at_once_do_not_steer_each_other():
    def targets(subtask: str):
        simulation = Simulation()
        simulation.reset(nominal_layout())
        for target in perform(subtask, simulation, Style()):
            yield target.tobytes()
            if simulation.data.time > 4:
                return
            simulation.step(target)

    one, other = ("add_sugar", "add_milk")  # the same arm, at different postures
    alone = list(targets(one)), list(targets(other))
    together = zip(*zip_longest(targets(one), targets(other)), strict=True)
    assert tuple([bits for bits in part if bits] for part in together) == alone
