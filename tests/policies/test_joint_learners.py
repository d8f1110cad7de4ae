"""Learners of joint targets: inputs, switches, rests, joined plans, a problem with an answer."""

import numpy as np
import pytest
import torch

from policies.data.motions import MotionDemo, MotionSamples
from policies.data.samples import ObservationSpec
from policies.learners.joints.chunk_policy import ChunkPolicy
from policies.learners.joints.networks import PlanShape
from policies.learners.joints.steps.inputs import NEAR, StateInputs
from policies.learners.joints.steps.involved import involved_bodies, relevance
from policies.learners.joints.steps.rests import PRESSING, restless
from policies.learners.joints.steps.rows import prepare
from policies.learners.joints.steps.switches import OLDEST, steps_since_change, switch_values
from tests.policies.learning import kind_of

POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")


def test_numbers_without_a_pose_are_given_as_they_are():
    seen = np.arange(6, dtype=np.float32).reshape(2, 3)
    inputs = StateInputs(("elbow", "cup_x", "cup_amount"))
    assert inputs.count == 3
    np.testing.assert_array_equal(inputs(seen), seen)


def test_a_rotation_is_given_as_two_columns_of_its_matrix():
    names = [f"cup_{part}" for part in POSE]
    half = np.sqrt(0.5)
    seen = np.array([[1, 2, 3, half, 0, 0, half], [1, 2, 3, -half, 0, 0, -half]], np.float32)
    given = StateInputs(names)(seen)
    np.testing.assert_allclose(given, [[1, 2, 3, 0, 1, 0, -1, 0, 0]] * 2, atol=1e-6)


def test_a_position_in_a_hands_frame_is_magnified_near_the_hand():
    names = [f"cup_in_left_hand_{part}" for part in POSE]
    inputs = StateInputs(names)
    near, same, far = np.array([[0.001, 0, 0.5, 1, 0, 0, 0]] * 3, np.float32)
    far[0] += 0.001
    given = inputs(np.stack([near, same, far]))
    assert given.shape == (3, inputs.count) == (3, 3 + 6 + 3)
    assert given[2, -3] - given[0, -3] == pytest.approx(0.001 / NEAR, rel=0.01)
    assert given[0, -1] == pytest.approx(1)


def test_places_in_the_world_are_left_out_where_a_hand_sees_the_thing():
    names = [f"{body}_{part}" for body in ("cup", "cup_in_hand", "jug") for part in POSE]
    inputs = StateInputs([*names, "cup_amount"])
    assert {name for name in inputs.sources if not name.startswith("cup_in_hand")} == {
        *(f"jug_{part}" for part in ("x", "y", "z", "qw")),
        "cup_amount",
    }


def test_what_a_sub_task_involves_is_found_in_most_demonstrations():
    """The cup is moved in sub-task 0, beside the jug; in sub-task 1 the knob is turned."""
    names = [f"{body}_{part}" for body in ("cup", "jug", "pot", "hand", "foot") for part in "xyz"]
    names += ["knob_angle", "knob_in_foot_qw"]
    names += [f"{body}_in_hand_x" for body in ("cup", "jug", "pot")]
    seen = np.zeros((10, len(names)), np.float32)
    seen[:5, names.index("cup_x")] = seen[:5, names.index("hand_z")] = np.linspace(0, 0.2, 5)
    seen[:, names.index("jug_x")] = 0.25
    seen[:, names.index("pot_x")] = 0.5
    seen[5:, names.index("knob_angle")] = np.linspace(0, 1, 5)
    idle = np.zeros_like(seen)
    tasks = np.repeat([0, 1], 5)
    demos = [MotionDemo(array, array, tasks, share) for array, share in ((seen, 0.6), (idle, 0.4))]
    involved = involved_bodies(demos, names, 3)
    assert involved == [{"cup", "jug", "hand"}, {"knob"}, set()]
    sources = ("elbow", "cup_in_hand_x", "pot_in_hand_qw", "cup_in_foot_x", "knob_in_foot_z")
    assert relevance(sources, involved, 1).tolist() == [
        [1, 1, 0, 0, 0, 1],
        [1, 0, 0, 0, 0, 1],
        [1, 1, 1, 1, 1, 1],
    ]


