from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.pool.fuzzing import Damage, attempt, damages, examine, make_sets

CASES = 200


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return make_sets(tmp_path_factory.mktemp("fuzz") / "valid")


def test_the_undamaged_sets_are_sound(valid: list[Path]) -> None:
    for root in valid:
        examine(root)


@settings(
    max_examples=CASES,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(number=st.integers(0, 3), damage=damages())
def test_damage_gives_a_sentence_and_nothing_else(
    valid: list[Path], tmp_path: Path, number: int, damage: Damage
) -> None:
    attempt(valid[number], damage, tmp_path)
