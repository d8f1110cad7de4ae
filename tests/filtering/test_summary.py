"""A verdict can be acted on: reasons, what was odd of kept ones, doubt, variety and risks."""

import html
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from filtering.cli import main
from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.judging.explain import ODD
from filtering.judging.rules.risk import learned_risks, risks_of, words_about_risks
from filtering.judging.rules.rules import CRITICAL_RISK
from teasim.pool.mstcn.folder import write_predictions
from teasim.pool.sequences import SequencePool
from teasim.pool.weight_table import read_weight_table
from tests.toy_pool import SEQ_1

USUAL, SWAPPED = (0, 1, 2, 3, 4, 5, 6), (0, 2, 1, 3, 4, 5, 6)
NO_WATER, NO_MILK = (0, 1, 2, 3, 4, 6), (0, 1, 2, 4, 5, 6)
TWICE = (0, 1, 2, 3, 4, 5, 3, 6)
DECISIONS = pytest.mark.parametrize("decision", ["clusters", "learned"])
POOLS = [
    [USUAL] * 9 + [NO_WATER] * 2,
    [USUAL] * 5 + [SWAPPED] * 4 + [NO_WATER, TWICE],
    [USUAL] * 4 + [NO_WATER] * 8,
    [USUAL, SWAPPED, NO_MILK, TWICE, (0, 3, 1, 2, 4, 5, 6), (0, 1, 4, 3, 2, 5, 6)],
]


def fitted(folder: Path, orders: Sequence[Sequence[int]], **settings) -> DemoFilter:
    videos = {f"v{k:02d}": np.repeat(order, 4) for k, order in enumerate(orders)}
    write_predictions(folder, SEQ_1, videos, {}, {})
    config = FilterConfig(segmenter="predictions", **settings)
    return DemoFilter(config).fit(SequencePool.open(folder))


@DECISIONS
@pytest.mark.parametrize("orders", POOLS)
def test_flagged_ones_have_a_reason_and_odd_ones_are_explained(orders, decision, tmp_path) -> None:
    found = fitted(tmp_path / "p", orders, decision=decision)
    for reason, flagged, weight in zip(found.reasons_, found.flagged_, found.weights_, strict=True):
        odd = weight < ODD and not flagged
        assert bool(reason) == (flagged or odd)
        assert reason.startswith("Kept, though odd: ") == odd
        assert reason.endswith(".") == bool(reason)


def test_a_repeated_step_is_the_reason_of_the_learned_decision(tmp_path: Path) -> None:
    found = fitted(tmp_path / "p", [USUAL] * 9 + [TWICE], decision="learned")
    assert found.flagged_.tolist() == [False] * 9 + [True]
    assert found.reasons_[9] == (
        "'add_milk' was carried out (frames 24-28), which few others do so often."
    )
    assert found.group_names_[found.groups_[9]] == "extra steps"


@DECISIONS
def test_a_majority_that_omits_a_step_is_never_kept_in_silence(decision, tmp_path) -> None:
    found = fitted(tmp_path / "p", [USUAL] * 4 + [NO_WATER] * 8, decision=decision)
    assert any("the majority may be wrong" in words for words in found.words_)
    rules = {"critical": ("add_water",), "decision": decision}
    told = fitted(tmp_path / "q", [USUAL] * 4 + [NO_WATER] * 8, **rules)
    assert told.flagged_.tolist() == [False] * 4 + [True] * 8
    no_majority = (
        "No majority: 8 of 12 demonstrations are flagged. What is usual in this pool may itself "
        "be wrong."
    )
    assert no_majority in told.words_


def test_a_step_that_half_leave_out_is_said_once(tmp_path: Path) -> None:
    found = fitted(tmp_path / "p", [USUAL] * 6 + [NO_WATER] * 6, decision="learned")
    assert sum("leave" in words and "No majority" in words for words in found.words_) == 1


