"""Laws that every registered environment keeps, whatever it shows and however it is driven."""

import pickle

import gymnasium
import numpy as np
import pytest

from teasim.common.errors import ConfigError
from teasim.constants import STATE_NAMES
from teasim.envs.actions import CONTROLS
from teasim.envs.decisions import DecisionWeights
from teasim.envs.observations import OBS_TYPES
from teasim.envs.registration import register_envs
from teasim.envs.rewards import RewardWeights

VARIANTS = {control: ("TeaMaking", {"control": control}) for control in CONTROLS}
VARIANTS["subtasks"] = ("TeaMakingSubtasks", {})
SHAPED = {"reward_weights": {"subtasks": 1.0, "reference": 0.5, "idle": 2.0, "violations": 1.0}}
VARIANTS["shaped"] = ("TeaMakingSubtasks", SHAPED)
BLIND = {"events": ("TeaMakingEvents", {}), "shaped events": ("TeaMakingEvents", SHAPED)}
"""Variants without pictures: they have no other view than `state`, and no `render`."""
SMALL = {"width": 32, "height": 24, "render_mode": "rgb_array"}
CAMERAS = dict.fromkeys(OBS_TYPES, ("cup",)) | {"pixels_agent_pos": ("cup", "left")}

each_variant = pytest.mark.parametrize("variant", [*VARIANTS, *BLIND])
each_sight = pytest.mark.parametrize(
    ("variant", "view"),
    [*((v, view) for v in VARIANTS for view in OBS_TYPES), *((v, "state") for v in BLIND)],
)
pytestmark = pytest.mark.usefixtures("quick")


@pytest.fixture(scope="module")
def build():
    """Makes environments; the tests share them, for whatever was before must not matter."""
    made: dict[tuple, gymnasium.Env] = {}

    def build(variant: str, view: str = "state", copy: int = 0) -> gymnasium.Env:
        if (variant, view, copy) not in made:
            name, kwargs = (VARIANTS | BLIND)[variant]
            sight = {} if variant in BLIND else {"cameras": CAMERAS[view], **SMALL}
            made[variant, view, copy] = gymnasium.make(
                f"teasim:teasim/{name}-v0", obs_type=view, **sight, **kwargs
            )
        return made[variant, view, copy]

    yield build
    for env in made.values():
        env.close()


