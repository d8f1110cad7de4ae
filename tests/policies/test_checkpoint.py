"""A saved policy comes back as it was, or not at all."""

import json

import numpy as np
import pytest

from policies.checkpoint import load_policy, save_policy
from teasim.common.errors import CheckpointError
from tests.policies.learning import ROWS, kind_of, make, replay

EVERY = pytest.mark.parametrize("name", ROWS)


@pytest.fixture
def run(samples, tmp_path):
    policy = make("bc", steps=5).fit(samples, np.ones(5)).policy_
    save_policy(policy, tmp_path / "run", training={"learner": "bc"})
    return tmp_path / "run"


@EVERY
def test_a_saved_policy_decides_as_before(name, samples, motions, tmp_path):
    samples = motions if kind_of(name).levels == ("joint",) else samples
    policy = make(name).fit(samples, np.ones(5)).policy_
    save_policy(policy, tmp_path, training={})
    loaded = load_policy(tmp_path)
    np.testing.assert_array_equal(replay(loaded, samples), replay(policy, samples))
    assert (loaded.spec, loaded.action_names) == (policy.spec, policy.action_names)


SHAPE = {"cameras": 2, "channels": 4, "low_dim": 2, "bottleneck": 32, "actions": 3}


def change(run, **fields):
    path = run / "policy.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))


def sentence(run):
    with pytest.raises(CheckpointError) as error:
        load_policy(run)
    return str(error.value)


def test_the_description_says_how_it_came_about(run):
    assert json.loads((run / "policy.json").read_text())["training"] == {"learner": "bc"}


def test_no_policy(tmp_path):
    assert sentence(tmp_path) == (
        f"'{tmp_path}' holds no trained policy: policy.json cannot be read."
    )


def test_another_version(run):
    change(run, version=9)
    assert sentence(run) == (
        f"'{run / 'policy.json'}' has version 9, this program reads 2; train again."
    )


def test_another_kind_of_file(run):
    (run / "policy.json").write_text("[]")
    assert sentence(run) == f"'{run / 'policy.json'}' does not describe a policy of this program."


@pytest.mark.parametrize("text", ["{", "\x00", ""])
def test_a_damaged_description(run, text):
    (run / "policy.json").write_text(text)
    assert sentence(run) == f"'{run / 'policy.json'}' is damaged: it is not JSON; train again."


@pytest.mark.parametrize("keep", [0, 10, -1])
def test_damaged_weights(run, keep):
    path = run / "policy.safetensors"
    path.write_bytes(path.read_bytes()[:keep])
    assert sentence(run) == (
        f"'{path}' is damaged: it is not the file that was saved; train again."
    )


def test_missing_weights(run):
    (run / "policy.safetensors").unlink()
    assert sentence(run) == f"'{run}' holds no trained policy: policy.safetensors cannot be read."


@pytest.mark.parametrize(
    "fields",
    [
        {"actions": ["a", "b"]},
        {"network": {}},
        {"network": SHAPE | {"channels": 5}},
        {"network": SHAPE | {"channels": "wide"}},
        {"network": SHAPE | {"depth": 1}},
        {"observation": None},
        {"kind": "oracle"},
        {"kind": "recurrent"},
        {"kind": "memory"},
        {"settings": {"hidden": 3}},
    ],
)
def test_a_description_of_other_weights(run, fields):
    change(run, **fields)
    assert sentence(run) == (
        f"'{run / 'policy.json'}' does not describe the weights beside it; train again."
    )
