"""What somebody knows about order, and tolerance, spare legal minorities; omissions stay."""

import json
from pathlib import Path

import numpy as np
import pytest

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.judging.norm.cut import cut_of
from filtering.judging.norm.norm_score import score_steps
from filtering.judging.norm.precedence import precedence_graph, read_precedence
from filtering.judging.norm.steps import StepList, count_steps
from teasim.common.errors import ConfigError
from teasim.pool.mstcn.folder import write_predictions
from teasim.pool.sequences import SequencePool
from tests.toy_pool import SEQ_1

USUAL, LEGAL, WRONG, SHORT = (
    (0, 1, 2, 3, 4, 5, 6),
    (0, 2, 3, 1, 4, 5, 6),
    (0, 1, 2, 3, 5, 4, 6),
    (0, 1, 2, 3, 4, 6),
)
PAIRS = (
    ("turn_on_oven", "add_tea_bag"),
    ("turn_on_oven", "turn_off_oven"),
    ("turn_off_oven", "add_water"),
    ("add_water", "stir"),
)


def losses(orders: list[tuple[int, ...]], pairs=(), tolerance: float = 0.0) -> np.ndarray:
    counts = count_steps([StepList(order, (9,) * len(order)) for order in orders], 7)
    if pairs:
        counts = counts.restricted(precedence_graph(pairs, SEQ_1))
    return score_steps(counts, tolerance=tolerance).losses


POOL = [USUAL] * 9 + [LEGAL, LEGAL, WRONG, SHORT]


def test_with_a_graph_only_its_violated_pairs_count() -> None:
    found = losses(POOL, PAIRS)
    assert found[:11] == pytest.approx(np.zeros(11), abs=1e-9)
    assert found[11:].min() > cut_of(found)
    assert losses(POOL)[9] > 1.0


def test_the_graph_says_which_way_and_nobody_is_blamed_for_keeping_to_it() -> None:
    """Most break the graph here: that is not known from the pool, but keeping it costs nothing."""
    found = losses([WRONG] * 8 + [USUAL] * 2, PAIRS)
    assert found[8:] == pytest.approx(np.zeros(2), abs=1e-9)


def test_tolerance_spares_a_legal_minority_and_0_changes_nothing() -> None:
    pool = [USUAL] * 10 + [LEGAL] * 4
    assert losses(pool, tolerance=0.0).tolist() == losses(pool).tolist()
    spared = [losses(pool, tolerance=b)[-1] for b in (0.0, 0.1, 0.2, 0.5)]
    assert (np.diff(spared) < 0).all()


def test_the_graph_is_closed_under_what_follows() -> None:
    graph = precedence_graph((("a", "b"), ("b", "c")), ("a", "b", "c", "d"))
    assert np.argwhere(graph).tolist() == [[0, 1], [0, 2], [1, 2]]


@pytest.mark.parametrize(
    "text",
    [
        "# side knowledge\nadd water before stir\n\nturn on before turn off  # of course\n",
        '[["add water", "stir"], ["turn on", "turn off"]]',
    ],
)
def test_lines_and_json_say_the_same(text: str, tmp_path: Path) -> None:
    path = tmp_path / "order"
    path.write_text(text)
    assert read_precedence(path) == (("add water", "stir"), ("turn on", "turn off"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "'{path}' is empty; it needs lines 'a before b'."),
        ("[]", "'{path}' is empty; it needs lines 'a before b'."),
        ("a before b\na then b", "Line 2 of '{path}' is 'a then b'; write 'a before b'."),
        ('[["a"]]', '\'{path}\' has the entry ["a"]; write ["a", "b"].'),
        ('[["a", 3]]', '\'{path}\' has the entry ["a", 3]; write ["a", "b"].'),
        ("[1,", "'{path}' is not valid JSON: Expecting value: line 1 column 4 (char 3)."),
    ],
)
def test_files_that_say_something_else_are_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "order"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_precedence(path)
    assert str(caught.value) == message.format(path=path)


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"cannot be read: No such file"):
        read_precedence(tmp_path / "none")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match=r"is not a text file\.$"):
        read_precedence(tmp_path / "bytes")


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        (
            (("a", "tea"),),
            "The precedence names the unknown sub-task 'tea'; the pool has a, b, c.",
        ),
        (
            (("b", "c"), ("c", "b")),
            "The precedence has a cycle: 'b' would have to come before itself.",
        ),
    ],
)
def test_impossible_graphs_are_refused(pairs, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        precedence_graph(pairs, ("a", "b", "c"))
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"tolerance": 1.0}, "tolerance is 1.0; choose a share from 0 to below 1."),
        (
            {"tolerance": 0.2, "score": "equation3"},
            "The score 'equation3' takes neither precedence nor tolerance; choose norm.",
        ),
        (
            {"threshold": "luck"},
            "Unknown threshold 'luck'; choose a number between 0 and 1, auto, kmeans, gmm, "
            "minibatch.",
        ),
    ],
)
def test_settings_out_of_range_are_refused(change: dict, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        FilterConfig(**change)
    assert str(caught.value) == message


def test_the_verb_takes_a_precedence_and_writes_it_down(tmp_path: Path) -> None:
    from filtering.cli import main

    truth = {f"v{k:02d}": np.repeat(order, 3) for k, order in enumerate(POOL)}
    write_predictions(tmp_path / "labels", SEQ_1, {}, truth, {})
    (tmp_path / "order.txt").write_text("\n".join(f"{a} before {b}" for a, b in PAIRS))
    out = tmp_path / "out"
    argv = [str(tmp_path / "labels"), "-o", str(out), "--precedence", str(tmp_path / "order.txt")]
    assert main([*argv, "--tolerance", "0.1", "--threshold", "gmm"]) == 0
    record = json.loads((out / "filter.json").read_text())
    assert record["config"]["precedence"] == [list(pair) for pair in PAIRS]
    assert record["config"]["tolerance"] == 0.1
    assert set(record["probability_incorrect"]) == set(truth)
    assert record["flagged"] == 2
    config = FilterConfig(precedence=PAIRS)
    found = DemoFilter(config).fit(SequencePool.open(tmp_path / "labels"))
    assert np.flatnonzero(found.flagged_).tolist() == [11, 12]
    assert "'turn_off_oven' was expected, 'add_water' was seen" in found.reasons_[11]
