"""The orders in which tea is made: the paper's three sequences and the precedence behind them."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from teasim.common.errors import ConfigError
from teasim.constants import SUBTASKS

SEQ_1 = (
    "turn_on_oven",
    "add_tea_bag",
    "add_sugar",
    "add_milk",
    "turn_off_oven",
    "add_water",
    "stir",
)
"""The optimal order (the paper, section 4)."""

SEQ_2 = (
    "turn_on_oven",
    "add_sugar",
    "add_milk",
    "add_tea_bag",
    "turn_off_oven",
    "add_water",
    "stir",
)
"""The sub-optimal order: the tea bag goes in late."""

CRITICAL = ("add_tea_bag", "add_water", "turn_off_oven")
"""Seq_3 leaves out one or two of these."""

POURED = ("add_water", "add_sugar", "add_milk")
"""Sub-tasks that empty a vessel into the cup."""

PRECEDENCE = MappingProxyType(
    {
        "turn_on_oven": (),
        "add_tea_bag": ("turn_on_oven",),
        "add_sugar": ("turn_on_oven",),
        "add_milk": ("turn_on_oven",),
        "turn_off_oven": ("turn_on_oven",),
        "add_water": ("turn_off_oven",),
        "stir": ("add_tea_bag", "add_sugar", "add_milk", "add_water"),
    }
)
"""What must have happened before each sub-task in a correct demonstration."""

OPTIMAL, SUBOPTIMAL, INCORRECT, LEGAL = "seq_1", "seq_2", "seq_3", "legal"
SEQUENCES = (OPTIMAL, SUBOPTIMAL, INCORRECT, LEGAL)
"""What a demonstration is labelled as; `legal` is a random order that respects the precedence."""


def check_subtask(name: str) -> str:
    """Return `name` if it is one of the seven sub-tasks.

    Raises:
        ConfigError: it is not.
    """
    if name not in SUBTASKS:
        raise ConfigError(f"Unknown sub-task '{name}'; choose {', '.join(SUBTASKS)}.")
    return name


def is_legal(order: Sequence[str]) -> bool:
    """Whether `order` holds every sub-task once and respects the precedence."""
    if sorted(order) != sorted(SUBTASKS):
        return False
    return all(before in order[:k] for k, name in enumerate(order) for before in PRECEDENCE[name])


def recognisable(steps: Sequence[str]) -> tuple[str, ...]:
    """What physics will recognise of `steps` when every one is carried out well.

    Turning the knob to where it is, pouring from an empty vessel and stirring an empty cup are
    motion without an event.
    """
    happened: list[str] = []
    for name in steps:
        if not _without_effect(name, happened):
            happened.append(name)
    return tuple(happened)


def _without_effect(name: str, happened: Sequence[str]) -> bool:
    on = happened.count("turn_on_oven") > happened.count("turn_off_oven")
    wet = "add_water" in happened or "add_milk" in happened
    return (
        (name == "turn_on_oven" and on)
        or (name == "turn_off_oven" and not on)
        or (name in POURED and name in happened)
        or (name == "stir" and not wet)
    )


def random_order(rng: np.random.Generator) -> tuple[str, ...]:
    """Draw one of the legal orders, every one equally likely."""
    while True:
        order = tuple(SUBTASKS[k] for k in rng.permutation(len(SUBTASKS)))
        if is_legal(order):
            return order


def next_correct(done: Sequence[str]) -> str | None:
    """The reference's next sub-task: the first of Seq_1 not done yet; None when all are done.

    Stirring that came too early has to be done again.
    """
    missing = [name for name in SEQ_1 if name not in done]
    if missing:
        return missing[0]
    return None if done[-1] == "stir" else "stir"


def allowed_next(done: Sequence[str]) -> tuple[str, ...]:
    """Every sub-task that the precedence allows next and that is still needed."""
    open_steps = [name for name in SUBTASKS if name not in done]
    if not open_steps:
        return () if done[-1] == "stir" else ("stir",)
    allowed = [name for name in open_steps if all(p in done for p in PRECEDENCE[name])]
    if not allowed and "stir" in done:  # stirred too early, and the rest waits for nothing
        return ("stir",)
    return tuple(allowed)
