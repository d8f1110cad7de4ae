"""What sub-tasks do to what is observed: transitions measured in physics, to draw from.

A transition is drawn from those that were measured in the same situation: the same sub-task, which
has an effect now or not (`teasim.task.recipes.has_effect`), with or without tea bag and water in
the cup, which decide whether tea brews. `scripts/fit_events.py` measures transitions and compares
what is drawn with physics.
"""

from collections import defaultdict
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from teasim.common.errors import ConfigError
from teasim.constants import SUBTASKS
from teasim.task.recipes import has_effect
from teasim.task.subtasks import REGISTRY, Dropped
from teasim.world.liquids import VESSELS
from teasim.world.simulation import STATION_STATE_NAMES
from teasim.world.station import FREE_BODIES, Layout

SHIPPED = Path(__file__).parent / "fitted" / "transitions.npz"
"""File of the transitions that are part of the package."""
START = ""
"""Stands for the reset instead of a sub-task: everything comes to rest in its layout."""
POSE = 7
"""Numbers of a pose: x, y, z [m] and a quaternion wxyz."""

_AT = {name: place for place, name in enumerate(STATION_STATE_NAMES)}
_POSES = slice(0, POSE * len(FREE_BODIES))
_KNOB = _AT["knob_angle"]
_AMOUNTS = slice(_AT[f"{next(iter(VESSELS))}_amount"], _AT["cup_tea"])
_SHARES = slice(_AT["cup_tea"], _AT["cup_mixed"] + 1)


@dataclass(frozen=True)
class Moment:
    """The station between two sub-tasks, as far as it is observed or judged."""

    joints: np.ndarray
    """Joint angles [rad] and openings [m].  # (16,)"""
    things: np.ndarray
    """State of the objects, see `STATION_STATE_NAMES`.  # (E,)"""
    spilled: np.ndarray
    """Amount of every content on table and hob [ml or g].  # (C,)"""
    done: tuple[str, ...]
    """Sub-tasks that were completed, in order."""
    time: float
    """Time since the reset [s]."""


class Situation(NamedTuple):
    """What decides which transitions may be drawn."""

    subtask: str
    """The sub-task that is carried out, or `START`."""
    effect: bool
    """Whether it has an effect when it is carried out well."""
    bag: bool
    """Whether the tea bag is in the cup."""
    water: bool
    """Whether water is in the cup."""


def situation(subtask: str, done: tuple[str, ...]) -> Situation:
    """Return the situation in which `subtask` is carried out after the sub-tasks `done`."""
    if subtask == START:
        return Situation(START, True, False, False)
    bag, water = "add_tea_bag" in done, "add_water" in done
    return Situation(subtask, has_effect(subtask, done), bag, water)


@dataclass(frozen=True)
class Change:
    """What one measured transition changed."""

    joints: np.ndarray
    """Joint angles [rad] and openings [m] after it.  # (16,)"""
    things: np.ndarray
    """Differences of the state of the objects, with three exceptions. A thing that was dropped into
    the cup has its new pose, relative to the cup; the knob has its new angle after a sub-task that
    turns it; tea and mixture have the exponent by which what is missing shrank.  # (E,)"""
    spilled: np.ndarray
    """Amount of every content that was spilled [ml or g].  # (C,)"""
    happened: np.ndarray
    """Whether the sub-task was completed.  # ()"""
    refused: np.ndarray
    """Why it was not begun, a text; empty if it was.  # ()"""
    seconds: np.ndarray
    """How long it took [s].  # ()"""


class Transitions:
    """Measured transitions by situation."""

    def __init__(self, changes: dict[Situation, list[Change]]) -> None:
        """Take the transitions measured in every situation."""
        self.changes = changes

    def after(self, moment: Moment, subtask: str, random: np.random.Generator) -> Moment:
        """Return a moment after `subtask`, drawn from the transitions measured in its situation."""
        return apply_change(moment, subtask, self.draw(moment, subtask, random))

    def draw(self, moment: Moment, subtask: str, random: np.random.Generator) -> Change:
        """Draw a transition for `subtask` at `moment`.

        Raises:
            ConfigError: none was measured in this situation.
        """
        here = situation(subtask, moment.done)
        found = self.changes.get(here)
        if not found:
            raise ConfigError(
                f"No transition was measured for {here}; run 'python scripts/fit_events.py fit'."
            )
        return found[random.integers(len(found))]

    def save(self, file: Path) -> None:
        """Write all transitions to an npz file."""
        rows = [(here, change) for here, found in self.changes.items() for change in found]
        columns = {
            field.name: np.array([getattr(change, field.name) for _, change in rows])
            for field in fields(Change)
        }
        keys = {name: np.array([here[n] for here, _ in rows]) for n, name in enumerate(_KEYS)}
        everything: dict[str, Any] = keys | columns
        np.savez_compressed(file, **everything)


