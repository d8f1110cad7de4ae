"""Policies of sub-tasks that a filter found."""

import shutil

import numpy as np
import pytest

from policies.checkpoint import load_policy
from policies.data.demos import DemosConfig, load_decisions
from policies.data.found import weight_table, with_found_subtasks
from policies.settings import TrainSettings
from policies.training import train
from teasim.common.errors import ConfigError, PoolError
from teasim.common.workers import IN_PROCESS
from teasim.pool import Pool, Span
from teasim.pool.segments_table import segment_rows, write_segments_table
from tests.toy_pool import SEQ_1, make_toy_pool, strip_labels


def found_in(pool, folder):
    """Write the logged sub-tasks as if a filter had found and numbered them."""
    steps = {name: f"step {number + 1}" for number, name in enumerate(pool.subtasks)}
    spans = [
        tuple(Span(steps[s.subtask], s.start, s.stop) for s in episode.spans())
        for episode in pool.episodes
    ]
    folder.mkdir()
    write_segments_table(folder / "segments.csv", segment_rows(pool, spans))
    return folder


@pytest.fixture(scope="module")
def toy_pool(tmp_path_factory):
    return make_toy_pool(tmp_path_factory.mktemp("toy") / "pool", [SEQ_1] * 3, frames_per_subtask=3)


@pytest.fixture
def findings(toy_pool, tmp_path):
    return found_in(toy_pool, tmp_path / "findings")


@pytest.fixture
def stripped(toy_pool, tmp_path):
    return strip_labels(shutil.copytree(toy_pool.root, tmp_path / "stripped"))


def test_found_subtasks_are_decided_on_like_logged_ones(toy_pool, stripped, findings):
    pool = with_found_subtasks(stripped, None, findings, None)
    told = load_decisions(toy_pool, DemosConfig(observe="pixels"))
    learned = load_decisions(pool, DemosConfig(observe="pixels"))
    assert all(name.startswith("step ") for name in learned.action_names)
    order = [int(name.split()[1]) - 1 for name in learned.action_names]
    assert np.array_equal(np.array(order)[learned.labels], told.labels)
    assert np.array_equal(learned.maps, told.maps)


def test_a_policy_of_found_subtasks_is_trained(stripped, findings, tmp_path):
    settings = TrainSettings(
        pool=stripped.root,
        out=tmp_path / "policy",
        segments=findings / "segments.csv",
        observe="pixels",
        workers=IN_PROCESS,
    )
    train(settings)
    names = load_policy(tmp_path / "policy").action_names
    assert all(name.startswith("step ") for name in names)


def test_logged_subtasks_are_kept_unless_a_table_is_named(toy_pool, findings):
    assert with_found_subtasks(toy_pool, None, findings, None) is toy_pool
    named = with_found_subtasks(toy_pool, findings / "segments.csv", None, None)
    assert named.subtasks != toy_pool.subtasks


def test_names_are_used(stripped, findings, tmp_path):
    (tmp_path / "names.json").write_text('{"step 1": "boil"}')
    pool = with_found_subtasks(stripped, None, findings, tmp_path / "names.json")
    assert "boil" in pool.subtasks
    assert "step 1" not in pool.subtasks


def test_what_does_not_fit_is_refused_in_a_sentence(stripped, findings, tmp_path):
    with pytest.raises(ConfigError, match=r"^Names are for found sub-tasks; give their table"):
        with_found_subtasks(stripped, None, None, tmp_path / "names.json")
    other = tmp_path / "other.csv"
    text = (findings / "segments.csv").read_text().splitlines()
    other.write_text("\n".join([text[0], "nobody,0,step 1,0,2"]) + "\n")
    with pytest.raises(PoolError, match=r"knows no demonstration of '.*'; filter it again\.$"):
        with_found_subtasks(stripped, other, None, None)
    empty = tmp_path / "empty.csv"
    empty.write_text(text[0] + "\n")
    with pytest.raises(ConfigError, match=r"holds no sub-task; find some with: teasim filter "):
        with_found_subtasks(stripped, empty, None, None)


def test_the_folder_of_a_filter_stands_for_its_table(findings):
    assert weight_table(findings) == findings / "weights.csv"
    assert weight_table(findings / "weights.csv") == findings / "weights.csv"
    assert weight_table(None) is None


def test_a_pool_opened_again_is_the_same(toy_pool):
    assert with_found_subtasks(Pool.open(toy_pool.root), None, None, None).subtasks
