"""Which frames show a decision, and what a pool without joints, cameras or labels gives."""

import numpy as np
import pytest

from policies.demos import DemosConfig, find_decisions, load_decisions
from teasim.constants import STATE_NAMES, SUBTASKS
from teasim.errors import ConfigError, PoolError
from teasim.pool import Span

SPANS = (Span("a", 2, 6), Span("b", 6, 9))


def frames(joints, most=9):
    column = None if joints is None else np.array(joints, dtype=np.float32)[:, None]
    return [decision.frames for decision in find_decisions(SPANS, ("b", "a"), column, most)]


def test_the_start_of_the_span_comes_first_and_its_name_is_the_label():
    decisions = find_decisions(SPANS, ("b", "a"), None, 9)
    assert [(d.label, d.frames) for d in decisions] == [(1, (2,)), (0, (6,))]


def test_rest_around_the_start_belongs_to_the_decision():
    assert frames([0, 0, 0, 0, 1, 1, 0, 0, 0]) == [(2, 1, 3, 0), (6, 7, 8)]


def test_rest_ends_with_the_first_motion():
    assert frames([0, 1, 0, 1, 0, 0, 0, 1, 0]) == [(2,), (6,)]


def test_the_end_of_the_span_before_is_never_asked():
    assert frames([0, 0, 0, 0, 0, 0, 0, 0, 0])[1] == (6, 7, 8)


def test_at_most_so_many_frames():
    assert frames([0, 0, 0, 0, 0, 0, 0, 0, 0], most=2) == [(2, 1), (6, 7)]


def test_decisions_of_a_pool(fake_pool):
    samples = load_decisions(fake_pool)
    assert samples.action_names == SUBTASKS
    assert samples.spec.cameras == ("left", "cup")
    assert (samples.spec.height, samples.spec.width) == (64, 64)
    assert samples.spec.state_names == STATE_NAMES
    # Six demonstrations of seven decisions and one of six, each seen in three frames.
    assert len(samples.labels) == 3 * (6 * 7 + 6)
    assert samples.shares.sum() == pytest.approx(48)
    np.testing.assert_array_equal(np.bincount(samples.demos), [21] * 6 + [18])
    np.testing.assert_array_equal(samples.labels[:21:3], [0, 4, 2, 3, 6, 1, 5])
    assert not samples.inputs.flags.writeable


def test_the_number_of_workers_changes_nothing(fake_pool):
    one, two = load_decisions(fake_pool), load_decisions(fake_pool, jobs=2)
    np.testing.assert_array_equal(one.inputs, two.inputs)
    np.testing.assert_array_equal(one.labels, two.labels)


def test_a_pool_without_joints_is_learned_from_its_frames(human_pool):
    samples = load_decisions(human_pool)
    assert samples.spec.state_names == ()
    assert len(samples.labels) == 7
    with pytest.raises(ConfigError) as error:
        load_decisions(human_pool, DemosConfig(observe="pixels_agent_pos"))
    assert str(error.value) == (
        f"'{human_pool.root}' logs no joint positions; choose observe auto or pixels instead."
    )


def test_frames_alone_and_one_camera_can_be_asked_for(fake_pool):
    both = load_decisions(fake_pool)
    one = load_decisions(fake_pool, DemosConfig(observe="pixels", cameras=("cup",)))
    assert one.spec.cameras == ("cup",)
    assert 2 * one.inputs.shape[1] + len(STATE_NAMES) == both.inputs.shape[1]


def test_an_unknown_camera_names_the_choices(fake_pool):
    with pytest.raises(ConfigError) as error:
        load_decisions(fake_pool, DemosConfig(cameras=("back",)))
    assert str(error.value) == f"'{fake_pool.root}' has no camera 'back'; choose left, cup."


def test_unknown_settings_name_the_choices():
    with pytest.raises(ConfigError) as error:
        DemosConfig(observe="state")
    assert str(error.value) == "Unknown observe 'state'; choose auto, pixels, pixels_agent_pos."
    with pytest.raises(ConfigError, match=r"^rest_frames is 0; choose 1 or more\.$"):
        DemosConfig(rest_frames=0)


def test_a_pool_without_labels_has_no_decisions(fake_pool, monkeypatch):
    monkeypatch.setattr(type(fake_pool), "subtasks", ())
    with pytest.raises(PoolError, match="has no sub-task labels, so there is no decision"):
        load_decisions(fake_pool)