def test_a_target_of_few_values_is_a_switch():
    random = np.random.default_rng(0)
    targets = np.stack([random.normal(size=600), np.repeat([0.0, 0.05], 300), np.zeros(600)], 1)
    found = switch_values(targets.astype(np.float32))
    assert {place: values.tolist() for place, values in found.items()} == {
        1: pytest.approx([0, 0.05])
    }
    assert switch_values(targets[250:350]) == {}  # too short to tell


def test_the_time_since_a_switch_changed():
    commands = np.array([[0], [0], [1], [1], [1], [0], [0]], np.float32)
    assert steps_since_change(commands).ravel().tolist() == [OLDEST, OLDEST, OLDEST, 1, 2, 3, 1]


def test_only_waiting_without_a_purpose_is_rest():
    count = 3 * PRESSING
    moving = np.linspace(0, 1, count)[:, None].astype(np.float32)
    still, grip = np.zeros((count, 1), np.float32), np.zeros((count, 1), np.float32)
    grip[count // 3 :] = 1
    assert restless(still, np.hstack([moving, grip]), [1], [0]).all()
    assert restless(moving, np.hstack([still, grip]), [1], [0])[:-1].all()
    kept = restless(still, np.hstack([still, grip]), [1], [0])
    first = count // 3
    assert np.flatnonzero(kept).tolist() == [0, *range(first, first + PRESSING + 1)]


class Counting:
    """Plans 10 t + k for step k from what is seen at time t, for one joint and one switch."""

    kind, ensemble, memory = "counting", 0.5, ()
    shape = PlanShape(inputs=3, actions=2, chunk=3, subtasks=1, width=1, blocks=1)
    values = torch.tensor([[torch.nan] * 16, [0.0, 1.0] + [torch.nan] * 14])

    def eval(self):
        return self

    def plan(self, inputs, _subtasks, _hidden):
        ahead = 10 * inputs[:, 2, None] + torch.arange(3)
        planned = torch.stack([ahead, (ahead > 15).float()], dim=2)
        return torch.zeros(len(inputs), 1), planned, ()


SPEC = ObservationSpec((), 0, 0, ("elbow", "grip"), ("clock",))


def run(policy, times, state=None, start=None):
    found = []
    for time in times:
        seen = {"agent_pos": np.zeros((1, 2)), "environment_state": np.array([[time]])}
        target, state = policy.predict(seen, state, start, deterministic=True)
        start = np.zeros(1, bool)
        found.append(target[0].tolist())
    return found, state


def test_plans_are_joined_with_half_the_weight_of_the_step_before():
    policy = ChunkPolicy(Counting(), SPEC, SPEC.state_names)
    found, _ = run(policy, [0, 1, 2, 3])
    elbow = [row[0] for row in found]
    two = (20 + 11 / 2 + 2 / 4) / (1 + 1 / 2 + 1 / 4)
    three = (30 + 21 / 2 + 12 / 4) / (1 + 1 / 2 + 1 / 4)  # the first plan has ended
    assert elbow == pytest.approx([0, (10 + 1 / 2) / 1.5, two, three])
    assert [row[1] for row in found] == [0, 0, 1, 1]


def test_an_episode_that_starts_forgets_the_one_before():
    policy = ChunkPolicy(Counting(), SPEC, SPEC.state_names)
    fresh, _ = run(policy, [0, 1, 2])
    _, state = run(policy, [5, 6, 7])
    assert run(policy, [0, 1, 2], state, np.ones(1, bool))[0] == fresh
    assert run(policy, [0, 1, 2], state, np.zeros(1, bool))[0] != fresh


@pytest.mark.parametrize("row", ["act", "bc@joint", "bc-rnn@joint"])
def test_many_observations_are_answered_as_one_by_one(row, motions):
    policy = kind_of(row).make(steps=3, width=8, batch=4).fit(motions, np.ones(5)).policy_
    seen = motions.low_dim.reshape(5, 6, 3)
    states, together, alone = None, [], []
    for step in range(6):
        batch = {"agent_pos": seen[:, step, :2], "environment_state": seen[:, step, 2:]}
        targets, states = policy.predict(batch, states, np.full(5, step == 0))
        together.append(targets)
    for demo in range(5):
        state = None
        for step in range(6):
            one = {"agent_pos": seen[demo, step, :2], "environment_state": seen[demo, step, 2:]}
            target, state = policy.predict(one, state, np.array([step == 0]))
            alone.append(target)
    np.testing.assert_allclose(
        np.stack(together, 1), np.stack(alone).reshape(5, 6, 2), rtol=1e-4, atol=1e-5
    )


def ways(count, random):
    """`count` ways of two joints to a goal: the distance halves in every step, then it is held."""
    goals = random.uniform(-1, 1, (count, 2))
    here, low_dim, targets = random.uniform(-1, 1, (count, 2)), [], []
    for _ in range(12):
        target = (here + goals) / 2
        low_dim.append(np.hstack([here, goals]))
        targets.append(target)
        here = target
    flat = [
        np.stack(part, 1).reshape(12 * count, -1).astype(np.float32) for part in (low_dim, targets)
    ]
    spec = ObservationSpec((), 0, 0, ("shoulder", "elbow"), ("goal_a", "goal_b"))
    return MotionSamples(*flat, np.repeat(np.arange(count), 12), spec, spec.state_names)


@pytest.mark.parametrize(("row", "batch"), [("act", 32), ("bc@joint", 32), ("bc-rnn@joint", 4)])
def test_goals_that_were_never_shown_are_reached(row, batch):
    """The answer is known: every step halves the distance to the goal."""
    random = np.random.default_rng(0)
    settings = {"steps": 400, "width": 32, "blocks": 1, "batch": batch, "learning_rate": 5e-3}
    settings |= {"hidden": 8, "horizon": 6} if row == "bc-rnn@joint" else {}
    learner = kind_of(row).make(**settings).fit(ways(60, random), np.ones(60))
    goals, here, state = random.uniform(-0.8, 0.8, (20, 2)), np.zeros((20, 2)), None
    for step in range(25):
        seen = {"agent_pos": here, "environment_state": goals}
        here, state = learner.policy_.predict(seen, state, np.full(20, step == 0))
    assert np.abs(here - goals).max() < 0.1


def test_equal_demonstrations_are_one_of_their_common_weight(motions):
    rows = prepare(motions, np.array([1.0, 1, 1, 1, 2]), timed=True)
    assert rows.shares.sum() == pytest.approx(1)
    assert sorted(rows.shares.tolist()) == pytest.approx([1 / 6] * 4 + [1 / 3])
    assert rows.stops[-1] == len(rows.targets) == len(rows.given)


def test_a_plan_holds_the_last_target_of_a_demonstration(motions):
    rows = prepare(motions, np.ones(5), timed=False)
    last = np.array([rows.stops[1] - 1])
    planned = rows.planned(last, 4)
    assert planned.shape == (1, 4, 2)
    wanted = rows.targets[last[0]] - rows.measured[last[0]]
    np.testing.assert_array_equal(planned[0], np.tile(wanted, (4, 1)))


def test_what_is_remembered_is_cleared_after_the_horizon():
    """From then on, a recurrent policy acts as if the episode had begun there."""
    random = np.random.default_rng(0)
    settings = {"steps": 50, "width": 32, "blocks": 1, "hidden": 8, "horizon": 3, "ensemble": 0.0}
    policy = kind_of("bc-rnn@joint").make(**settings).fit(ways(20, random), np.ones(20)).policy_
    seen = [random.uniform(-0.8, 0.8, (2, 2)) for _ in range(5)]

    def run(first):
        state, targets = None, []
        for here, goal in seen[first:]:
            observation = {"agent_pos": here, "environment_state": goal}
            target, state = policy.predict(observation, state)
            targets.append(target)
        return targets

    assert np.allclose(run(0)[3:], run(3), atol=1e-6)
    assert not np.allclose(run(0)[2], run(2)[0], atol=1e-6)
