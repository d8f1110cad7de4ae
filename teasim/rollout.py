"""One demonstration carried out in physics, frame by frame, with the physics' own verdict."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from teasim.constants import CONTROL_TIMESTEP
from teasim.errors import ConfigError
from teasim.skills.arm import Style
from teasim.skills.demonstrators import OPERATOR, Participant, sample_style, varied
from teasim.skills.library import perform
from teasim.world.simulation import Simulation
from teasim.world.station import sample_layout

FINAL_REST = 0.5
"""The station is shown this long after the last sub-task [s]."""


@dataclass(frozen=True)
class Step:
    """One control step of a demonstration, as seen before it is carried out."""

    subtask: str
    """The sub-task being worked on."""
    position: int
    """Index of that sub-task in the demonstration."""
    target: np.ndarray
    """Joint angles [rad] and openings [m] to go to: (16,) for YuMi, (14,) for a person."""


def demonstrate(
    simulation: Simulation,
    subtasks: tuple[str, ...],
    rng: np.random.Generator,
    participant: Participant = OPERATOR,
) -> Iterator[Step]:
    """Reset the station to a random layout and let `participant` carry out `subtasks` in order.

    The simulation stands before each yielded step, so a caller can look at it, and is advanced
    when the next one is asked for.

    Raises:
        ConfigError: the simulation has not the participant's body.
        SkillError: a sub-task cannot be done from the state the ones before it left.
    """
    if simulation.embodiment.name != participant.embodiment:
        raise ConfigError(
            f"{participant.name} works with the embodiment '{participant.embodiment}', "
            f"the station has '{simulation.embodiment.name}'; choose one for both."
        )
    if participant.look is not None:
        simulation.dress(participant.look)
    simulation.reset(sample_layout(rng))
    style = sample_style(rng, participant)
    for position, subtask in enumerate(subtasks):
        for target in perform(subtask, simulation, varied(style, rng, participant)):
            yield Step(subtask, position, target)
            simulation.step(target)
    for _ in range(round(FINAL_REST / CONTROL_TIMESTEP)):
        yield Step(subtasks[-1], len(subtasks) - 1, simulation.target)
        simulation.step(simulation.target)


def run_subtask(simulation: Simulation, subtask: str, style: Style) -> int:
    """Carry out one sub-task at once and return the number of control steps it took.

    Raises:
        SkillError: it cannot be done from the present state.
    """
    steps = 0
    for target in perform(subtask, simulation, style):
        simulation.step(target)
        steps += 1
    return steps
