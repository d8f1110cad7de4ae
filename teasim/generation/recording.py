"""One demonstration of a pool: carried out, checked against its labels, and written."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np

from teasim.common.errors import GenerationError, SkillError
from teasim.constants import FPS, SUBTASKS
from teasim.generation.config import GenerateConfig
from teasim.generation.plan import DemoPlan
from teasim.pool import EpisodeRecord, EpisodeWriter, MistakeSpan, PoolHeader, Span
from teasim.render import StationRenderer
from teasim.rollout import Step, demonstrate
from teasim.skills.demonstrators import PARTICIPANTS
from teasim.task.mistakes import PlannedMistake
from teasim.task.recipes import oven_is_on
from teasim.task.scoring import Verdict, judge, spills
from teasim.task.subtasks import find_subtask
from teasim.world.bodies.embodiments import find_embodiment
from teasim.world.looks.look import draw_look
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES, Simulation

Film = Callable[[], dict[str, np.ndarray]]
"""Returns a picture (H, W, 3) uint8 by camera."""

ATTEMPTS = 6
"""Largest number of attempts at a demonstration that does not come out as labelled."""


def pool_header(config: GenerateConfig) -> PoolHeader:
    """Return what all demonstrations of the pool have in common."""
    body = find_embodiment(config.embodiment)
    return PoolHeader(
        fps=FPS,
        cameras=config.filming,
        height=config.size,
        width=config.size,
        subtasks=SUBTASKS,
        state_names=body.state_names if body.logged else None,
        environment_state_names=ENVIRONMENT_STATE_NAMES if body.logged else None,
        robot_type=body.robot_type,
        config=asdict(config),
    )


def demo_rng(seed: int, index: int, attempt: int = 0) -> np.random.Generator:
    """Return the generator of one attempt at a demonstration; nearly always the first succeeds."""
    return np.random.default_rng([seed, 1, index, attempt])


def generate_demo(root: Path, config: GenerateConfig, demo: DemoPlan) -> int:
    """Carry out one demonstration until it comes out as labelled; return the number of attempts.

    Raises:
        GenerationError: it never did.
    """
    reason = ""
    for attempt in range(ATTEMPTS):
        rng = demo_rng(config.seed, demo.index, attempt)
        with EpisodeWriter(root, demo.index, pool_header(config)) as writer:
            try:
                reason = _record(writer, config, demo, rng)
            except SkillError as error:
                reason = str(error)
            if not reason:
                return attempt + 1
    raise GenerationError(
        f"Demonstration {demo.index} ({', '.join(demo.plan.steps)}) failed {ATTEMPTS} times; "
        f"the last time: {reason}"
    )


def _record(
    writer: EpisodeWriter, config: GenerateConfig, demo: DemoPlan, rng: np.random.Generator
) -> str:
    """Write one attempt; return why it is not as labelled, or "" if it is."""
    simulation = Simulation(config.embodiment)
    participant = PARTICIPANTS[demo.participant]
    steps = demonstrate(
        simulation,
        demo.plan,
        rng,
        randomize=config.randomize,
        match_length=config.match_length,
        participant=participant,
        execution_noise=config.execution_noise,
    )
    positions: list[int] = []
    with _filming(simulation, config, demo) as pictures:
        rewarded = False
        for step in steps:
            success = _verdict(simulation).success
            writer.add_frame(
                images=pictures(),
                **_log(simulation, step),
                subtask_index=SUBTASKS.index(step.subtask),
                reward=float(success and not rewarded),
                success=success,
            )
            rewarded = rewarded or success
            positions.append(step.position)
    reason = mismatch(demo, simulation)
    if not reason:
        writer.finish(_episode_record(demo, positions, config.seed))
    return reason


@contextmanager
def _filming(simulation: Simulation, config: GenerateConfig, demo: DemoPlan) -> Iterator[Film]:
    """Yield a function that returns the present picture of each camera, none without video."""
    if not config.video:
        yield dict
        return
    # With randomness of its own, a pool in another look holds the same demonstrations.
    rng = np.random.default_rng([config.seed, 2, demo.index])
    with StationRenderer(
        simulation,
        width=config.size,
        height=config.size,
        quality=config.quality,
        look=draw_look(config.look, rng),
    ) as renderer:
        yield partial(renderer.frames, config.cameras)


def _log(simulation: Simulation, step: Step) -> dict[str, np.ndarray | None]:
    """Return the logged columns of a frame; None where the embodiment has no log."""
    logged = simulation.embodiment.logged
    return {
        "state": simulation.joint_state() if logged else None,
        "action": step.target if logged else None,
        "environment_state": simulation.environment_state() if logged else None,
    }


def mismatch(demo: DemoPlan, simulation: Simulation) -> str:
    """Return how the physical events differ from the labels of the demonstration, or ""."""
    done, expected = simulation.subtasks_done, demo.plan.outcome
    if done != expected:
        happened, planned = Counter(done), Counter(expected)
        missing = ", ".join((planned - happened).elements()) or "none"
        extra = ", ".join((happened - planned).elements()) or "none"
        return f"Physics saw another order than planned (missing: {missing}; extra: {extra})."
    meant = [f"spilled_{find_subtask(name).content}" for name in demo.plan.spilled]
    spilled = spills(simulation.liquids.spilled)
    if set(spilled) - set(meant):
        return f"Something went beside the cup ({', '.join(spilled)})."
    if set(meant) - set(spilled):
        return f"Something was to go beside the cup and did not ({', '.join(meant)})."
    if simulation.oven_on != oven_is_on(expected):
        return "The oven is not as the knob was turned."
    return ""


def _verdict(simulation: Simulation) -> Verdict:
    return judge(
        simulation.subtasks_done,
        oven_on=simulation.oven_on,
        spilled=simulation.liquids.spilled,
    )


def _episode_record(demo: DemoPlan, positions: Sequence[int], seed: int) -> EpisodeRecord:
    at = np.asarray(positions)
    steps = demo.plan.steps
    starts = [*(int(np.argmax(at == k)) for k in range(len(steps))), len(at)]
    spans = tuple(Span(name, starts[k], starts[k + 1]) for k, name in enumerate(steps))
    mistakes = sorted(
        (_mistake_span(planned, starts) for planned in demo.plan.labels),
        key=lambda span: (span.start, span.subtask),
    )
    return EpisodeRecord(
        sequence=demo.sequence,
        correct=not demo.plan.mistakes,
        mistakes=tuple(mistakes),
        spans=spans,
        participant=demo.participant,
        embodiment=PARTICIPANTS[demo.participant].embodiment,
        seed=seed,
    )


def _mistake_span(planned: PlannedMistake, starts: Sequence[int]) -> MistakeSpan:
    """Return the span of a mistake: that of its step, or an empty one where a step is skipped."""
    start = starts[planned.position]
    stop = start if planned.name == "skip" else starts[planned.position + 1]
    return MistakeSpan(planned.name, planned.subtask, start, stop)
