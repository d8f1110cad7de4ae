"""Going back to a state and going on from it is as if nothing had been in between."""

import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from teasim.common.errors import ConfigError
from teasim.skills.library import perform
from teasim.skills.style import Style
from teasim.world.simulation import Simulation
from teasim.world.station import nominal_layout, sample_layout

HALF = 40
"""Control steps of pouring before the state is kept; the stream has just begun."""


def everything(simulation: Simulation) -> bytes:
    """Whatever somebody can see of the station, as bits."""
    data = simulation.data
    arrays = (data.qpos, data.qvel, data.ctrl, data.xpos, data.geom_xpos, data.qacc_warmstart)
    streams = [(s.start.tolist(), s.end.tolist()) for s in simulation.streams]
    rest = (simulation.liquids.state(), simulation.recogniser.state(), streams, data.time)
    return b"".join(a.tobytes() for a in arrays) + repr(rest).encode()


@pytest.fixture(scope="module")
def pouring():
    """The state in the middle of pouring milk, the targets from there, and what they gave."""
    simulation = Simulation()
    simulation.reset(sample_layout(np.random.default_rng(2)))
    motion = perform("add_milk", simulation, Style(tempo=1.9, pause=0.1))
    targets, seen, kept = [], [], None
    for target in motion:
        if kept is None and simulation.streams:
            kept = simulation.get_state()
        if kept is not None:
            targets.append(target)
        simulation.step(target)
        if kept is not None:
            seen.append(everything(simulation))
        if len(targets) == HALF:
            break
    assert simulation.subtasks_done == ("add_milk",)
    return kept, targets, seen


def run(simulation: Simulation, targets: list[np.ndarray]) -> list[bytes]:
    seen = []
    for target in targets:
        simulation.step(target)
        seen.append(everything(simulation))
    return seen


def test_any_station_goes_on_from_a_pickled_state_bit_for_bit(pouring, simulation):
    kept, targets, expected = pouring
    simulation.step(simulation.target + 0.05)
    simulation.set_state(pickle.loads(pickle.dumps(kept)))
    assert run(simulation, targets) == expected


def test_a_state_can_be_gone_back_to_again_and_is_not_changed_by_what_follows(pouring, simulation):
    kept, targets, expected = pouring
    before = pickle.dumps(kept)
    for _ in range(2):
        simulation.set_state(kept)
        assert run(simulation, targets[:12]) == expected[:12]
    assert pickle.dumps(kept) == before


def test_right_after_going_back_everything_is_where_it_was(pouring, simulation):
    kept, targets, _ = pouring
    simulation.set_state(kept)
    first = everything(simulation)
    run(simulation, targets[:3])
    simulation.set_state(kept)
    assert everything(simulation) == first
    assert simulation.streams
    again = simulation.get_state()
    assert again.physics.integration.tobytes() == kept.physics.integration.tobytes()
    assert all((again.physics.poses[k] == v).all() for k, v in kept.physics.poses.items())
    assert (again.physics.bodies == kept.physics.bodies).all()


@pytest.mark.parametrize("part", ["liquids", "recogniser", "_controller"])
def test_what_changes_is_saved(pouring, simulation, part):
    kept, targets, _ = pouring
    simulation.set_state(kept)
    watched = getattr(simulation, part)

    def unsaved() -> dict[str, bytes]:
        return {k: pickle.dumps(v) for k, v in vars(watched).items() if k not in watched.SAVED}

    before = unsaved()
    run(simulation, targets)
    assert unsaved() == before
    assert set(watched.SAVED) <= set(vars(watched))


def test_a_state_is_frozen(simulation):
    with pytest.raises(FrozenInstanceError):
        simulation.get_state().target = np.zeros(16)


def test_the_state_of_another_station_is_refused_and_harms_nothing(simulation):
    state = simulation.get_state()
    foreign = replace(
        state, physics=replace(state.physics, integration=np.zeros(5), bodies=np.zeros((2, 7)))
    )
    before = everything(simulation)
    with pytest.raises(ConfigError) as error:
        simulation.set_state(foreign)
    size, bodies = state.physics.integration.size, simulation.model.nbody
    assert str(error.value) == (
        f"The state is of another station (5 numbers, 2 bodies; this one has {size} and {bodies})."
    )
    assert everything(simulation) == before


def test_a_reset_after_going_back_is_a_reset(pouring, simulation):
    simulation.reset(nominal_layout())
    fresh = everything(simulation)
    simulation.set_state(pouring[0])
    simulation.reset(nominal_layout())
    assert everything(simulation) == fresh
