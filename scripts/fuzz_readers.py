"""Damage small data sets at random and read them: python -m scripts.fuzz_readers [CASES].

A reader may raise TeasimError and nothing else, and must not take long. The suite tries 200 cases;
this script tries 2,000 or as many as it is told.
"""

import sys
import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.pool.fuzzing import Damage, attempt, damages, make_sets


def main(cases: int) -> None:
    """Try `cases` damages and stop at the first that a reader does not withstand."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        valid = make_sets(folder / "valid")

        @settings(max_examples=cases, deadline=None, database=None)
        @given(number=st.integers(0, len(valid) - 1), damage=damages())
        def withstands(number: int, damage: Damage) -> None:
            attempt(valid[number], damage, folder)

        withstands()
    print(f"{cases} damaged data sets: each was read or refused in a sentence.")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
