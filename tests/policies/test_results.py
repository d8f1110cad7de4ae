"""Scores on disk: JSON that loads, JUnit that says what the exit code says."""

import json
import xml.etree.ElementTree as ElementTree

import pytest

from policies.play.evaluation import score
from policies.play.junit import Bar, write_junit
from policies.play.results import as_json, summary
from policies.play.rollout import Action, Episode
from teasim.common.errors import ConfigError


def scores_of(*correct):
    actions = tuple(Action("stir", "add_water", c, c) for c in correct)
    episodes = [
        Episode(
            seed=7,
            actions=actions,
            success=all(correct),
            subtasks_done=(),
            violations=("on_fire",),
            kinds={"kitchen on fire": True, "spilled": False},
        )
    ]
    return {mode: score(mode, episodes, ("stir",)) for mode in ("deterministic", "sampled")}


def test_json_has_rates_in_percent_and_every_episode():
    s = json.loads(json.dumps(as_json(scores_of(True, False))))["sampled"]
    assert s["policy_accuracy"]["percent"] == 50
    assert s["policy_accuracy"]["hits"] == 1
    assert s["completion"]["stir"]["percent"] == s["violations"]["spilled"]["percent"] == 0
    assert s["violations"]["kitchen on fire"]["percent"] == 100
    assert s["violation_counts"] == {"on_fire": 1}
    assert [a["correct"] for a in s["episodes"][0]["actions"]] == [True, False]


def test_no_action_at_all_is_null():
    assert as_json(scores_of())["sampled"]["policy_accuracy"]["percent"] is None
    assert not Bar(50).passed(scores_of())


@pytest.mark.parametrize(("percent", "failures"), [(50, 0), (50.1, 1), (100, 1)])
def test_junit_fails_exactly_when_the_bar_is_missed(tmp_path, percent, failures):
    scores = scores_of(True, False)
    write_junit(tmp_path / "j.xml", scores, Bar(percent))
    root = ElementTree.parse(tmp_path / "j.xml").getroot()
    suites = {suite.get("name"): suite for suite in root}
    deterministic = suites["teasim.evaluate.deterministic"]
    assert int(deterministic.get("failures")) == len(root.findall(".//failure")) == failures
    assert Bar(percent).passed(scores) == (failures == 0)
    for suite in root:
        assert int(suite.get("tests")) == len(suite.findall("testcase"))


def test_junit_without_a_bar_never_fails_and_tells_the_story(tmp_path):
    write_junit(tmp_path / "j.xml", scores_of(False), None)
    root = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert root.find(".//failure") is None
    story = "stir (reference: add_water): goal not reached, kitchen on fire"
    assert root.find(".//system-out").text == story


def test_summary_is_in_percent():
    text = summary(scores_of(True, False))
    assert "policy accuracy  50.0 % (" in text
    assert "  kitchen on fire  100.0 % (" in text
    assert "  spilled          0.0 % (" in text
    assert "  stir             done in 0.0 % (" in text


@pytest.mark.parametrize(
    ("percent", "sentence"),
    [
        (101, "The least policy accuracy is 101 %; choose a number from 0 to 100."),
        (
            0.9,
            "The least policy accuracy is in percent: 0.9 would be 0.9 %; write 90 for that share.",
        ),
    ],
)
def test_a_bar_that_cannot_be_meant_is_refused(percent, sentence):
    with pytest.raises(ConfigError) as error:
        Bar(percent)
    assert str(error.value) == sentence
