"""What a pool's motion is, and what one without a joint log gives."""

import numpy as np
import pytest

from policies.cli import train
from policies.data.motions import load_motions, one_sign, seen_numbers
from teasim.cli.main import main
from teasim.common.errors import ConfigError
from teasim.common.workers import Workers
from teasim.constants import STATE_NAMES
from tests.policies.fakes import FLAGS


def test_every_control_step_of_a_pool(joint_pool):
    samples = load_motions(joint_pool, workers=Workers(2))
    lengths = [7 * steps for steps in (4, 5, 6, 7)]
    np.testing.assert_array_equal(np.bincount(samples.demos), lengths)
    assert samples.spec.state_names == STATE_NAMES == samples.action_names
    assert samples.spec.environment_names == FLAGS
    assert samples.low_dim.shape == (sum(lengths), 16 + 7)
    # The joints go where they are told, so a step's target is what is seen next.
    np.testing.assert_array_equal(samples.targets[:27], samples.low_dim[1:28, :16])


def test_a_rotation_has_one_quaternion():
    names = ("cup_x", "cup_qw", "cup_qx", "cup_qy", "cup_qz", "knob_angle")
    state = np.array([[-1, -0.5, 0.5, -0.5, 0.5, -2], [1, 0.5, -0.5, 0.5, -0.5, 2]])
    turned = one_sign(state, names)
    np.testing.assert_array_equal(turned[0, 1:5], turned[1, 1:5])
    np.testing.assert_array_equal(turned[:, [0, 5]], state[:, [0, 5]])
    assert state[0, 1] == -0.5


def test_an_observation_is_seen_as_the_pool_logs_it(joint_pool):
    samples = load_motions(joint_pool)
    row = samples.low_dim[9]
    observation = {"agent_pos": row[:16], "environment_state": row[16:]}
    np.testing.assert_array_equal(seen_numbers(observation, samples.spec), row)


def test_pictures_are_not_for_the_joint_level(joint_pool):
    with pytest.raises(ConfigError) as error:
        load_motions(joint_pool, "pixels")
    assert str(error.value) == ("The level 'joint' sees no pictures; choose observe auto or state.")


def test_a_target_for_every_joint(joint_pool, monkeypatch):
    action = {"dtype": "float32", "shape": [7], "names": None}
    features = joint_pool.info["features"] | {"action": action}
    monkeypatch.setattr(type(joint_pool), "info", {"features": features})
    with pytest.raises(ConfigError) as error:
        load_motions(joint_pool)
    assert str(error.value) == (
        f"'{joint_pool.root}' logs 7 targets for 16 joints; the level 'joint' needs one for each."
    )


def test_a_pool_without_a_joint_log_is_exit_code_2_and_a_sentence(human_pool, tmp_path, capsys):
    options = ["--learner", "nearest", "--level", "joint", "-o", str(tmp_path / "run")]
    assert main(["train", str(human_pool.root), *options, "--jobs", "1"]) == 2
    said = (
        f"'{human_pool.root}' has no joint log, so there is no motion to learn from it; "
        "choose level subtask instead."
    )
    assert said in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
    with pytest.raises(ConfigError):
        train([str(human_pool.root), *options])
