"""Any object that answers `predict` is evaluated like a policy that was learned here."""

import json
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

from policies import foreign
from policies.cli import evaluate
from policies.foreign import ForeignJointPolicy, adopt, is_named
from policies.play.evaluation import evaluate as score
from policies.play.joint_evaluation import evaluate_motion
from policies.settings import EvaluationConfig
from teasim.common.errors import ConfigError
from teasim.common.workers import Workers
from tests.policies.fake_joints import FAKE_JOINTS, FAKE_JOINTS_ID, JOINTS
from tests.policies.fakes import FAKE_ID, FAKE_WORLD, FLAGS, ScriptedPolicy

THEIRS = '''
import numpy as np
from policies.data.samples import ObservationSpec
from tests.policies.fake_joints import PLACES
from tests.policies.fakes import SEQ_1, SIZE

class Reference:
    """Does the first sub-task of Seq_1 that the state does not show."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        done = observation["environment_state"]
        left = [place for place in SEQ_1 if not done[place]]
        return self.choose(left[0]), state

    def choose(self, place):
        return np.array([place])

class Seeing(Reference):
    spec = ObservationSpec(("cup",), SIZE, SIZE)

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        assert set(observation) == {"agent_pos", "pixels"}
        return 4, None

class Moving(Reference):
    level = "joint"
    draws = False

    def choose(self, place):
        return PLACES[place]

class Counting:
    """Recurrent, and drawn at random."""

    def set_random_seed(self, seed):
        self.random = np.random.default_rng(seed)

    def predict(self, observation, state, episode_start, deterministic):
        count = 0 if episode_start[0] else state
        order = SEQ_1 if deterministic else self.random.permutation(7)
        return int(order[count % 7]), count + 1

class Lost(Reference):
    level = "elbow"

class Ninth(Reference):
    def choose(self, place):
        return 9

class Half(Reference):
    level = "joint"

    def choose(self, place):
        return PLACES[place][:8]

class Bare:
    def predict(self, *_):
        return 3

def make():
    return Reference()

made = Reference()
nothing = 3
'''


@pytest.fixture
def theirs(tmp_path, monkeypatch):
    (tmp_path / "their_policies.py").write_text(THEIRS)
    (tmp_path / "needy.py").write_text("import no_such_library")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    yield tmp_path
    for name in ("their_policies", "needy"):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("attribute", ["Reference", "make", "made"])
def test_a_class_a_function_and_an_object_are_all_policies(theirs, attribute):
    policy = adopt(f"their_policies:{attribute}", FAKE_WORLD)
    scores = score(policy, EvaluationConfig(2, environment=FAKE_WORLD))
    for found in scores.values():
        assert found.policy_accuracy.value == found.success.value == 1
    assert scores == score(ScriptedPolicy(), EvaluationConfig(2, environment=FAKE_WORLD))


def test_a_policy_without_a_spec_sees_the_state_of_the_environment(theirs):
    spec = adopt("their_policies:made", FAKE_WORLD).spec
    assert (spec.cameras, len(spec.state_names)) == ((), JOINTS)
    assert len(spec.environment_names) == len(FLAGS)


def test_a_policy_with_a_spec_sees_the_cameras_it_names(theirs):
    policy = adopt("their_policies:Seeing", FAKE_WORLD)
    scores = score(policy, EvaluationConfig(1, environment=FAKE_WORLD))
    assert scores["deterministic"].success.value == 0


def test_a_policy_keeps_its_memory_and_draws_from_the_seed_of_the_episode(theirs):
    policy = adopt("their_policies:Counting", FAKE_WORLD)
    config = EvaluationConfig(4, environment=FAKE_WORLD)
    scores = score(policy, config)
    assert scores["deterministic"].policy_accuracy.value == 1
    assert scores["sampled"].policy_accuracy.value < 1
    assert score(policy, config) == scores


def test_it_is_made_once_in_a_process(theirs, monkeypatch):
    found = []
    find = foreign.find_object
    monkeypatch.setattr(foreign, "find_object", lambda *name: found.append(name) or find(*name))
    adopt("their_policies:Counting", FAKE_WORLD)
    assert len(found) == 1


def test_it_is_made_anew_in_other_processes(theirs):
    policy = adopt("their_policies:Counting", FAKE_WORLD)
    copy = pickle.loads(pickle.dumps(policy))
    assert (copy.spec, copy.action_names) == (policy.spec, policy.action_names)
    config = EvaluationConfig(5, environment=FAKE_WORLD)
    assert score(policy, config, workers=Workers(2)) == score(policy, config)


def test_a_policy_of_the_joint_level_says_so(theirs):
    policy = adopt("their_policies:Moving", FAKE_JOINTS)
    assert isinstance(policy, ForeignJointPolicy)
    scores = evaluate_motion(policy, EvaluationConfig(2, environment=FAKE_JOINTS))
    assert tuple(scores) == ("deterministic",)
    assert scores["deterministic"].success.value == 1


def test_the_verb_takes_a_name_in_place_of_a_folder(theirs, capsys):
    options = ["--env-id", FAKE_ID, "--episodes", "2", "--jobs", "1"]
    rival = ["--against", "their_policies:Counting", "--json", "scores.json"]
    assert evaluate(["their_policies:made", *options, *rival]) == 0
    assert "their_policies:Counting" in capsys.readouterr().out
    found = json.loads(Path("scores.json").read_text())
    assert found["run"] == "their_policies:made"
    joints = ["--env-id", FAKE_JOINTS_ID, "--episodes", "1", "--jobs", "1"]
    assert evaluate(["their_policies:Moving", *joints]) == 0
    assert "goal reached" in capsys.readouterr().out


def test_a_folder_with_a_colon_is_a_folder(theirs):
    assert is_named(Path("a.b:c"))
    assert not is_named(Path("a/b:c"))
    Path("a:c").mkdir()
    assert not is_named(Path("a:c"))


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("absent:made", "There is no module 'absent' for the policy 'absent:made'; start in its "),
        (
            "their_policies:gone",
            "The module 'their_policies' has no 'gone'; what has a method predict there: "
            "Reference, Seeing, Moving, Counting, Lost, Ninth, Half, Bare, made.",
        ),
        ("their_policies:nothing", "'their_policies:nothing' has no method predict(observation, "),
        ("their_policies:Lost", "Unknown level 'elbow' of 'their_policies:Lost'; choose subtask,"),
        ("policy", "'policy' names no policy; write MODULE:NAME."),
    ],
)
def test_what_is_no_policy_is_refused(theirs, name, sentence):
    with pytest.raises(ConfigError) as error:
        adopt(name, FAKE_WORLD)
    assert str(error.value).startswith(sentence)


def test_what_a_module_lacks_itself_is_its_own_error(theirs):
    with pytest.raises(ModuleNotFoundError, match="no_such_library"):
        adopt("needy:made", FAKE_WORLD)


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("Ninth", "predict of 'their_policies:Ninth' chose 9; choose a number from 0 to 6."),
        ("Bare", "predict of 'their_policies:Bare' returned 3; return (action, state)."),
        ("Half", "predict of 'their_policies:Half' returned 8 targets; return 16."),
    ],
)
def test_a_bad_answer_is_named(theirs, name, sentence):
    policy = adopt(f"their_policies:{name}", FAKE_JOINTS if name == "Half" else FAKE_WORLD)
    seen = {"environment_state": np.zeros(len(FLAGS))}
    with pytest.raises(ConfigError) as error:
        policy.predict(seen)
    assert str(error.value) == sentence
