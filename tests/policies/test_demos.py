"""What a pool's decisions are, and what one without joints, cameras or labels gives."""

import numpy as np
import pytest

from policies.data.demos import DemosConfig, load_decisions
from policies.data.features import camera_maps
from policies.data.samples import ObservationSpec
from teasim.common.errors import ConfigError, PoolError
from teasim.common.workers import Workers
from teasim.constants import STATE_NAMES, SUBTASKS
from tests.policies.fakes import FLAGS
from tests.toy_pool import SEQ_1, make_toy_pool


def test_decisions_of_a_pool(decisions):
    assert decisions.action_names == SUBTASKS
    assert decisions.spec == ObservationSpec(("left", "cup"), 64, 64, STATE_NAMES)
    # Six demonstrations of seven decisions and one of six, each in two views of two cameras.
    assert decisions.maps.shape == (6 * 7 + 6, 2, 2, 112, 4, 4)
    np.testing.assert_array_equal(np.bincount(decisions.demos), [7] * 6 + [6])
    np.testing.assert_array_equal(decisions.labels[:7], [0, 4, 2, 3, 6, 1, 5])
    assert np.abs(decisions.low_dim).max() < 1e-3  # at rest, as at the start of every span
    assert not decisions.maps.flags.writeable


def test_the_first_view_is_the_frame_at_the_start_of_the_span(fake_pool, decisions):
    episode = fake_pool.episodes[0]
    starts = [span.start for span in episode.spans()]
    frames = {camera: episode.clip(camera).frames(starts) for camera in ("left", "cup")}
    maps = camera_maps(frames, ("left", "cup")).astype(float)
    # The batches differ, and with them the last bit of a half.
    np.testing.assert_allclose(decisions.maps[:7, 0], maps, rtol=2e-3, atol=2e-3)


def test_altered_views_depend_on_seed_and_demonstration_alone(fake_pool, decisions):
    again = load_decisions(fake_pool, DemosConfig(copies=1, seed=1), workers=Workers(2))
    np.testing.assert_array_equal(decisions.maps[:, 0], again.maps[:, 0])
    assert (decisions.maps[:, 1] != again.maps[:, 1]).any(axis=(1, 2, 3, 4)).all()


def test_the_number_of_workers_changes_nothing(fake_pool, decisions):
    again = load_decisions(fake_pool, DemosConfig(copies=1), workers=Workers(2))
    np.testing.assert_array_equal(decisions.maps, again.maps)
    np.testing.assert_array_equal(decisions.labels, again.labels)


def test_a_pool_without_joints_is_learned_from_its_frames(human_pool):
    samples = load_decisions(human_pool)
    assert samples.spec.state_names == ()
    assert samples.low_dim.shape == (7, 0)
    with pytest.raises(ConfigError) as error:
        load_decisions(human_pool, DemosConfig(observe="pixels_agent_pos"))
    assert str(error.value) == (
        f"'{human_pool.root}' logs no joint positions; choose observe auto or pixels instead."
    )


def test_frames_alone_and_one_camera_can_be_asked_for(human_pool):
    one = load_decisions(human_pool, DemosConfig(observe="pixels", cameras=("cup",), copies=0))
    assert one.spec == ObservationSpec(("cup",), 64, 64)
    assert one.maps.shape[1:3] == (1, 1)
    assert one.low_dim.shape == (7, 0)


def test_an_unknown_camera_names_the_choices(fake_pool):
    with pytest.raises(ConfigError) as error:
        load_decisions(fake_pool, DemosConfig(cameras=("back",)))
    assert str(error.value) == f"'{fake_pool.root}' has no camera 'back'; choose left, cup."


def test_unknown_settings_name_the_choices():
    with pytest.raises(ConfigError) as error:
        DemosConfig(observe="sound")
    assert str(error.value) == (
        "Unknown observe 'sound'; choose auto, pixels, pixels_agent_pos, state."
    )
    with pytest.raises(ConfigError, match=r"^copies is -1; choose 0 or more\.$"):
        DemosConfig(copies=-1)


def test_a_pool_without_labels_has_no_decisions(fake_pool, monkeypatch):
    monkeypatch.setattr(type(fake_pool), "subtasks", ())
    with pytest.raises(PoolError, match="has no sub-task labels, so there is no decision"):
        load_decisions(fake_pool)


def test_the_state_alone_needs_no_frame(fake_pool):
    samples = load_decisions(fake_pool, DemosConfig(observe="state"))
    assert samples.spec == ObservationSpec((), 0, 0, STATE_NAMES, FLAGS)
    assert samples.maps.shape == (48, 1, 0, 0, 1, 1)
    np.testing.assert_array_equal(samples.low_dim[3, -7:], [1, 0, 1, 0, 1, 0, 0])
    assert np.abs(samples.low_dim[:, :-7]).max() < 1e-3


def test_a_pool_without_cameras_gives_its_state(tmp_path):
    pool = make_toy_pool(tmp_path / "pool", [SEQ_1], cameras=())
    samples = load_decisions(pool)
    assert samples.spec.cameras == ()
    assert samples.low_dim.shape == (7, len(STATE_NAMES) + len(SUBTASKS))
    with pytest.raises(ConfigError) as error:
        load_decisions(pool, DemosConfig(observe="pixels"))
    assert str(error.value) == (
        f"'{pool.root}' has no camera; choose observe auto or state instead."
    )
    with pytest.raises(ConfigError, match=r"has no camera 'cup'; choose none\.$"):
        load_decisions(pool, DemosConfig(cameras=("cup",)))


def test_a_state_that_was_not_logged_is_named(human_pool, fake_pool, monkeypatch):
    with pytest.raises(ConfigError) as error:
        load_decisions(human_pool, DemosConfig(observe="state"))
    assert str(error.value) == (
        f"'{human_pool.root}' logs no joint positions; choose observe auto or pixels instead."
    )
    features = {key: spec for key, spec in fake_pool.info["features"].items() if "env" not in key}
    monkeypatch.setattr(type(fake_pool), "info", {"features": features})
    with pytest.raises(ConfigError) as error:
        load_decisions(fake_pool, DemosConfig(observe="state"))
    assert str(error.value) == (
        f"'{fake_pool.root}' logs no environment state; choose observe auto, pixels or "
        "pixels_agent_pos instead."
    )
