"""Demonstrations carried out in physics, frame by frame, from a plan or from a log."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import repeat

import numpy as np

from teasim.common.errors import ConfigError, SkillError
from teasim.constants import ARMS, CONTROL_TIMESTEP
from teasim.skills.demonstrators import OPERATOR, Participant, sample_style, varied
from teasim.skills.library import perform
from teasim.skills.pace import Pace, idle
from teasim.skills.style import Style
from teasim.task.mistakes import Plan
from teasim.world.disturbance import disturbances
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
    execution_noise: float = 0.0,
) -> Iterator[Step]:
    """Reset the station to a random layout and let `participant` carry out `plan` step by step.

    Each step is yielded before the simulation is advanced, which happens when the next step is
    requested. The targets have the float32 precision of a log, so `replay` gives the same bits.

    Args:
        simulation: The station.
        plan: Sub-tasks and mistakes.
        rng: The only source of randomness.
        randomize: Draw the layout; otherwise everything starts in its nominal place.
        match_length: Add rests that make the length independent of the plan.
        participant: Who demonstrates.
        execution_noise: Standard deviation of the disturbance of the executed targets [rad]; the
            steps hold the planned targets.

    Raises:
        ConfigError: the simulation has another embodiment than the participant.
        SkillError: a sub-task cannot be carried out from the present state.
    """
    _take_place(simulation, participant)
    simulation.reset(draw_layout(rng, randomize=randomize))
    offsets = _offsets(execution_noise, simulation, rng)
    style = sample_style(rng, participant)
    pace = Pace(plan.steps, participant.embodiment, rng) if match_length else None
    steps = _steps(simulation, plan, rng, participant=participant, style=style, pace=pace)
    for step, offset in zip(steps, offsets, strict=False):
        yield step
        simulation.step(step.target, offset)


def _steps(
    simulation: Simulation,
    plan: Plan,
    rng: np.random.Generator,
    *,
    participant: Participant,
    style: Style,
    pace: Pace | None,
) -> Iterator[Step]:
    """Yield the steps of a demonstration; the caller advances the simulation after each."""
    for position, subtask in enumerate(plan.steps):
        elapsed = float(simulation.data.time)
        rest = pace.rest(position, elapsed, style) if pace else 0.0
        for target in idle(simulation, rest, rng):
            yield _step(subtask, position, target)
        now = varied(style, rng, participant)
        for target in perform(subtask, simulation, now, plan.manner(position)):
            yield _step(subtask, position, target)
    rest = pace.length - float(simulation.data.time) if pace else FINAL_REST
    if rest < FINAL_REST - CONTROL_TIMESTEP:
        raise SkillError(f"The demonstration exceeds its length by {FINAL_REST - rest:.1f} s.")
    last = len(plan.steps) - 1
    for target in idle(simulation, rest - FINAL_REST, rng):
        yield _step(plan.steps[last], last, target)
    for _ in range(round(FINAL_REST / CONTROL_TIMESTEP)):
        yield _step(plan.steps[last], last, simulation.target)


def _step(subtask: str, position: int, target: np.ndarray) -> Step:
    return Step(subtask, position, target.astype(np.float32))


def _offsets(
    sigma: float, simulation: Simulation, rng: np.random.Generator
) -> Iterator[np.ndarray | None]:
    """Return an endless iterator of offsets of the executed targets; without noise, of None.

    The noise has a generator of its own, so the layout and the style do not depend on it.
    """
    if not sigma:
        return repeat(None)
    return disturbances(sigma, len(ARMS) * simulation.embodiment.width, rng.spawn(1)[0])


def _take_place(simulation: Simulation, participant: Participant) -> None:
    if simulation.embodiment.name != participant.embodiment:
        raise ConfigError(
            f"{participant.name} works with the embodiment '{participant.embodiment}', "
            f"the station has '{simulation.embodiment.name}'; choose one for both."
        )
    if participant.appearance is not None:
        simulation.dress(participant.appearance)


def replay(
    simulation: Simulation,
    targets: Iterable[np.ndarray],
    rng: np.random.Generator,
    *,
    randomize: bool = True,
    execution_noise: float = 0.0,
) -> Iterator[np.ndarray]:
    """Carry out a demonstration again from its log, to the bit.

    Each target is yielded before the simulation is advanced, as in `demonstrate`.

    Args:
        simulation: The station; it is reset to the layout that `rng` draws.
        targets: The log, column `action` of a pool: angles [rad] and openings [m] (16,) each.
        rng: The generator of the demonstration, `teasim.generation.demo_rng` for a pool.
        randomize: As in `demonstrate`.
        execution_noise: As in `demonstrate`; the disturbance is the same for the same `rng`.
    """
    simulation.reset(draw_layout(rng, randomize=randomize))
    for target, offset in zip(targets, _offsets(execution_noise, simulation, rng), strict=False):
        yield target
        simulation.step(target, offset)


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
