"""A station at rest in its nominal layout, new for every test."""

import pytest

from teasim.world.simulation import Simulation
from teasim.world.station import nominal_layout


@pytest.fixture
def simulation():
    station = Simulation()
    station.reset(nominal_layout())
    return station
