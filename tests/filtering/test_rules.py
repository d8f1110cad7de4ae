"""What a user knows about a task is a rule: who breaks it is flagged, who keeps to it is not."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.judging.evidence import Evidence
from filtering.judging.explain import explain
from filtering.judging.judgement import Judgement
from filtering.judging.judges import by_norm
from filtering.judging.norm.norm_score import score_steps
from filtering.judging.norm.steps import StepList, count_steps
from filtering.judging.rules.order import pairs_of, precedence_graph, read_precedence
from filtering.judging.rules.rules import BROKEN_NATS, CRITICAL_RISK
from teasim.common.errors import ConfigError
from teasim.pool import Span
from teasim.pool.mstcn.folder import write_predictions
from teasim.pool.sequences import SequencePool
from tests.toy_pool import SEQ_1

USUAL, LEGAL, WRONG, SHORT = (
    (0, 1, 2, 3, 4, 5, 6),
    (0, 2, 3, 1, 4, 5, 6),
    (0, 1, 2, 3, 5, 4, 6),
    (0, 1, 2, 3, 4, 6),
)
NO_MILK = tuple(step for step in USUAL if SEQ_1[step] != "add_milk")
PAIRS = (
    ("turn_on_oven", "add_tea_bag"),
    ("turn_on_oven", "turn_off_oven"),
    ("turn_off_oven", "add_water"),
    ("add_water", "stir"),
)
DECISIONS = pytest.mark.parametrize("decision", ["clusters", "learned"])
POOL = [USUAL] * 9 + [LEGAL, LEGAL, WRONG, SHORT]


def judged(orders: Sequence[Sequence[int]], **settings) -> Judgement:
    spans = tuple(
        tuple(Span(SEQ_1[a], 10 * n, 10 * n + 10) for n, a in enumerate(order)) for order in orders
    )
    return by_norm(Evidence(SEQ_1, spans), FilterConfig(**settings))


def flagged(found: Judgement) -> list[int]:
    return np.flatnonzero(found.grouping.flagged).tolist()


def reason(found: Judgement, demo: int) -> str:
    return explain(found.findings[demo], 10)


def losses(orders: list[tuple[int, ...]], tolerance: float = 0.0) -> np.ndarray:
    counts = count_steps([StepList(order, (9,) * len(order)) for order in orders], 7)
    return score_steps(counts, tolerance=tolerance).losses


@DECISIONS
def test_with_rules_of_order_only_those_who_break_them_are_out_of_order(decision: str) -> None:
    found = judged(POOL, precedence=PAIRS, decision=decision)
    assert flagged(found) == [11, 12]
    assert found.losses[:11] == pytest.approx(np.zeros(11), abs=1e-9)
    assert found.losses[11] >= BROKEN_NATS
    assert found.weights[11] == 0.0
    assert found.probabilities[11] == 1.0
    assert reason(found, 11) == (
        "This demonstration breaks the rule: turn_off_oven before add_water; 'add_water' was seen "
        "at 4.0 s; 'turn_off_oven' came later (5.0-6.0 s)."
    )
    group = found.grouping.names[found.grouping.groups[11]]
    assert (group, found.grouping.names[0]) == ("breaks a rule", "kept")


@DECISIONS
@pytest.mark.parametrize("count", [3, 12])
def test_a_rule_that_all_break_flags_all(decision: str, count: int) -> None:
    found = judged([WRONG] * count, precedence=PAIRS, decision=decision)
    assert flagged(found) == list(range(count))
    assert flagged(judged([SHORT] * count, critical=("add_water",), decision=decision)) == list(
        range(count)
    )


@DECISIONS
def test_a_few_who_keep_to_the_rule_are_not_blamed_for_differing_from_the_rest(decision) -> None:
    found = judged([WRONG] * 8 + [USUAL] * 2, precedence=PAIRS, decision=decision)
    assert flagged(found) == list(range(8))
    assert found.losses[8:] == pytest.approx(np.zeros(2), abs=1e-9)


def test_a_rule_follows_from_others_and_says_nothing_where_a_step_is_missing() -> None:
    late = (0, 1, 2, 3, 6, 4)
    rules = (("turn_off_oven", "add_water"), ("add_water", "stir"))
    found = judged([USUAL] * 6 + [late, SHORT], precedence=rules)
    assert "breaks the rule: turn_off_oven before stir;" in reason(found, 6)
    assert "rule" not in reason(found, 7)


@DECISIONS
def test_an_optional_step_accuses_nobody_who_leaves_it_out(decision: str) -> None:
    pool = [USUAL] * 9 + [NO_MILK] * 3 + [SHORT]
    strict = judged(pool, decision="clusters")
    assert flagged(strict) == [9, 10, 11, 12]
    free = judged(pool, optional=("add_milk",), decision=decision)
    assert flagged(free) == [12]
    assert free.losses[:12] == pytest.approx(np.zeros(12), abs=1e-9)
    assert reason(free, 12) == reason(strict, 12)


def test_an_optional_step_at_the_wrong_place_is_still_out_of_order() -> None:
    late = (*NO_MILK, SEQ_1.index("add_milk"))
    assert flagged(judged([USUAL] * 9 + [NO_MILK, late], optional=("add_milk",))) == [10]


def test_no_reason_speaks_of_a_step_that_is_only_supposed() -> None:
    both = tuple(step for step in NO_MILK if SEQ_1[step] != "add_water")
    found = judged([USUAL] * 9 + [both], optional=("add milk", "turn off oven"))
    assert flagged(found) == [9]
    assert "add_milk" not in reason(found, 9)


@DECISIONS
def test_an_order_that_is_to_be_kept_accuses_nobody(decision: str) -> None:
    pool = [USUAL] * 8 + [LEGAL] * 3 + [WRONG]
    assert flagged(judged(pool, decision="clusters")) == [8, 9, 10, 11]
    rules = (("add_sugar", "add_tea_bag"), ("add_milk", "add_tea_bag"))
    found = judged(pool, keep=rules, decision=decision)
    assert flagged(found) == [11]
    assert found.losses[:11] == pytest.approx(np.zeros(11), abs=1e-9)


def test_those_who_break_a_rule_do_not_say_what_is_usual() -> None:
    pool = [SHORT] * 8 + [USUAL] * 4
    assert flagged(judged(pool, decision="learned")) != list(range(8))
    found = judged(pool, decision="learned", critical=("add_water",))
    assert flagged(found) == list(range(8))
    alone = judged([USUAL] * 4, decision="learned")
    assert found.probabilities[8:] == pytest.approx(alone.probabilities)
    assert found.decision.facts == pytest.approx(alone.decision.facts)
    few = judged([SHORT] * 8 + [USUAL] * 2, decision="learned", critical=("add_water",))
    assert flagged(few)[:8] == list(range(8))


@DECISIONS
def test_a_critical_step_raises_the_probability_of_those_who_leave_it_out(decision: str) -> None:
    pool = [USUAL] * 5 + [SHORT] * 4
    before = judged(pool, decision=decision)
    after = judged(pool, decision=decision, critical=("add_water",))
    p = before.probabilities if decision == "learned" else np.zeros(9)
    assert (after.probabilities[5:] >= 1 - (1 - p[5:]) * (1 - CRITICAL_RISK) - 1e-12).all()
    assert (after.weights[5:] <= before.weights[5:] * (1 - CRITICAL_RISK) + 1e-12).all()
    assert (after.weights[:5] >= before.weights[:5]).all()
    assert flagged(after) == [5, 6, 7, 8]
    assert reason(after, 5) == (
        "'add_water' is critical, and it is missing from the whole video (expected at 5.0 s)."
    )


def test_a_critical_step_that_nobody_does_has_no_usual_place() -> None:
    assert reason(judged([SHORT] * 4, critical=("add_water",)), 0) == (
        "'add_water' is critical, and it is missing from the whole video."
    )


@pytest.mark.parametrize("settings", [{}, {"threshold": 0.3}, {"groups": "1"}, {"groups": "2"}])
def test_rules_hold_with_every_way_to_group(settings: dict) -> None:
    found = judged(POOL, precedence=PAIRS, **settings)
    assert 11 in flagged(found)
    assert (found.weights[found.grouping.flagged] <= found.grouping.threshold).all()
    assert (found.weights[~found.grouping.flagged] >= found.grouping.threshold).all()


def test_rules_that_nobody_breaks_change_nothing() -> None:
    pool = [USUAL] * 9 + [SHORT]
    plain, told = judged(pool), judged(pool, critical=("stir",), keep=(("stir", "add_water"),))
    assert told.weights.tolist() == plain.weights.tolist()
    assert told.findings == plain.findings


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


def test_words_and_files_can_be_mixed(tmp_path: Path) -> None:
    path = tmp_path / "order"
    path.write_text("c before d")
    assert pairs_of(["step 1 before step 2", str(path)]) == (("step 1", "step 2"), ("c", "d"))
    with pytest.raises(ConfigError) as caught:
        pairs_of(["stir"])
    assert str(caught.value) == (
        "'stir' is neither a file nor a pair of sub-tasks; write 'a before b'."
    )


@pytest.mark.parametrize("setting", ["precedence", "keep", "optional", "critical"])
def test_a_sub_task_that_is_not_there_is_refused_with_the_choices(setting: str) -> None:
    told = (("stir", "tea"),) if setting in ("precedence", "keep") else ("tea",)
    with pytest.raises(ConfigError) as caught:
        judged([USUAL] * 3, **{setting: told})
    assert str(caught.value) == (
        f"The setting {setting} names the unknown sub-task 'tea'; the pool has {', '.join(SEQ_1)}."
    )


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
            "The setting precedence names the unknown sub-task 'tea'; the pool has a, b, c.",
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
            "The score 'equation3' takes no tolerance; run 'teasim filter' again with "
            "'--score norm'.",
        ),
        (
            {"optional": ("a",), "score": "moments"},
            "The score 'moments' judges without sub-tasks and takes no optional; run 'teasim "
            "filter' again with '--score norm'.",
        ),
        (
            {"keep": (("a", "b"),), "score": "combined"},
            "The score 'combined' judges by moments too, which know no sub-tasks, and takes no "
            "keep; run 'teasim filter' again with '--score norm'.",
        ),
        (
            {"optional": ("a", "b"), "critical": ("b",)},
            "'b' cannot be both optional and critical; leave out one.",
        ),
        (
            {"precedence": ("a before b",)},
            "precedence has the entry 'a before b'; give pairs of names (a, b).",
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
    argv += ["--optional", "add sugar", "--critical", "stir", "--keep", "stir before add_milk"]
    assert main([*argv, "--tolerance", "0.1", "--threshold", "gmm"]) == 0
    record = json.loads((out / "filter.json").read_text())
    assert record["config"]["precedence"] == [list(pair) for pair in PAIRS]
    assert record["config"]["optional"] == ["add sugar"]
    assert record["config"]["critical"] == ["stir"]
    assert record["config"]["keep"] == [["stir", "add_milk"]]
    assert set(record["probability_incorrect"]) == set(truth)
    assert record["flagged"] == 2
    config = FilterConfig(precedence=PAIRS)
    found = DemoFilter(config).fit(SequencePool.open(tmp_path / "labels"))
    assert np.flatnonzero(found.flagged_).tolist() == [11, 12]
    assert "breaks the rule: turn_off_oven before add_water" in found.reasons_[11]


def test_videos_alone_are_judged_by_the_norm_where_rules_name_their_steps(toy_pool) -> None:
    usual = FilterConfig().for_source(toy_pool)
    assert (usual.score, usual.decision) == ("combined", "clusters")
    told = FilterConfig(segmenter="logged").for_source(toy_pool)
    assert (told.score, told.decision) == ("norm", "learned")
    asked = FilterConfig(decision="learned").for_source(toy_pool)
    assert (asked.score, asked.decision) == ("norm", "learned")
    for rule in ({"optional": ("step 1",)}, {"precedence": (("step 1", "step 2"),)}):
        assert FilterConfig(**rule).for_source(toy_pool).score == "norm"
    with pytest.raises(ConfigError, match="'moments' judges without sub-tasks and takes no crit"):
        FilterConfig(segmenter="agreement", critical=("step 1",)).for_source(toy_pool)
