"""Videos of a scene as a pool, with the truth about each for counting."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from scenes.scene import KINDS, Act, Plan, Scene, World, make_plan
from teasim.common import parallel
from teasim.common.workers import Workers
from teasim.pool import EpisodeRecord, EpisodeWriter, MistakeSpan, Pool, PoolHeader, Span
from teasim.pool import finalize_pool as finalize

FPS = 10
"""Frames per second."""
BANK: Mapping[str, int] = {
    "usual": 24,
    "free": 16,
    "missing": 8,
    "out_of_order": 8,
    "extra": 8,
    "ineffective": 8,
}
"""Videos of each kind from which pools are drawn."""
PACE = 0.12
"""Standard deviation of the log of a person's pace, and of each step's and rest's."""


def make_bank(root: Path, scene: Scene, *, seed: int, workers: Workers) -> Pool:
    """Write the videos of a scene to `root`, unless they are there."""
    header = PoolHeader(
        fps=FPS,
        cameras=scene.cameras,
        height=scene.height,
        width=scene.width,
        subtasks=(*scene.steps, *scene.spares),
        state_names=None,
        environment_state_names=None,
        robot_type=None,
        config={"scene": scene.name, "seed": seed},
    )
    if (root / "meta" / "info.json").exists():
        return Pool.open(root)
    kinds = [kind for kind in KINDS for _ in range(BANK[kind])]
    tasks = [(root, header, number, kind) for number, kind in enumerate(kinds)]
    parallel.run(write_video, tasks, workers=workers, description=scene.name)
    return finalize(root, header, len(tasks))


def write_video(task: tuple[Path, PoolHeader, int, str]) -> None:
    """Write one video."""
    from scenes.registry import SCENES

    root, header, number, kind = task
    scene = SCENES[header.config["scene"]]
    rng = np.random.default_rng([header.config["seed"], number])
    plan = make_plan(scene, kind, rng)
    world = scene.world(rng)
    spans: list[Span] = []
    with EpisodeWriter(root, number, header) as writer:
        for frame, step in enumerate(play(scene, plan, world, rng)):
            label = header.subtasks.index(step) if step else -1
            writer.add_frame(images=world.pictures(), subtask_index=label)
            if step and spans and spans[-1] == Span(step, spans[-1].start, frame):
                spans[-1] = Span(step, spans[-1].start, frame + 1)
            elif step:
                spans.append(Span(step, frame, frame + 1))
        writer.finish(_record(scene, plan, spans, number))
    if hasattr(world, "close"):
        world.close()


def play(scene: Scene, plan: Plan, world: World, rng: np.random.Generator) -> Iterator[str | None]:
    """Carry out a plan frame by frame; yield the step of each frame, None at rest."""
    pace = np.exp(rng.normal(0, PACE))
    for act in plan.acts:
        yield from _wait(scene.pause, pace, world, rng)
        yield from _act(scene, act, pace, world, rng)
    yield from _wait(scene.pause, pace, world, rng)


def _act(
    scene: Scene, act: Act, pace: float, world: World, rng: np.random.Generator
) -> Iterator[str]:
    frames = max(6, round(FPS * scene.seconds * pace * np.exp(rng.normal(0, PACE))))
    for frame in range(1, frames + 1):
        world.move(act.step, frame / frames, act.works)
        yield act.step


def _wait(seconds: float, pace: float, world: World, rng: np.random.Generator) -> Iterator[None]:
    for _ in range(max(3, round(FPS * seconds * pace * np.exp(rng.normal(0, 2 * PACE))))):
        world.rest()
        yield None


def _record(scene: Scene, plan: Plan, spans: list[Span], number: int) -> EpisodeRecord:
    correct = plan.wrong is None
    mistakes: tuple[MistakeSpan, ...] = ()
    if plan.wrong is not None:
        mistakes = (_mistake(scene, plan, spans, plan.wrong),)
    return EpisodeRecord(
        sequence="seq_1" if plan.kind == "usual" else "legal" if correct else "seq_3",
        correct=correct,
        mistakes=mistakes,
        spans=tuple(spans),
        participant=f"p{number % 3 + 1}",
        embodiment="yumi",
        seed=number,
        task=f"scene {scene.name}",
    )


def _mistake(scene: Scene, plan: Plan, spans: list[Span], place: int) -> MistakeSpan:
    if plan.kind != "missing":
        span = spans[place]
        return MistakeSpan(plan.kind, span.subtask, span.start, span.stop)
    shown = {span.subtask for span in spans}
    step = next(s for s in scene.steps if s not in shown and s not in scene.optional)
    start = spans[place].start if place < len(spans) else spans[-1].stop
    return MistakeSpan("missing", step, start, start)
