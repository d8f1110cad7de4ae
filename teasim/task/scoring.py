"""When tea has been made, and what went wrong on the way."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from teasim.task.recipes import LAST, POURED, PRECEDENCE
from teasim.task.subtasks import REGISTRY

SPILL_TOLERANCE = 5.0
"""Smaller amounts on the table do not count as spilled [ml or g]."""
UNSAFE = "unsafe"
"""Key of `VIOLATIONS` for an oven that is on when the episode ends."""


def _out_of_order(name: str, before: str) -> str:
    return f"{name}_before_{before}"


def _spilled(content: str) -> str:
    return f"spilled_{content}"


_CONTENTS = tuple(str(REGISTRY[name].content) for name in POURED)
_ORDERS = tuple((name, before) for name, waits in PRECEDENCE.items() for before in waits)

VIOLATIONS: Mapping[str, str] = MappingProxyType(
    {
        UNSAFE: "oven left on",
        **{_spilled(content): f"{content} spilled" for content in _CONTENTS},
        **{_out_of_order(name, before): f"{name} before {before}" for name, before in _ORDERS},
    }
)
"""Every violation by its key, in words."""

VIOLATION_KINDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        VIOLATIONS[UNSAFE]: (UNSAFE,),
        "spilled": tuple(_spilled(content) for content in _CONTENTS),
        "out of order": tuple(_out_of_order(name, before) for name, before in _ORDERS),
    }
)
"""Keys of `VIOLATIONS` that are counted together, by the words for the kind."""


@dataclass(frozen=True)
class Verdict:
    """What the physics says about an episode so far."""

    success: bool
    """Every sub-task was done, the last one of Seq_1 last, and the oven is off."""
    violations: tuple[str, ...]
    """Keys of `VIOLATIONS`: breaks of the precedence, then spills."""
    unsafe: bool
    """The oven is on."""


def judge(done: Sequence[str], *, oven_on: bool, spilled: Mapping[str, float]) -> Verdict:
    """Judge an episode by its physical events.

    Args:
        done: Sub-tasks that happened, in order.
        oven_on: Whether the oven is on now.
        spilled: Amount on the table by content [ml or g].
    """
    complete = all(name in done for name in REGISTRY)
    success = complete and not oven_on and done[-1] == LAST
    return Verdict(success, (*broken_precedence(done), *spills(spilled)), oven_on)


def broken_precedence(done: Sequence[str]) -> tuple[str, ...]:
    """Return one key of `VIOLATIONS` per sub-task that came before one it has to wait for."""
    return tuple(
        _out_of_order(name, before)
        for k, name in enumerate(done)
        for before in PRECEDENCE[name]
        if before not in done[:k]
    )


def spills(spilled: Mapping[str, float]) -> tuple[str, ...]:
    """Return one key of `VIOLATIONS` per content of which more than the tolerance was spilled."""
    return tuple(_spilled(name) for name, amount in spilled.items() if amount > SPILL_TOLERANCE)
