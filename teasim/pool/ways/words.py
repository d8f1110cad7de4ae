"""What the ways of a pool may mean, in sentences; `teasim inspect` and the filter say the same.

A pool does not say which of two ways is right, or whether a step that many leave out is optional or
forgotten. The sentences say what is seen, and how to tell the filter what it is.
"""

from collections.abc import Collection, Sequence

from teasim.pool.ways.ways import Way, Ways, inversions

HALF = 0.4
"""Share from which a part counts as about half of a pool."""
THIRD = 1 / 3
"""Share from which the second of two orders leaves no clear majority to the first."""
CLEAR = 0.8
"""Share of a pool that two orders hold together if it has two ways rather than many."""


def words_about(
    ways: Ways, flagged: Collection[int] | None = None, settled: Collection[str] = ()
) -> tuple[str, ...]:
    """Return one or more sentences about a pool of two or more demonstrations.

    Args:
        ways: the sequences of the pool.
        flagged: numbers of the demonstrations that a filter flags; None before one has run.
        settled: steps of which the user has said whether they are optional or critical.
    """
    return (_order(ways, flagged), *_left_out(ways, flagged, {*settled, *ways.optional}))


def _order(ways: Ways, flagged: Collection[int] | None) -> str:
    total, (first, *others) = len(ways.demos), ways.orders
    if len(ways.all) == 1:
        return f"One way: all {total} demonstrations do the same steps in the same order."
    if not others:
        return f"One order: all {total} demonstrations keep it, with {len(ways.all)} sequences."
    most, rest = len(first.rows), total - len(first.rows)
    second = others[0]
    if len(second.rows) >= THIRD * total and most + len(second.rows) >= CLEAR * total:
        return _two(first, second, total, flagged)
    if 2 * most <= total:
        return (
            f"Several ways: of {total} demonstrations no more than {most} keep the same order, of "
            f"{len(ways.orders)} orders. This is honest variety unless a rule forbids it: "
            '--precedence "a before b".'
        )
    if len(others) == 1 and rest > 1:
        return (
            f"One other order: {_some(second.rows, total, flagged)} do {_pairs(first, second)}, "
            f"unlike the other {most}. Only you know whether that is legal or a mistake: "
            f"{_options(first, second)}."
        )
    if rest == 1:
        return f"One order: {most} of {total} demonstrations keep it, one does not."
    return (
        f"One order: {most} of {total} demonstrations keep it, the other {rest} differ from it in "
        f"{len(others)} ways."
    )


def _two(first: Way, second: Way, total: int, flagged: Collection[int] | None) -> str:
    """Return the sentence about two large parts."""
    return (
        f"No majority: {_some(second.rows, total, flagged)} do {_pairs(first, second)}, unlike the "
        f"other {len(first.rows)}. If only one of two orders is right, the majority may be wrong; "
        f"say which: {_options(first, second)}."
    )


def _left_out(
    ways: Ways, flagged: Collection[int] | None, settled: Collection[str]
) -> tuple[str, ...]:
    """Return a sentence about steps that many, and one about steps that some leave out."""
    total = len(ways.demos)
    open_steps = {name: rows for name, rows in ways.left_out.items() if name not in settled}
    many = {name: rows for name, rows in open_steps.items() if len(rows) >= HALF * total}
    some = {name: rows for name, rows in open_steps.items() if name not in many}
    sentences = []
    if many:
        sentences.append(
            f"No majority: {_each(many, total, flagged)}. Unless that is optional, the majority "
            f"may be wrong: {_told(many)}."
        )
    if some:
        sentences.append(
            f"Perhaps optional: {_each(some, total, flagged)}. Only you know whether that is legal "
            f"or a mistake: {_told(some)}."
        )
    return tuple(sentences)


def _each(steps: dict[str, tuple[int, ...]], total: int, flagged: Collection[int] | None) -> str:
    return ", ".join(
        f"{_some(rows, total, flagged)} leave out {name}" for name, rows in steps.items()
    )


def _told(steps: Collection[str]) -> str:
    names = " ".join(f'"{name}"' if " " in name else name for name in steps)
    return f"--optional {names} or --critical {names}"


def _some(rows: Sequence[int], total: int, flagged: Collection[int] | None) -> str:
    """Return how many they are and, if it is known, how many of them are flagged."""
    count = f"{len(rows)} of {total}"
    if flagged is None:
        return count
    accused = len(set(rows) & set(flagged))
    if accused == len(rows):
        return f"{count} (flagged)"
    return f"{count} (kept)" if not accused else f"{count} ({accused} flagged)"


def _pairs(first: Way, second: Way) -> str:
    return " and ".join(f"{a} before {b}" for a, b in inversions(first.steps, second.steps))


def _options(first: Way, second: Way) -> str:
    pairs = inversions(first.steps, second.steps)
    legal = " ".join(f'"{a} before {b}"' for a, b in pairs)
    wrong = " ".join(f'"{b} before {a}"' for a, b in pairs)
    return f"--keep {legal} or --precedence {wrong}"
