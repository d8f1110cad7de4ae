"""Pools without video, and pools whose execution is disturbed."""

import subprocess

import numpy as np
import pytest

from teasim.cli.main import main
from teasim.envs.observations import observation_space, observe
from teasim.generation import GenerateConfig, demo_rng, generate, making, recording
from teasim.pool import Pool
from teasim.pool.integrity import check_pool
from teasim.pool.leakage import CLUES, OF_PICTURES, leakage
from teasim.pool.lerobot.identity import halves
from teasim.rollout import demonstrate, replay
from teasim.task.mistakes import Plan
from teasim.world.bodies.embodiments import YUMI
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES, Simulation
from tests.generation.test_pool import SHORT, digests
from tests.pool.conftest import BIN
from tests.toy_pool import SEQ_1, make_toy_pool

LOGS = ("observation.state", "action", "observation.environment_state", "next.reward")
PLAN = Plan(("turn_on_oven",))
SIGMA = 0.005


@pytest.fixture(scope="module")
def pools(tmp_path_factory) -> dict[str, Pool]:
    """One short demonstration, filmed, not filmed, and disturbed."""
    root = tmp_path_factory.mktemp("state_only")
    settings = {
        "filmed": {},
        "logged": {"video": False},
        "disturbed": {"video": False, "execution_noise": SIGMA},
    }
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(making, "plan_pool", lambda _: SHORT[:1])
        made = {}
        for name, given in settings.items():
            if "video" in given:  # OpenGL is not needed
                patch.setattr(making, "choose_gl", None)
                patch.setattr(recording, "StationRenderer", None)
            config = GenerateConfig(0, 0, 1, size=64, seed=3, **given)
            made[name] = generate(root / name, config).pool
    return made


def test_without_video_the_logs_are_those_of_the_filmed_demonstration(pools):
    filmed, logged = (pools[name].episodes[0] for name in ("filmed", "logged"))
    for name in LOGS:
        assert logged.column(name).tobytes() == filmed.column(name).tobytes()
    assert logged.spans() == filmed.spans()
    assert logged.record == filmed.record


@pytest.mark.parametrize("name", ["logged", "disturbed"])
def test_the_log_is_what_the_environment_shows(pools, name):
    """The same numbers in the same order, to the bit."""
    space = observation_space("state", YUMI.state_names, (), (64, 64))
    episode, simulation = pools[name].episodes[0], Simulation()
    noise = SIGMA if name == "disturbed" else 0.0
    logged = [episode.column(column) for column in LOGS[:3]]
    steps = replay(simulation, logged[1], demo_rng(3, 0), execution_noise=noise)
    for number, _ in enumerate(steps):
        seen = observe(space, simulation, None, ())
        assert seen["agent_pos"].tobytes() == logged[0][number].tobytes()
        assert seen["environment_state"].tobytes() == logged[2][number].tobytes()
    assert pools[name].info["features"][LOGS[2]]["names"] == list(ENVIRONMENT_STATE_NAMES)


def test_a_pool_without_video_is_sound_and_has_no_camera(pools, capsys):
    pool = pools["logged"]
    assert check_pool(pool.root) == []
    assert pool.cameras == ()
    assert pool.info["video_path"] is None
    assert not [path for path in digests(pool.root) if path.startswith("videos")]
    assert main(["inspect", str(pool.root)]) == 0
    assert "Cameras:        none\n" in capsys.readouterr().out


def test_weights_of_a_pool_without_video_fit_the_filmed_one(pools):
    one, other = (halves(pools[name].episodes[0].demo_id) for name in ("filmed", "logged"))
    assert set(one) & set(other)
    episode = pools["logged"].episodes[0]
    assert episode.demo_id == episode.content_id()


@pytest.mark.parametrize("command", [("robovet", "doctor"), ("lerobot-doctor", "check")])
def test_foreign_verifiers_pass_a_pool_without_video(pools, command):
    done = subprocess.run(
        [BIN / command[0], command[1], pools["logged"].root],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "FAIL" not in done.stdout


def test_a_pool_without_video_has_no_clue_in_its_pictures(tmp_path):
    short = tuple(name for name in SEQ_1 if name != "stir")
    pool = make_toy_pool(tmp_path / "toy", [SEQ_1, short], cameras=())
    assert set(leakage(pool)) == set(CLUES) - set(OF_PICTURES)


def run(sigma: float, rng: np.random.Generator) -> tuple[list[bytes], list[bytes]]:
    """Targets and measured states of a short demonstration."""
    simulation, targets, states = Simulation(), [], []
    for step in demonstrate(simulation, PLAN, rng, execution_noise=sigma):
        targets.append(step.target.tobytes())
        states.append(simulation.data.qpos.tobytes())
    return targets, states


@pytest.fixture(scope="module")
def clean():
    return run(0.0, demo_rng(4, 0))


@pytest.fixture(scope="module")
def disturbed():
    return run(SIGMA, demo_rng(4, 0))


def replayed(targets: list[bytes], sigma: float) -> list[bytes]:
    simulation = Simulation()
    log = [np.frombuffer(target, np.float32) for target in targets]
    steps = replay(simulation, log, demo_rng(4, 0), execution_noise=sigma)
    return [simulation.data.qpos.tobytes() for _ in steps]


def test_without_noise_not_one_bit_changes(clean):
    targets, states = clean
    assert replayed(targets, 0.0) == states


def test_noise_changes_states_and_leaves_the_planned_targets(clean, disturbed):
    assert disturbed[0] == clean[0]
    assert disturbed[1][0] == clean[1][0]
    assert all(one != other for one, other in zip(disturbed[1][1:], clean[1][1:], strict=True))
    arms = [np.frombuffer(part[-1], np.float64) for part in (clean[1], disturbed[1])]
    assert 0 < np.abs(arms[0] - arms[1]).max() < 20 * SIGMA


def test_a_disturbed_log_gives_the_same_bits_with_the_same_noise(disturbed):
    targets, states = disturbed
    assert replayed(targets, SIGMA) == states
    assert replayed(targets, 0.0)[1:] != states[1:]


def test_a_disturbed_pool_logs_planned_actions_and_other_states(pools):
    one, other = (pools[name].episodes[0] for name in ("logged", "disturbed"))
    assert one.column("action").tobytes() == other.column("action").tobytes()
    assert one.column("observation.state").tobytes() != other.column("observation.state").tobytes()
    assert check_pool(pools["disturbed"].root) == []


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--execution-noise", "-0.1"], "The execution noise is -0.1 rad; choose 0 to 0.01."),
        (["--execution-noise", "0.5"], "The execution noise is 0.5 rad; choose 0 to 0.01."),
        (["--execution-noise", "nan"], "The execution noise is nan rad; choose 0 to 0.01."),
        (
            ["--embodiment", "person", "--no-video"],
            "--no-video needs a joint log, and 'person' has none; choose --embodiment yumi.",
        ),
        (
            ["--embodiment", "person", "--execution-noise", "0.005"],
            "--execution-noise needs a joint log, and 'person' has none; choose --embodiment yumi.",
        ),
    ],
)
def test_what_needs_a_joint_log_is_named(options, sentence, tmp_path, capsys):
    assert main(["generate", str(tmp_path / "pool"), *options]) == 2
    assert capsys.readouterr().err == f"teasim: {sentence}\n"
    assert list(tmp_path.iterdir()) == []


def test_the_help_explains_both(capsys):
    main(["generate", "--help"])
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 80
    text = " ".join(printed.replace("│", " ").split())
    assert "a pool without video holds the joint log alone" in text
    assert "The logged actions stay the planned targets" in text
