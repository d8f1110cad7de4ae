"""What the joint-level environment pays for, and what it charges."""

from dataclasses import asdict

import numpy as np
import pytest

from teasim.common.errors import ConfigError
from teasim.constants import ARM_JOINTS, SUBTASKS
from teasim.envs.registration import MAX_SECONDS
from teasim.envs.rewards import OVEN_SECONDS, RewardTerms, RewardWeights
from teasim.task.scoring import Verdict
from teasim.world.events import Event
from teasim.world.liquids import VESSELS
from teasim.world.simulation import Simulation
from teasim.world.station import nominal_layout

NOTHING = dict.fromkeys(asdict(RewardWeights()), 0.0)
OPEN, REACHED = Verdict(False, (), False), Verdict(True, (), False)


@pytest.fixture
def simulation():
    station = Simulation()
    station.reset(nominal_layout())
    return station


def happened(simulation: Simulation, *subtasks: str, at: float = 0.0) -> None:
    simulation.recogniser.events += [Event(name, at) for name in subtasks]


def test_a_sub_task_pays_once_and_the_goal_pays_one(simulation):
    terms = RewardTerms(simulation)
    assert terms.take(OPEN) == NOTHING
    happened(simulation, "turn_on_oven", "add_milk")
    assert terms.take(OPEN) == NOTHING | {"subtasks": 2 / 7}
    happened(simulation, "add_milk")
    assert terms.take(OPEN) == NOTHING
    assert terms.take(REACHED) == NOTHING | {"success": 1.0}


def test_what_is_spilled_is_charged_once(simulation):
    terms = RewardTerms(simulation)
    simulation.liquids.spilled["milk"] += 12.0
    simulation.liquids.spilled["sugar"] += 3.0
    assert terms.take(OPEN) == NOTHING | {"spill": -15.0}
    assert terms.take(OPEN) == NOTHING


def test_forbidden_contacts_are_charged_when_they_begin(simulation):
    terms = RewardTerms(simulation)
    for joints in ARM_JOINTS.values():
        for name in joints:
            simulation.data.joint(name).qpos = 0
    simulation.step(simulation.target)
    assert terms.take(OPEN)["collision"] <= -1
    assert terms.take(OPEN)["collision"] == 0


def test_the_oven_costs_when_it_is_on_for_too_long_and_never_more_than_one(simulation):
    terms = RewardTerms(simulation)
    happened(simulation, "turn_on_oven", "turn_off_oven", at=-500.0)
    happened(simulation, "turn_on_oven")
    simulation.recogniser.oven_on = True

    def charged(time: float) -> float:
        simulation.data.time = time
        return terms.take(OPEN)["unsafe"]

    assert charged(OVEN_SECONDS) == 0
    assert charged(OVEN_SECONDS + 0.05) == pytest.approx(-0.05 / MAX_SECONDS)
    assert charged(OVEN_SECONDS + 60.0) == pytest.approx(-0.1 / MAX_SECONDS)
    whole = sum(charged(time) for time in np.arange(1, 10 * MAX_SECONDS + 1) / 10)
    assert -1 < whole < -0.5
    simulation.recogniser.oven_on = False
    assert charged(150.0) == 0


def test_terms_go_back_with_the_state(simulation):
    terms = RewardTerms(simulation)
    state = terms.state()
    happened(simulation, "turn_on_oven")
    simulation.liquids.spilled["milk"] += 1.0
    first = terms.take(OPEN)
    assert terms.take(OPEN) == NOTHING
    terms.restore(state)
    assert terms.take(OPEN) == first


def test_penalties_are_small_beside_a_sub_task():
    weights = RewardWeights()
    contents = sum(vessel.filling for vessel in VESSELS.values())
    everything_spilled = weights.total(NOTHING | {"spill": -contents})
    assert -0.2 < everything_spilled < 0
    assert 0 < weights.unsafe < 1 / len(SUBTASKS)
    assert 0 < weights.collision < 0.1 / len(SUBTASKS) + 0.01


def test_weights_are_the_default_ones_but_for_those_given():
    assert RewardWeights.of(None) == RewardWeights.of({}) == RewardWeights()
    assert RewardWeights.of({"spill": 0}) == RewardWeights(spill=0)


@pytest.mark.parametrize("weight", [np.nan, np.inf, "much", None, True])
def test_a_weight_is_a_finite_number(weight):
    with pytest.raises(ConfigError) as error:
        RewardWeights.of({"spill": weight})
    assert str(error.value) == f"The reward weight of 'spill' is {weight}; give a number."


def test_weights_change_the_reward_and_not_its_terms(make):
    weights = {"collision": 5.0, "subtasks": 2.0}
    rewards = []
    for given in (None, weights):
        env = make("TeaMaking", reward_weights=given)
        env.reset(seed=0)
        folded = env.unwrapped.action(np.zeros(16))  # through the torso and the other arm
        steps = [env.step(folded) for _ in range(8)]
        terms = [info["reward_terms"] for *_, info in steps]
        assert sum(term["collision"] for term in terms) < 0
        rewards.append((sum(reward for _, reward, *_ in steps), terms))
    (plain, terms), (charged, same) = rewards
    assert terms == same
    assert charged < plain < 0
