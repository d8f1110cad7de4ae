"""Clues that give mistakes away: nothing for a fair pool, everything for an unfair one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.cli.inspect import main
from teasim.common.errors import PoolError
from teasim.pool.leakage import CLUES, auroc, leakage
from tests.toy_pool import SEQ_1, SEQ_2, copy_pool, make_toy_pool, strip_ground_truth

SHORT = SEQ_1[:3]


@given(
    values=st.lists(st.integers(-5, 5), min_size=2, max_size=30),
    seed=st.integers(0, 999),
)
def test_an_auroc_is_the_share_of_pairs(values, seed):
    marks = np.random.default_rng(seed).random(len(values)) < 0.5
    if marks.all() or not marks.any():
        with pytest.raises(ValueError, match="needs positives and negatives"):
            auroc(values, marks)
        return
    good = [v for v, mark in zip(values, marks, strict=True) if not mark]
    bad = [v for v, mark in zip(values, marks, strict=True) if mark]
    pairs = [(b > g) + 0.5 * (b == g) for b in bad for g in good]
    assert auroc(values, marks) == pytest.approx(np.mean(pairs))
    assert auroc(values, ~marks) == pytest.approx(1 - np.mean(pairs))


def test_what_is_always_shorter_gives_itself_away(tmp_path):
    pool = make_toy_pool(tmp_path / "pool", [SEQ_1, SHORT, SEQ_1, SHORT], frames_per_subtask=4)
    found = leakage(pool)
    assert list(found) == list(CLUES)
    assert found["length"] == found["number of segments"] == found["file size"] == 0.0


def test_equal_length_gives_nothing_away(tmp_path, capsys):
    pool = make_toy_pool(tmp_path / "pool", [SEQ_1, SEQ_2, SEQ_1], frames_per_subtask=4)
    found = leakage(pool)
    assert found["length"] == found["number of segments"] == 0.5
    assert all(0 <= value <= 1 for value in found.values())
    assert main([str(pool.root), "--leakage"]) == 0
    said = capsys.readouterr().out
    assert "Leakage (AUROC of one clue alone" in said
    assert "  length              0.50\n" in said


def test_without_labels_or_with_one_kind_there_is_nothing_to_compare(tmp_path):
    pool = make_toy_pool(tmp_path / "pool", [SEQ_1, SEQ_1], frames_per_subtask=4)
    with pytest.raises(PoolError, match="are correct; leakage needs both kinds"):
        leakage(pool)
    stripped = strip_ground_truth(copy_pool(pool, tmp_path / "copy"))
    with pytest.raises(PoolError, match="does not label its demonstrations as correct"):
        leakage(stripped)