def test_terminal_record_and_page_say_the_same(tmp_path: Path, capsys) -> None:
    videos = {f"v{k}": np.repeat(o, 4) for k, o in enumerate([USUAL] * 6 + [SWAPPED] * 3)}
    write_predictions(tmp_path / "p", SEQ_1, videos, {}, {})
    assert main([str(tmp_path / "p"), "-o", str(tmp_path / "out"), "--critical", "stir"]) == 0
    printed = capsys.readouterr().out
    record = json.loads((tmp_path / "out" / "filter.json").read_text())
    page = html.unescape((tmp_path / "out" / "report.html").read_text())
    assert len(record["words"]) == 3
    for words in record["words"]:
        assert words in printed.splitlines()
        assert words in page
    assert record["words"][0] == "Contaminated: some demonstrations are probably incorrect."
    assert record["words"][1].startswith("No majority: 3 of 9 (flagged) do add_sugar before")
    assert [len(one["demonstrations"]) for one in record["sequences"]] == [6, 3]
    assert record["risk_of_leaving_out"]["stir"] == CRITICAL_RISK
    assert "0.95 stir (as told)" in record["words"][2]


def test_every_decision_writes_p_group_and_reason(tmp_path: Path) -> None:
    videos = {f"v{k:02d}": np.repeat(o, 4) for k, o in enumerate([USUAL] * 9 + [NO_WATER] * 2)}
    write_predictions(tmp_path / "p", SEQ_1, videos, {}, {})
    for name, options in {
        "auto": [],
        "clusters": ["--decision", "clusters"],
        "learned": ["--decision", "learned"],
        "number": ["--threshold", "0.4"],
        "gmm": ["--threshold", "gmm", "--groups", "2"],
        "equation3": ["--score", "equation3"],
    }.items():
        out = tmp_path / name
        assert main([str(tmp_path / "p"), "-o", str(out), *options]) == 0
        rows = read_weight_table(out / "weights.csv")
        assert [row.flagged for row in rows] == [False] * 9 + [True] * 2
        assert all(row.p_incorrect is not None for row in rows)
        assert min(row.p_incorrect for row in rows[9:]) > max(row.p_incorrect for row in rows[:9])
        assert all(row.group > 0 and row.reason for row in rows[9:])


def test_a_cost_that_is_not_used_is_named(tmp_path: Path) -> None:
    for decision, named in (("learned", False), ("clusters", True)):
        found = fitted(tmp_path / decision, [USUAL] * 6, decision=decision, cost=5.0)
        assert any("cost of a miss was not used" in words for words in found.words_) == named


def test_risk_grows_with_those_who_never_leave_it_out() -> None:
    occurs = np.array([[1.0, 1.0, 1.0, 0.0]] * 6 + [[1.0, 1.0, 0.0, 0.0]] * 2 + [[1, 0, 0, 1]] * 2)
    risks = learned_risks(occurs, np.ones(10))
    assert risks[0] > risks[1] > risks[2] > risks[3] == 0.0
    assert risks[0] == pytest.approx(np.tanh(np.log(10.5 / 0.5) / 2))
    distrusted = learned_risks(occurs, np.array([1.0] * 8 + [0.0] * 2))
    assert distrusted[1] == distrusted[0]


def test_the_word_of_the_user_replaces_the_learned_risk() -> None:
    names = ("a", "b", "c")
    found = risks_of(names, np.array([0.2, 0.99, 0.9]), critical=[0, 1], optional=[2])
    assert found == {"a": CRITICAL_RISK, "b": 0.99, "c": 0.0}
    assert words_about_risks(found, {"a", "b", "c"}) == (
        "Risk of leaving out a step: 0.99 b (as told); 0.95 a (as told); 0.00 c (as told)."
    )


@DECISIONS
def test_leaving_out_a_riskier_step_is_more_probably_incorrect(decision, tmp_path) -> None:
    orders = [USUAL] * 9 + [NO_MILK] * 4 + [NO_WATER]
    found = fitted(tmp_path / "p", orders, decision=decision)
    assert found.summary_ is not None
    assert found.summary_.risks["add_water"] > found.summary_.risks["add_milk"]
    assert found.losses_[13] > found.losses_[9] - 1e-9
    assert found.probabilities_[13] >= found.probabilities_[9] - 1e-9
