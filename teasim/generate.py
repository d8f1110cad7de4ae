"""Pools of demonstrations: planned, carried out in physics, checked, and written with video."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from teasim.constants import FPS, STATE_NAMES, SUBTASKS
from teasim.errors import ConfigError, GenerationError, SkillError
from teasim.gl import choose_gl
from teasim.parallel import check_workers, run
from teasim.pool import (
    EpisodeRecord,
    EpisodeWriter,
    MistakeSpan,
    Pool,
    PoolHeader,
    Span,
    claim_folder,
    episode_is_done,
    finalize_pool,
)
from teasim.render import StationRenderer, check_cameras, check_look
from teasim.rollout import Step, demonstrate
from teasim.task.mistakes import Plan, mistake
from teasim.task.recipes import INCORRECT, OPTIMAL, SEQ_1, SEQ_2, SUBOPTIMAL, recognisable
from teasim.task.scoring import Verdict, judge
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES, Simulation

ATTEMPTS = 6
"""A demonstration that does not come out as its label says is made again at most this often."""
SIZES = (32, 1024)
"""Smallest and largest side of a video [pixels]."""


@dataclass(frozen=True)
class GenerateConfig:
    """What a pool is to hold. Everything here decides its content; workers do not."""

    seq1: int = 10
    """Demonstrations in the optimal order, Seq_1."""
    seq2: int = 0
    """Demonstrations in the sub-optimal order, Seq_2."""
    seq3: int = 0
    """Incorrect demonstrations, Seq_3: one or two of tea bag, water and oven-off left out."""
    mistakes: tuple[tuple[str, int], ...] = ()
    """Further incorrect demonstrations: Seq_1 with a mistake (NAME or NAME@SUBTASK, how many)."""
    cameras: tuple[str, ...] = ("left", "cup")
    """Cameras that film."""
    size: int = 224
    """Width and height of the videos [pixels]; even."""
    quality: str = "fast"
    """Look of the pictures: fast or nice."""
    seed: int = 0
    """Seed of layouts, styles and mistakes."""

    def __post_init__(self) -> None:
        """Check every field.

        Raises:
            ConfigError: a count is negative, the pool is empty, or a name or size is unknown.
        """
        check_cameras(self.cameras)
        check_look(self.size, self.size, self.quality)
        sequences = {"--seq1": self.seq1, "--seq2": self.seq2, "--seq3": self.seq3}
        counts = sequences | dict(self.mistakes)
        for name, count in counts.items():
            if count < 0:
                raise ConfigError(f"{name} is {count}; give 0 or more demonstrations.")
        for spec, _ in self.mistakes:
            _with_mistakes([spec], np.random.default_rng(0))
        if not sum(counts.values()):
            raise ConfigError("The pool would be empty; ask for demonstrations with --seq1 N.")
        if not SIZES[0] <= self.size <= SIZES[1] or self.size % 2:
            raise ConfigError(
                f"The size is {self.size}; choose an even number from {SIZES[0]} to {SIZES[1]}."
            )
        if self.seed < 0:
            raise ConfigError(f"The seed is {self.seed}; choose 0 or more.")


@dataclass(frozen=True)
class DemoPlan:
    """One demonstration before it is carried out."""

    index: int
    """Its number in the pool."""
    sequence: str
    """seq_1, seq_2 or seq_3."""
    plan: Plan
    """Steps and mistakes."""


@dataclass(frozen=True)
class Generated:
    """A finished pool and what it took."""

    pool: Pool
    """The pool."""
    remade: int
    """Demonstrations thrown away because they did not come out as labelled."""


def generate(
    root: Path | str, config: GenerateConfig, *, jobs: int = 1, backend: str = "loky"
) -> Generated:
    """Make a pool below `root`, in `jobs` processes; an interrupted one is continued.

    Raises:
        ConfigError: `jobs` or `backend` makes no sense.
        PoolError: `root` is in use.
        GenerationError: a demonstration never came out as labelled.
        RenderError: no headless OpenGL back end works.
    """
    check_workers(jobs, backend)
    choose_gl()  # without it nothing can be filmed, so nothing is begun
    plans = plan_pool(config)
    header = pool_header(config)
    claim_folder(Path(root), header)
    waiting = [plan for plan in plans if not episode_is_done(root, plan.index, header)]
    make = partial(generate_demo, Path(root), config)
    attempts = run(make, waiting, jobs=jobs, backend=backend, description="demonstrations")
    return Generated(finalize_pool(root, header, len(plans)), sum(attempts) - len(attempts))


def pool_header(config: GenerateConfig) -> PoolHeader:
    """What all demonstrations of the pool have in common."""
    return PoolHeader(
        fps=FPS,
        cameras=config.cameras,
        height=config.size,
        width=config.size,
        subtasks=SUBTASKS,
        state_names=STATE_NAMES,
        environment_state_names=ENVIRONMENT_STATE_NAMES,
        robot_type="abb_yumi",
        config=asdict(config),
    )


def plan_pool(config: GenerateConfig) -> tuple[DemoPlan, ...]:
    """Plan every demonstration; which comes at which place in the pool is shuffled."""
    rng = np.random.default_rng([config.seed, 0])
    plans = [(OPTIMAL, Plan(SEQ_1))] * config.seq1 + [(SUBOPTIMAL, Plan(SEQ_2))] * config.seq2
    for k in range(config.seq3):
        # One omission and two take turns, so that every pool holds both kinds.
        plans.append((INCORRECT, _with_mistakes(["skip"] * (1 + k % 2), rng)))
    for name, count in config.mistakes:
        plans += [(INCORRECT, _with_mistakes([name], rng)) for _ in range(count)]
    order = rng.permutation(len(plans))
    return tuple(DemoPlan(index, *plans[which]) for index, which in enumerate(order))


def _with_mistakes(specs: Sequence[str], rng: np.random.Generator) -> Plan:
    plan = Plan(SEQ_1)
    for spec in specs:
        name, at, subtask = spec.partition("@")
        plan = mistake(name)(plan, rng, subtask if at else None)
    return plan


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
    simulation = Simulation()
    positions: list[int] = []
    with StationRenderer(
        simulation, width=config.size, height=config.size, quality=config.quality
    ) as renderer:
        rewarded = False
        for step in demonstrate(simulation, demo.plan.steps, rng):
            success = _verdict(simulation).success
            _add_frame(writer, simulation, renderer, config, step, success, not rewarded)
            rewarded = rewarded or success
            positions.append(step.position)
    reason = mismatch(demo, simulation)
    if not reason:
        writer.finish(_episode_record(demo, positions, config.seed))
    return reason


def _add_frame(
    writer: EpisodeWriter,
    simulation: Simulation,
    renderer: StationRenderer,
    config: GenerateConfig,
    step: Step,
    success: bool,
    first: bool,
) -> None:
    writer.add_frame(
        images=renderer.frames(config.cameras),
        state=simulation.joint_state(),
        action=step.target,
        environment_state=simulation.environment_state(),
        subtask_index=SUBTASKS.index(step.subtask),
        reward=float(success and first),
        success=success,
    )


def mismatch(demo: DemoPlan, simulation: Simulation) -> str:
    """Say how what happened physically differs from what the demonstration is labelled as."""
    done, expected = simulation.subtasks_done, recognisable(demo.plan.steps)
    if done != expected:
        happened, planned = Counter(done), Counter(expected)
        missing = ", ".join((planned - happened).elements()) or "none"
        extra = ", ".join((happened - planned).elements()) or "none"
        return f"Physics saw another order than planned (missing: {missing}; extra: {extra})."
    verdict = _verdict(simulation)
    spilled = [word for word in verdict.violations if word.startswith("spilled")]
    if spilled:
        return f"Something went beside the cup ({', '.join(spilled)})."
    if verdict.success == bool(demo.plan.mistakes):
        return "The goal was reached in spite of the mistake, or missed without one."
    return ""


def _verdict(simulation: Simulation) -> Verdict:
    return judge(
        simulation.subtasks_done,
        oven_on=simulation.oven_on,
        spilled=simulation.liquids.spilled,
    )


def _episode_record(demo: DemoPlan, positions: Sequence[int], seed: int) -> EpisodeRecord:
    at = np.asarray(positions)
    starts = [*(int(np.argmax(at == k)) for k in range(len(demo.plan.steps))), len(at)]
    spans = tuple(Span(name, starts[k], starts[k + 1]) for k, name in enumerate(demo.plan.steps))
    mistakes = sorted(
        (
            MistakeSpan(m.name, m.subtask, starts[m.position], starts[m.position])
            for m in demo.plan.mistakes
        ),
        key=lambda span: (span.start, span.subtask),
    )
    return EpisodeRecord(
        sequence=demo.sequence,
        correct=not demo.plan.mistakes,
        mistakes=tuple(mistakes),
        spans=spans,
        participant="yumi",
        embodiment="yumi",
        seed=seed,
    )
