"""Forbidden contacts are counted when they begin."""

import numpy as np
import pytest

from teasim.constants import ARM_JOINTS
from teasim.world.collisions import CollisionCounter, forbidden_kinds
from teasim.world.monitor import Monitor, is_forbidden, roles
from teasim.world.station import station_model


def fold(simulation) -> None:
    """Put both arms into each other and into the torso."""
    for joints in ARM_JOINTS.values():
        for name in joints:
            simulation.data.joint(name).qpos = 0


def test_the_table_of_shapes_says_what_the_monitor_says():
    model = station_model()
    names, kinds = roles(model), forbidden_kinds(model)
    assert (kinds == kinds.T).all()
    numbers: dict[int, set[frozenset[str]]] = {}
    for i, j in np.random.default_rng(0).integers(model.ngeom, size=(2000, 2)):
        assert bool(kinds[i, j]) == is_forbidden((names[i], names[j])), (names[i], names[j])
        if kinds[i, j]:
            numbers.setdefault(int(kinds[i, j]), set()).add(frozenset((names[i], names[j])))
    assert numbers
    assert all(len(pairs) == 1 for pairs in numbers.values())


def test_a_station_at_rest_has_nothing_to_count(simulation):
    counter = CollisionCounter(simulation)
    simulation.step(simulation.target)
    assert simulation.data.ncon
    assert (counter.begun, counter.touching) == (0, frozenset())


def test_folded_arms_are_counted_as_the_monitor_names_them(simulation):
    counter, monitor = CollisionCounter(simulation), Monitor(simulation)
    fold(simulation)
    simulation.step(simulation.target)
    assert counter.begun >= len(monitor.forbidden) > 0


def test_a_contact_that_lasts_is_counted_once():
    model = station_model()
    arm, table = (roles(model).index(name) for name in ("right_arm", "table"))

    class Contacts:
        geom, dist = np.array([[arm, table], [table, arm]], np.int32), np.array([-1e-4, -1e-4])

    class Data:
        ncon, contact = 2, Contacts

    class Station:
        observers: list = []  # noqa: RUF012
        data = Data

    Station.model = model
    counter = CollisionCounter(Station)
    (look,) = Station.observers
    for ncon, begun in ((2, 1), (2, 1), (0, 1), (2, 2)):
        Data.ncon = ncon
        look()
        assert counter.begun == begun
    Contacts.dist = np.array([1e-4, 1e-4])  # near is not touching
    look()
    assert (counter.begun, counter.touching) == (2, frozenset())


@pytest.mark.parametrize("begun", [0, 3])
def test_a_counter_starts_from_zero_and_can_go_back(simulation, begun):
    counter = CollisionCounter(simulation)
    counter.begun, counter.touching = begun, frozenset({7})
    state = counter.state()
    counter.reset()
    assert (counter.begun, counter.touching) == (0, frozenset())
    counter.restore(state)
    assert (counter.begun, counter.touching) == (begun, frozenset({7}))
