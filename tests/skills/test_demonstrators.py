"""The participants and their habits."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from teasim.common.errors import ConfigError
from teasim.rollout import demonstrate
from teasim.skills.demonstrators import OPERATOR, PARTICIPANTS, sample_style, varied
from teasim.task.mistakes import Plan
from teasim.task.recipes import SEQ_1, is_legal
from teasim.world.monitor import PENETRATION_LIMIT, TCP_SPEED_LIMIT, Monitor
from teasim.world.simulation import Simulation

PEOPLE = [name for name, who in PARTICIPANTS.items() if who.embodiment == "person"]


def test_the_robot_and_three_people_demonstrate():
    assert list(PARTICIPANTS) == ["yumi", "person_1", "person_2", "person_3"]
    assert all(name == who.name for name, who in PARTICIPANTS.items())


@pytest.mark.parametrize("name", PARTICIPANTS)
def test_habits_are_kept(name):
    who = PARTICIPANTS[name]
    styles = [sample_style(np.random.default_rng(seed), who) for seed in range(50)]
    for habit in ("tempo", "lift", "bow", "pause", "stir_turns"):
        low, high = getattr(who, habit)
        values = [getattr(style, habit) for style in styles]
        assert low <= min(values) < max(values) <= high, habit
    assert {style.hand for style in styles} == {who.hand}
    assert who.orders[0] == SEQ_1
    assert all(is_legal(order) for order in who.orders)


@pytest.mark.parametrize("name", PARTICIPANTS)
def test_hesitating_is_as_rare_as_stated(name):
    who, rng = PARTICIPANTS[name], np.random.default_rng(0)
    styles = [varied(sample_style(rng, who), rng, who) for _ in range(2000)]
    hesitations = np.mean([style.hesitation > 0 for style in styles])
    assert hesitations == pytest.approx(who.hesitates, abs=0.03)
    assert np.mean([style.regrasp for style in styles]) == pytest.approx(who.regrasps, abs=0.03)


def test_people_can_be_told_apart():
    for one, other in combinations(PEOPLE, 2):
        first, second = PARTICIPANTS[one].appearance, PARTICIPANTS[other].appearance
        for part in ("skin", "sleeve", "shirt"):
            difference = np.subtract(getattr(first, part), getattr(second, part))
            assert np.linalg.norm(difference) > 0.1, (one, other, part)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"embodiment": "cat"}, "x has the unknown embodiment 'cat'; choose yumi, person."),
        ({"hand": "third"}, "x has the unknown hand 'third'; choose right, left."),
        ({"orders": (("stir",),)}, "x has an order that is not correct: ('stir',)."),
    ],
)
def test_impossible_participants_are_refused(change, sentence):
    with pytest.raises(ConfigError) as error:
        replace(OPERATOR, name="x", **change)
    assert str(error.value) == sentence


def test_a_person_does_not_demonstrate_with_a_robot():
    rng = np.random.default_rng(0)
    with pytest.raises(ConfigError) as error:
        next(demonstrate(Simulation(), Plan(SEQ_1), rng, participant=PARTICIPANTS["person_1"]))
    assert str(error.value) == (
        "person_1 works with the embodiment 'person', the station has 'yumi'; choose one for both."
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", PEOPLE)
def test_people_make_tea_in_the_orders_they_like(name):
    who, simulation = PARTICIPANTS[name], Simulation("person")
    for seed, order in enumerate(who.orders):
        simulation.observers.clear()
        monitor = Monitor(simulation)
        rng = np.random.default_rng(seed)
        for _ in demonstrate(simulation, Plan(order), rng, participant=who):
            pass
        assert simulation.subtasks_done == order
        assert sum(simulation.liquids.spilled.values()) == 0
        assert monitor.forbidden == ()
        assert monitor.penetration < PENETRATION_LIMIT
        assert monitor.joint_speed <= 1
        assert monitor.tcp_speed <= TCP_SPEED_LIMIT
