"""One demonstration carried out in physics, frame by frame, and carried out again from its log."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from teasim.constants import CONTROL_TIMESTEP
from teasim.skills.arm import Style
from teasim.skills.demonstrators import sample_style, varied
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
    """Joint angles [rad] and gripper openings [m] to go to (16,), float32 as they are logged."""


def demonstrate(
    simulation: Simulation, subtasks: tuple[str, ...], rng: np.random.Generator
) -> Iterator[Step]:
    """Reset the station to a random layout and carry out `subtasks` in order.

    The simulation stands before each yielded step, so a caller can look at it, and is advanced
    when the next one is asked for. It goes to the float32 targets that a log holds, so `replay`
    gives the same bits.

    Raises:
        SkillError: a sub-task cannot be done from the state the ones before it left.
    """
    simulation.reset(sample_layout(rng))
    style = sample_style(rng)
    for position, subtask in enumerate(subtasks):
        for target in perform(subtask, simulation, varied(style, rng)):
            logged = target.astype(np.float32)
            yield Step(subtask, position, logged)
            simulation.step(logged)
    rest = simulation.target.astype(np.float32)
    for _ in range(round(FINAL_REST / CONTROL_TIMESTEP)):
        yield Step(subtasks[-1], len(subtasks) - 1, rest)
        simulation.step(rest)


def replay(
    simulation: Simulation, targets: Iterable[np.ndarray], rng: np.random.Generator
) -> Iterator[np.ndarray]:
    """Carry a demonstration out again from its log.

    The simulation stands before each yielded target, as in `demonstrate`, and after the last one
    when the iterator is exhausted.

    Args:
        simulation: the station; it is reset to the layout that `rng` draws.
        targets: the log, the column `action` of a pool: angles [rad] and openings [m] (16,) each.
        rng: a generator as `demonstrate` was given it; `teasim.generate.demo_rng` for a pool's.
    """
    simulation.reset(sample_layout(rng))
    for target in targets:
        yield target
        simulation.step(target)


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
