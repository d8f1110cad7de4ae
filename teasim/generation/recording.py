"""One demonstration of a pool: carried out, checked against its label, and written with video."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from teasim.common.errors import GenerationError, SkillError
from teasim.constants import FPS, STATE_NAMES, SUBTASKS
from teasim.generation.config import GenerateConfig
from teasim.generation.plan import DemoPlan
from teasim.pool import EpisodeRecord, EpisodeWriter, MistakeSpan, PoolHeader, Span
from teasim.render import StationRenderer
from teasim.rollout import Step, demonstrate
from teasim.skills.demonstrators import PARTICIPANTS
from teasim.task.mistakes import PlannedMistake
from teasim.task.scoring import Verdict, judge, spills
from teasim.world.liquids import VESSELS
from teasim.world.looks import draw_look
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES, Simulation

ATTEMPTS = 6
"""A demonstration that does not come out as its label says is made again at most this often."""
_CONTENT = {f"add_{vessel.content}": vessel.content for vessel in VESSELS.values()}


def pool_header(config: GenerateConfig) -> PoolHeader:
    """What all demonstrations of the pool have in common."""
    person = config.embodiment == "person"  # a film of people comes without any log
    return PoolHeader(
        fps=FPS,
        cameras=config.cameras,
        height=config.size,
        width=config.size,
        subtasks=SUBTASKS,
        state_names=None if person else STATE_NAMES,
        environment_state_names=None if person else ENVIRONMENT_STATE_NAMES,
        robot_type=None if person else "abb_yumi",
        config=asdict(config),
    )


def demo_rng(seed: int, index: int, attempt: int = 0) -> np.random.Generator:
    """Randomness of one attempt at a pool's demonstration; nearly always the first one is kept."""
    return np.random.default_rng([seed, 1, index, attempt])


def generate_demo(root: Path, config: GenerateConfig, demo: DemoPlan) -> int:
    """Carry one demonstration out until it comes out as labelled; return the attempts it took.

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
    """Write one attempt; return why it is not as labelled, or nothing when it is."""
    simulation = Simulation(config.embodiment)
    participant = PARTICIPANTS[demo.participant]
    steps = demonstrate(
        simulation,
        demo.plan,
        rng,
        randomize=config.randomize,
        match_length=config.match_length,
        participant=participant,
    )
    positions: list[int] = []
    with _camera(simulation, config, demo) as renderer:
        rewarded = False
        for step in steps:
            success = _verdict(simulation).success
            _add_frame(writer, simulation, renderer, config, step, success, not rewarded)
            rewarded = rewarded or success
            positions.append(step.position)
    reason = mismatch(demo, simulation)
    if not reason:
        writer.finish(_episode_record(demo, positions, config.seed))
    return reason


def _camera(simulation: Simulation, config: GenerateConfig, demo: DemoPlan) -> StationRenderer:
    # Its own randomness: a pool in another look holds the same demonstrations.
    rng = np.random.default_rng([config.seed, 2, demo.index])
    return StationRenderer(
        simulation,
        width=config.size,
        height=config.size,
        quality=config.quality,
        look=draw_look(config.look, rng),
    )


def _add_frame(
    writer: EpisodeWriter,
    simulation: Simulation,
    renderer: StationRenderer,
    config: GenerateConfig,
    step: Step,
    success: bool,
    first: bool,
) -> None:
    logged = config.embodiment != "person"
    writer.add_frame(
        images=renderer.frames(config.cameras),
        state=simulation.joint_state() if logged else None,
        action=step.target if logged else None,
        environment_state=simulation.environment_state() if logged else None,
        subtask_index=SUBTASKS.index(step.subtask),
        reward=float(success and first),
        success=success,
    )


def mismatch(demo: DemoPlan, simulation: Simulation) -> str:
    """Say how what happened physically differs from what the demonstration is labelled as."""
    done, expected = simulation.subtasks_done, demo.plan.outcome
    if done != expected:
        happened, planned = Counter(done), Counter(expected)
        missing = ", ".join((planned - happened).elements()) or "none"
        extra = ", ".join((happened - planned).elements()) or "none"
        return f"Physics saw another order than planned (missing: {missing}; extra: {extra})."
    meant = [f"spilled_{_CONTENT[name]}" for name in demo.plan.spilled]
    spilled = spills(simulation.liquids.spilled)
    if set(spilled) - set(meant):
        return f"Something went beside the cup ({', '.join(spilled)})."
    if set(meant) - set(spilled):
        return f"Something was to go beside the cup and did not ({', '.join(meant)})."
    if simulation.oven_on != (_turns(expected) > 0):
        return "The oven is not as the knob was turned."
    return ""


def _turns(done: Sequence[str]) -> int:
    return done.count("turn_on_oven") - done.count("turn_off_oven")


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
        (_mistake_span(planned, starts) for planned in demo.plan.mistakes),
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
    """A mistake lasts as long as its step; what is skipped has a place and no length."""
    start = starts[planned.position]
    stop = start if planned.name == "skip" else starts[planned.position + 1]
    return MistakeSpan(planned.name, planned.subtask, start, stop)