_KEYS = tuple(f"situation_{name}" for name in Situation._fields)


@cache
def load_transitions(file: Path = SHIPPED) -> Transitions:
    """Read the transitions that `Transitions.save` wrote."""
    with np.load(file, allow_pickle=False) as stored:
        columns = {name: stored[name] for name in stored.files}
    for column in columns.values():
        column.setflags(write=False)
    changes: dict[Situation, list[Change]] = defaultdict(list)
    names = [field.name for field in fields(Change)]
    for row, key in enumerate(zip(*(columns[name].tolist() for name in _KEYS), strict=True)):
        changes[Situation(*key)].append(Change(**{name: columns[name][row] for name in names}))
    return Transitions(dict(changes))


def placed(layout: Layout) -> Moment:
    """Return the moment in which everything has been put into `layout` and nothing has moved."""
    things = np.zeros(len(STATION_STATE_NAMES))
    for name in FREE_BODIES:
        at = layout[name]
        things[_pose(name)] = (at.x, at.y, at.z, *at.quaternion)
    things[_AT["knob_x"]], things[_AT["knob_y"]] = layout["knob"].x, layout["knob"].y
    for name, vessel in VESSELS.items():
        things[_AT[f"{name}_amount"]] = vessel.filling
    return Moment(np.zeros(0), things, np.zeros(len(VESSELS)), (), 0.0)


def change_between(before: Moment, after: Moment, subtask: str, refused: str = "") -> Change:
    """Return the change of a measured transition from `before` to `after`."""
    happened = len(after.done) > len(before.done)
    things = after.things - before.things
    dropped = _dropped(subtask) if happened else None
    if dropped is not None:
        things[dropped] = after.things[dropped]
        things[dropped][:3] -= after.things[_pose("cup")][:3]
    if _turns(subtask):
        things[_KNOB] = after.things[_KNOB]
    things[_SHARES] = np.log1p(-before.things[_SHARES]) - np.log1p(-after.things[_SHARES])
    return Change(
        after.joints,
        things.astype(np.float32),
        (after.spilled - before.spilled).astype(np.float32),
        np.array(happened),
        np.array(refused),
        np.array(after.time - before.time),
    )


def apply_change(before: Moment, subtask: str, change: Change) -> Moment:
    """Return the moment after `change`, the inverse of `change_between`."""
    things = before.things + change.things
    dropped = _dropped(subtask) if change.happened else None
    if dropped is not None:
        things[dropped] = change.things[dropped]
        things[dropped][:3] += things[_pose("cup")][:3]
    if _turns(subtask):
        things[_KNOB] = change.things[_KNOB]
    poses = things[_POSES].reshape(-1, POSE)
    poses[:, 3:] /= np.sqrt(np.einsum("ij,ij->i", poses[:, 3:], poses[:, 3:]))[:, None]
    things[_AMOUNTS] = np.maximum(things[_AMOUNTS], 0.0)
    things[_SHARES] = 1 - (1 - before.things[_SHARES]) * np.exp(-change.things[_SHARES])
    done = (*before.done, subtask) if change.happened and subtask != START else before.done
    return replace(
        before,
        joints=change.joints,
        things=things,
        spilled=before.spilled + change.spilled,
        done=done,
        time=before.time + float(change.seconds),
    )


def situations() -> set[Situation]:
    """Return every situation that can be reached when all sub-tasks are carried out well."""
    found = {situation(START, ())}
    reached: set[tuple[str, ...]] = set()
    waiting: list[tuple[str, ...]] = [()]
    while waiting:
        done = waiting.pop()
        for subtask in SUBTASKS:
            here = situation(subtask, done)
            found.add(here)
            # A sub-task without effect changes nothing, and the oven can only be on or off.
            after = _essence((*done, subtask)) if here.effect else done
            if after not in reached:
                reached.add(after)
                waiting.append(after)
    return found


def _essence(done: tuple[str, ...]) -> tuple[str, ...]:
    """Return the shortest sequence with the same further situations."""
    turns = [name for name in done if _turns(name)]
    return (*turns[-1:], *sorted({name for name in done if not _turns(name)}))


def _turns(subtask: str) -> bool:
    return subtask != START and REGISTRY[subtask].oven is not None


def _dropped(subtask: str) -> slice | None:
    event = None if subtask == START else REGISTRY[subtask].event
    return _pose(event.thing) if isinstance(event, Dropped) else None


def _pose(name: str) -> slice:
    first = _AT[f"{name}_x"]
    return slice(first, first + POSE)
