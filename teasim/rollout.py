"""Demonstrations carried out in physics, frame by frame, from a plan or from a log."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from teasim.common.errors import ConfigError, SkillError
from teasim.constants import CONTROL_TIMESTEP
from teasim.skills.demonstrators import OPERATOR, Participant, sample_style, varied
from teasim.skills.library import perform
from teasim.skills.pace import Pace, idle
from teasim.skills.style import Style
from teasim.task.mistakes import Plan
from teasim.world.simulation import Simulation
from teasim.world.station import draw_layout

FINAL_REST = 0.5
"""Shortest rest after the last sub-task [s]."""


@dataclass(frozen=True)
class Step:
    """One control step of a demonstration, before it is carried out."""

    subtask: str
    """The sub-task being worked on."""
    position: int
    """Index of that sub-task in the demonstration."""
    target: np.ndarray
    """Target, float32 as it is logged: joint angles [rad] and openings [m] (16,) for YuMi, (14,)
    for a person."""


def demonstrate(
    simulation: Simulation,
    plan: Plan,
    rng: np.random.Generator,
    *,
    randomize: bool = True,
    match_length: bool = False,
    participant: Participant = OPERATOR,
) -> Iterator[Step]:
    """Reset the station to a random layout and let `participant` carry out `plan` step by step.

    Without `randomize` everything starts in its nominal place. With `match_length` rests give the
    demonstration a length independent of its plan. Each step is yielded before the simulation is
    advanced, which happens when the next step is requested. The targets have the float32 precision
    of a log, so `replay` gives the same bits.

    Raises:
        ConfigError: the simulation has another embodiment than the participant.
        SkillError: a sub-task cannot be carried out from the present state.
    """
    _take_place(simulation, participant)
    simulation.reset(draw_layout(rng, randomize=randomize))
    style = sample_style(rng, participant)
    pace = Pace(plan.steps, participant.embodiment, rng) if match_length else None
    for position, subtask in enumerate(plan.steps):
        elapsed = float(simulation.data.time)
        rest = pace.rest(position, elapsed, style) if pace else 0.0
        yield from _rest(simulation, subtask, position, rest, rng)
        now = varied(style, rng, participant)
        for target in perform(subtask, simulation, now, plan.manner(position)):
            yield from _advance(simulation, subtask, position, target)
    rest = pace.length - float(simulation.data.time) if pace else FINAL_REST
    if rest < FINAL_REST - CONTROL_TIMESTEP:
        raise SkillError(f"The demonstration exceeds its length by {FINAL_REST - rest:.1f} s.")
    last = len(plan.steps) - 1
    yield from _rest(simulation, plan.steps[last], last, rest - FINAL_REST, rng)
    for _ in range(round(FINAL_REST / CONTROL_TIMESTEP)):
        yield from _advance(simulation, plan.steps[last], last, simulation.target)


def _take_place(simulation: Simulation, participant: Participant) -> None:
    if simulation.embodiment.name != participant.embodiment:
        raise ConfigError(
            f"{participant.name} works with the embodiment '{participant.embodiment}', "
            f"the station has '{simulation.embodiment.name}'; choose one for both."
        )
    if participant.appearance is not None:
        simulation.dress(participant.appearance)


def _rest(
    simulation: Simulation,
    subtask: str,
    position: int,
    seconds: float,
    rng: np.random.Generator,
) -> Iterator[Step]:
    for target in idle(simulation, seconds, rng):
        yield from _advance(simulation, subtask, position, target)


def _advance(
    simulation: Simulation, subtask: str, position: int, target: np.ndarray
) -> Iterator[Step]:
    logged = target.astype(np.float32)
    yield Step(subtask, position, logged)
    simulation.step(logged)


def replay(
    simulation: Simulation,
    targets: Iterable[np.ndarray],
    rng: np.random.Generator,
    *,
    randomize: bool = True,
) -> Iterator[np.ndarray]:
    """Carry out a demonstration again from its log.

    Each target is yielded before the simulation is advanced, as in `demonstrate`.

    Args:
        simulation: The station; it is reset to the layout that `rng` draws.
        targets: The log, column `action` of a pool: angles [rad] and openings [m] (16,) each.
        rng: The generator of the demonstration, `teasim.generation.demo_rng` for a pool.
        randomize: As in `demonstrate`.
    """
    simulation.reset(draw_layout(rng, randomize=randomize))
    for target in targets:
        yield target
        simulation.step(target)


def run_subtask(simulation: Simulation, subtask: str, style: Style) -> int:
    """Carry out one sub-task and return the number of control steps it took.

    Raises:
        SkillError: it cannot be carried out from the present state.
    """
    steps = 0
    for target in perform(subtask, simulation, style):
        simulation.step(target)
        steps += 1
    return steps
