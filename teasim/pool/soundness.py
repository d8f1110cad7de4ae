"""The one law of damage: what `teasim inspect` calls damaged, no verb works on."""

import shlex
import sys

from teasim.common.errors import PoolError
from teasim.pool.source import Source


def require_sound(source: Source) -> None:
    """Refuse a damaged source before any work on it; no picture is decoded.

    Raises:
        PoolError: a file is missing or damaged, or metadata, logs and videos contradict each
            other; the sentence tells the first problem and how to list the others.
    """
    problems = source.problems()
    if not problems:
        return
    first, n_others = problems[0].removesuffix("."), len(problems) - 1
    others = f", and {n_others} more {'problem' if n_others == 1 else 'problems'}"
    raise PoolError(
        f"{first}{others if n_others else ''}; for the whole check run: "
        f"teasim inspect {shlex.quote(str(source.root))}"
    )


def print_notes(source: Source) -> None:
    """Print what is unusual about a source as warnings on stderr."""
    for note in source.notes:
        print(f"teasim: warning: {note}", file=sys.stderr)
