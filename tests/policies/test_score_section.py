"""The report's section: words that follow the numbers, markup that parses."""

import xml.etree.ElementTree as ElementTree

from policies.experiments.score_section import score_section, sentences
from policies.play.evaluation import score
from policies.play.rollout import Action, Episode


def scores_of(hits, trials):
    episodes = [
        Episode(
            seed=seed,
            actions=(Action("stir", "stir", seed < hits, True),),
            success=True,
            subtasks_done=(),
            violations=(),
            kinds={"stove <left> on": False},
        )
        for seed in range(trials)
    ]
    return {"sampled": score("sampled", episodes, ("stir",))}


def test_a_clear_difference_is_called_one():
    (sentence,) = sentences({"all <demos>": scores_of(10, 50), "kept": scores_of(50, 50)})
    assert sentence.endswith("; 80.0 points better.")


def test_overlapping_intervals_are_not_called_a_difference():
    (sentence,) = sentences({"all": scores_of(8, 10), "kept": scores_of(7, 10)})
    assert sentence.endswith(
        "10.0 points worse, but the intervals overlap: more episodes are needed to tell."
    )
    (sentence,) = sentences({"all": scores_of(8, 10), "kept": scores_of(8, 10)})
    assert sentence.endswith("; no difference.")


def test_one_policy_is_nothing_to_compare():
    assert "nothing to compare" in sentences({"all": scores_of(1, 1)})[0]


def test_markup_is_well_formed_and_needs_nothing_from_outside():
    html = score_section({"all <demos>": scores_of(10, 50), "kept": scores_of(0, 0)})
    tree = ElementTree.fromstring(f"<div>{html}</div>")
    assert len(tree.findall(".//circle")) == 1
    assert len(tree.findall(".//tbody/tr")) == 2
    assert [head.text for head in tree.findall(".//th")][-1] == "stove <left> on"
    assert "http" not in html
