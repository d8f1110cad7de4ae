"""Who a demonstration is: a hash of what it holds, whatever its number or file name.

An identity has two halves, what was commanded and what was seen, so that it is still known after
other tools have worked on the data set: a table of weights fits a demonstration by either half
(`teasim.pool.weight_table`). A half survives copying, renumbering, merging (which rewrites packets
but not pictures), re-labelling, and the loss of every feature that it is not made of.
"""

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from teasim.pool.lerobot import layout

ID_PREFIX = "v2-"
"""Tells how an identity was made; one without it hashed packets and cannot be made again."""
HALF = 8
"""Hexadecimal digits of each half: two of a thousand demonstrations agree in one by chance with a
probability of 1e-4, and in both never."""

COMMANDS = (layout.ACTION, layout.STATE)
"""The first of these that is logged makes the first half."""


def demo_id(pictures: Mapping[str, str], logs: Mapping[str, np.ndarray]) -> str:
    """Return the content-derived identity of a demonstration.

    Args:
        pictures: Hash of the pictures per camera key; the first in the alphabet is used.
        logs: Columns of numbers (n,) or (n, D); one is used, see `COMMANDS`.
    """
    seen = pictures[min(pictures)] if pictures else ""
    name = identifying_log(logs)
    commanded = _hash_of(logs[name]) if name is not None else ""
    first, second = commanded or seen, seen or commanded
    return ID_PREFIX + _half("commanded", first) + _half("seen", second)


def identifying_log(names: Mapping[str, object]) -> str | None:
    """Return which of the logged columns of numbers is part of the identity; None without any."""
    others = sorted(name for name in names if name.startswith(("action", "observation.")))
    return next((name for name in (*COMMANDS, *others) if name in names), None)


def halves(identity: str) -> tuple[str, ...]:
    """Return the two halves of an identity; none of one that was made otherwise."""
    if not identity.startswith(ID_PREFIX) or len(identity) != len(ID_PREFIX) + 2 * HALF:
        return ()
    middle = len(ID_PREFIX) + HALF
    return identity[:middle], identity[middle:]


def matched(known: Sequence[str], asked: Sequence[str]) -> list[str | None]:
    """Return which of the `known` identities each of the `asked` ones is; None where none is.

    A whole identity fits first. Where other tools have removed features or encoded the videos
    anew, one half is enough, if it tells the demonstration from all others on both sides.
    """
    whole = set(known)
    told = Counter(half for identity in known for half in halves(identity))
    wanted = Counter(half for identity in asked for half in halves(identity))
    by_half = {half: identity for identity in known for half in halves(identity)}
    by_half = {half: identity for half, identity in by_half.items() if told[half] == 1}

    def found(identity: str) -> str | None:
        if identity in whole:
            return identity
        fits = [by_half[h] for h in halves(identity) if h in by_half and wanted[h] == 1]
        return fits[0] if fits else None

    return [found(identity) for identity in asked]


def _hash_of(values: np.ndarray) -> str:
    numbers = np.ascontiguousarray(values, dtype="<f4")
    numbers = np.where(np.isnan(numbers), np.float32(np.nan), numbers)
    content = hashlib.sha256(f"log {numbers.shape}\n".encode())
    content.update(numbers.astype("<f4").tobytes())
    return content.hexdigest()


def _half(what: str, content: str) -> str:
    return hashlib.sha256(f"{what} {content}".encode()).hexdigest()[:HALF]
