"""What a scene is made of, and the plans by which its videos are made."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

MISTAKES = ("missing", "out_of_order", "extra", "ineffective")
"""Kinds of mistakes that a plan can have."""
KINDS = ("usual", "free", *MISTAKES)
"""Kinds of plans: the usual order, any legal order, and one of the mistakes in the usual order."""
OPTIONAL_SHARE = 0.5
"""Share of the videos that show an optional step."""
FARTHEST_TRIES = 200
"""Most legal orders drawn until one is found that differs."""


class World(Protocol):
    """The things of one video; it changes only when it is told to."""

    def move(self, step: str, share: float, works: bool) -> None:
        """Carry out a step up to `share` of its duration, in (0, 1]; without effect if not `works`.

        Within a step `share` rises, and its last call has share 1.
        """

    def rest(self) -> None:
        """Stand still for one frame."""

    def pictures(self) -> dict[str, np.ndarray]:
        """Return (H, W, 3) uint8 RGB per camera."""


class Act(NamedTuple):
    """One step of a plan."""

    step: str
    """Name of the step."""
    works: bool
    """Whether it has its effect."""


@dataclass(frozen=True)
class Scene:
    """A task in a small world."""

    name: str
    """What it is called."""
    world: Callable[[np.random.Generator], World]
    """Makes the things of one video."""
    steps: tuple[str, ...]
    """The steps in their usual order."""
    spares: tuple[str, ...]
    """Steps that do not belong to the task."""
    waits: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Steps that have to come before a step, in a legal order."""
    optional: tuple[str, ...] = ()
    """Steps that half of the videos do without, rightly."""
    cameras: tuple[str, ...] = ("front",)
    """Names of the cameras."""
    height: int = 120
    """Height of the pictures [pixels]."""
    width: int = 160
    """Width of the pictures [pixels]."""
    seconds: float = 2.4
    """Mean duration of a step [s]."""
    pause: float = 0.7
    """Mean duration of the rest between two steps [s]."""


class Plan(NamedTuple):
    """What is to be done in one video, and what is wrong with it."""

    acts: tuple[Act, ...]
    """What is done, in order of time."""
    wrong: int | None
    """Place of the act that is wrong, or before which one is missing; None for a correct plan."""
    kind: str
    """One of KINDS."""


def make_plan(scene: Scene, kind: str, rng: np.random.Generator) -> Plan:
    """Draw a plan of a kind."""
    steps = [
        step for step in scene.steps if step not in scene.optional or rng.random() < OPTIONAL_SHARE
    ]
    if kind == "free":
        steps = legal_order(scene, steps, rng)
    return PLANNERS[kind](scene, steps, rng)


def legal_order(scene: Scene, steps: Sequence[str], rng: np.random.Generator) -> list[str]:
    """Draw an order in which no step comes before one that it waits for."""
    left, order = list(steps), []
    while left:
        ready = [step for step in left if not _waits(scene, step, left)]
        order.append(ready[rng.integers(len(ready))])
        left.remove(order[-1])
    return order


def is_legal(scene: Scene, steps: Sequence[str]) -> bool:
    """Tell whether no step comes before one that it waits for; steps left out do not count."""
    return not any(_waits(scene, step, steps[place:]) for place, step in enumerate(steps))


def _waits(scene: Scene, step: str, left: Sequence[str]) -> bool:
    """Tell whether a step has to wait for one of those that are left."""
    return not set(scene.waits.get(step, ())).isdisjoint(left)


def _correct(scene: Scene, steps: Sequence[str], rng: np.random.Generator) -> Plan:
    del rng
    usual = steps == [step for step in scene.steps if step in steps]
    return Plan(tuple(Act(step, True) for step in steps), None, "usual" if usual else "free")


def _missing(scene: Scene, steps: list[str], rng: np.random.Generator) -> Plan:
    needed = [place for place, step in enumerate(steps) if step not in scene.optional]
    place = needed[rng.integers(len(needed))]
    acts = [Act(step, True) for step in steps]
    del acts[place]
    return Plan(tuple(acts), place, "missing")


def _out_of_order(scene: Scene, steps: list[str], rng: np.random.Generator) -> Plan:
    """Move one step past two or more others, so that a step comes before one it waits for.

    Optional steps are left out. Where no step waits for another, order is a habit, and any such
    move breaks it.
    """
    needed = [step for step in steps if step not in scene.optional]
    places = range(len(needed))
    moves = [
        (_moved(needed, start, stop), stop)
        for start in places
        for stop in places
        if abs(stop - start) >= 2
    ]
    wrong = [(order, stop) for order, stop in moves if not is_legal(scene, order)] or moves
    order, stop = wrong[rng.integers(len(wrong))]
    return Plan(tuple(Act(step, True) for step in order), stop, "out_of_order")


def _moved(steps: Sequence[str], start: int, stop: int) -> list[str]:
    """Return the steps with the one at place `start` moved to place `stop`."""
    order = list(steps)
    order.insert(stop, order.pop(start))
    return order


def _extra(scene: Scene, steps: list[str], rng: np.random.Generator) -> Plan:
    acts = [Act(step, True) for step in steps]
    place = int(rng.integers(1, len(acts) + 1))
    acts.insert(place, Act(scene.spares[rng.integers(len(scene.spares))], True))
    return Plan(tuple(acts), place, "extra")


def _ineffective(scene: Scene, steps: list[str], rng: np.random.Generator) -> Plan:
    needed = [place for place, step in enumerate(steps) if step not in scene.optional]
    place = int(needed[rng.integers(len(needed))])
    acts = tuple(Act(step, number != place) for number, step in enumerate(steps))
    return Plan(acts, place, "ineffective")


PLANNERS = {
    "usual": _correct,
    "free": _correct,
    "missing": _missing,
    "out_of_order": _out_of_order,
    "extra": _extra,
    "ineffective": _ineffective,
}
"""How a plan of each kind is drawn from steps in a correct order."""