def bits(value: object) -> object:
    """The same thing with every array as its type and bytes, so that == means bit for bit."""
    if isinstance(value, dict):
        return {key: bits(part) for key, part in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return str(value.dtype), value.shape, value.tobytes()
    return value


def actions_for(env: gymnasium.Env, count: int) -> list:
    env.action_space.seed(5)
    return [env.action_space.sample() for _ in range(count)]


def run(env: gymnasium.Env, actions: list) -> list:
    """Everything that steps return and the pictures between them, as bits."""
    return [[bits(part) for part in (*env.step(action), look(env))] for action in actions]


def look(env: gymnasium.Env) -> object:
    """The picture that is shown now; None where there are none."""
    return env.render() if env.render_mode else None


def episode(env: gymnasium.Env, actions: list) -> list:
    return [[bits(part) for part in env.reset(seed=3)], *run(env, actions)]


def leaves(observation: dict, path: str = "") -> dict[str, np.ndarray]:
    """All arrays of a nested observation by their path."""
    found: dict[str, np.ndarray] = {}
    for key, value in observation.items():
        if isinstance(value, dict):
            found |= leaves(value, f"{path}{key}/")
        else:
            found[f"{path}{key}"] = value
    return found


def check_observations(env: gymnasium.Env, before: dict, after: dict) -> None:
    """As announced, finite, not blank, and in memory of their own."""
    assert before in env.observation_space
    assert after in env.observation_space
    ours, theirs = leaves(before), leaves(after)
    assert ours.keys() == theirs.keys()
    for key in ours:
        assert np.isfinite(theirs[key]).all()
        assert np.ptp(theirs[key]) > 0, key
        assert not np.shares_memory(ours[key], theirs[key])


def test_no_registered_environment_is_left_out():
    register_envs()
    ours = {name for name in gymnasium.registry if name.startswith("teasim/")}
    assert {f"teasim/{name}-v0" for name, _ in (VARIANTS | BLIND).values()} == ours


@each_sight
def test_what_comes_back_is_what_the_spaces_and_the_specification_say(build, variant, view):
    env = build(variant, view)
    assert env.spec.id == f"teasim/{(VARIANTS | BLIND)[variant][0]}-v0"
    observation, info = env.reset(seed=0)
    assert isinstance(info, dict)
    for action in actions_for(env, 2):
        assert action in env.action_space
        before = observation
        observation, reward, terminated, truncated, _ = env.step(action)
        check_observations(env, before, observation)
        assert [type(x) for x in (reward, terminated, truncated)] == [float, bool, bool]
        assert np.isfinite(reward)
    if env.render_mode:
        picture = env.render()
        assert (picture.shape, picture.dtype) == ((24, 32, 3), np.uint8)
        assert np.ptp(picture) > 50


@each_sight
def test_a_seed_gives_the_same_bits_in_another_instance_and_after_another_reset(
    build, variant, view
):
    env, other = build(variant, view), build(variant, view, copy=1)
    actions = actions_for(env, 3)
    first = episode(env, actions)
    assert episode(other, actions) == first
    assert episode(env, actions) == first


@each_sight
def test_going_back_to_a_state_and_on_gives_the_same_bits(build, variant, view):
    env = build(variant, view)
    env.reset(seed=1)
    before, after = np.split(np.array(actions_for(env, 5)), [2])
    for action in before:
        env.step(action)
    picture = bits(look(env))
    state = pickle.loads(pickle.dumps(env.get_wrapper_attr("get_state")()))
    kept = pickle.dumps(state)
    expected = run(env, after)
    reset_next = bits(env.reset()[0])
    other = build(variant, view, copy=1)
    other.reset(seed=9)
    for one in (env, other):
        one.get_wrapper_attr("set_state")(state)
        assert bits(look(one)) == picture
        assert run(one, after) == expected
        assert bits(one.reset()[0]) == reset_next  # the generator went back, too
    assert pickle.dumps(state) == kept


@each_variant
def test_the_reward_is_the_weighted_sum_of_its_terms(build, variant):
    env = build(variant)
    env.reset(seed=0)
    kind = RewardWeights if variant in CONTROLS else DecisionWeights
    weights = kind.of((VARIANTS | BLIND)[variant][1].get("reward_weights"))
    for action in actions_for(env, 6):
        _, reward, _, _, info = env.step(action)
        terms = info["reward_terms"]
        assert reward == weights.total(terms)
        assert all(np.isfinite(term) for term in terms.values())


def test_the_state_of_another_environment_is_refused(build):
    joints, subtasks = build("position").unwrapped, build("subtasks").unwrapped
    joints.reset(seed=0)
    state = joints.get_state()
    with pytest.raises(ConfigError) as error:
        subtasks.set_state(state)
    assert str(error.value) == "The state is of TeaMakingEnv; this is TeaMakingSubtasksEnv."
    events = build("events").unwrapped
    events.reset(seed=0)
    with pytest.raises(ConfigError) as error:
        events.set_state(state)
    assert str(error.value) == "The state is of TeaMakingEnv; this is TeaMakingEventsEnv."
    with pytest.raises(ConfigError) as error:
        joints.set_state(events.get_state())
    assert str(error.value) == "The state is of TeaMakingEventsEnv; this is TeaMakingEnv."


@pytest.mark.parametrize("control", CONTROLS)
def test_actions_out_of_range_are_clipped(build, control):
    env = build(control)
    beyond, edge = np.linspace(-3, 3, 16), np.clip(np.linspace(-3, 3, 16), -1, 1)
    assert episode(env, [beyond]) == episode(env, [edge])


NAN = np.where(np.arange(16) == 8, np.nan, 0.0)
REFUSED = {
    "nan": (NAN, f"The action for {STATE_NAMES[8]} is nan; give a finite number."),
    "inf": (np.full(16, -np.inf), "The action for right_joint_1 is -inf; give a finite number."),
    "shape": (np.zeros(3), "An action has the shape (16,), not (3,)."),
    "word": ("up", "An action is 16 numbers, not 'up'."),
    "None": (None, "An action has the shape (16,), not ()."),
}


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("kind", REFUSED)
def test_an_action_that_is_none_is_refused_and_harms_nothing(build, control, kind):
    action, sentence = REFUSED[kind]
    env = build(control)
    env.reset(seed=0)
    before = pickle.dumps(env.unwrapped.get_state())
    with pytest.raises(ConfigError) as error:
        env.step(action)
    assert str(error.value) == sentence
    assert pickle.dumps(env.unwrapped.get_state()) == before
