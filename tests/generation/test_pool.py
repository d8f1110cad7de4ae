"""Pools as they come out: small ones, with few sub-tasks, and one with all of them."""

import hashlib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from teasim.common.errors import GenerationError, PoolError, SkillError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.constants import SUBTASKS
from teasim.generation import DemoPlan, GenerateConfig, generate, making, plan_pool, recording
from teasim.generation.recording import ATTEMPTS, generate_demo
from teasim.pool import Pool
from teasim.pool.integrity import check_pool
from teasim.task.mistakes import Plan, PlannedMistake
from teasim.task.subtasks import KNOB_OFF, KNOB_ON
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES

SMALL = GenerateConfig(seq1=0, seq3=2, size=64, cameras=("left", "cup"), seed=3)

# Much is left out, so that it is soon over.
SHORT = (
    DemoPlan(0, "seq_3", Plan(("turn_on_oven",), (PlannedMistake("skip", "add_water", 1),))),
    DemoPlan(1, "seq_3", Plan(("add_tea_bag",), (PlannedMistake("skip", "turn_on_oven", 0),))),
)


@pytest.fixture
def short(monkeypatch):
    """Plans of one sub-task; they reach the workers as arguments."""
    monkeypatch.setattr(making, "plan_pool", lambda _: SHORT)


def digests(root: Path) -> dict[str, str]:
    """Check sum of every file below a folder."""
    return {
        path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(root.rglob("*"))
        if path.is_file()
    }


@pytest.mark.slow
def test_files_do_not_depend_on_workers_nor_on_interruptions(tmp_path, short):
    whole, parallel, resumed = (tmp_path / name for name in ("whole", "parallel", "resumed"))
    made = generate(whole, SMALL, workers=IN_PROCESS)
    assert (len(made.pool.episodes), made.remade) == (2, 0)
    generate(parallel, SMALL, workers=Workers(2))
    assert digests(parallel) == digests(whole)
    generate_demo(resumed, SMALL, SHORT[1])
    left_over = digests(resumed)
    assert left_over
    generate(resumed, SMALL)
    assert digests(resumed) == digests(whole)
    assert check_pool(whole) == []


def test_a_finished_pool_is_not_touched_again(tmp_path, short, monkeypatch):
    monkeypatch.setattr(making, "plan_pool", lambda _: SHORT[:1])
    generate(tmp_path / "pool", SMALL)
    before = digests(tmp_path / "pool")
    with pytest.raises(PoolError, match="already holds a finished pool; choose another folder"):
        generate(tmp_path / "pool", SMALL)
    assert digests(tmp_path / "pool") == before


def test_what_comes_out_wrong_is_made_again_with_other_randomness(tmp_path, monkeypatch):
    monkeypatch.setattr(making, "plan_pool", lambda _: SHORT[:1])
    record, draws = recording._record, []

    def clumsy(writer, config, demo, rng):
        draws.append(rng.bit_generator.state["state"]["state"])
        if len(draws) == 1:
            raise SkillError("The cup fell.")
        return "It was spilled." if len(draws) == 2 else record(writer, config, demo, rng)

    monkeypatch.setattr(recording, "_record", clumsy)
    made = generate(tmp_path / "pool", SMALL)
    assert (made.remade, len(set(draws))) == (2, 3)
    assert len(made.pool.episodes) == 1


def test_what_never_comes_out_right_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "_record", lambda *_: "It was spilled.")
    with pytest.raises(GenerationError) as error:
        generate_demo(tmp_path / "pool", SMALL, SHORT[0])
    assert str(error.value) == (
        f"Demonstration 0 (turn_on_oven) failed {ATTEMPTS} times; the last time: It was spilled."
    )
    assert not list(tmp_path.rglob("*.mp4"))


@pytest.fixture(scope="module")
def pool(tmp_path_factory) -> tuple[Pool, tuple[DemoPlan, ...]]:
    """One correct and one incorrect demonstration, all sub-tasks."""
    config = GenerateConfig(seq1=1, seq3=1, size=64, cameras=("cup",), seed=0)
    return generate(tmp_path_factory.mktemp("pools") / "full", config).pool, plan_pool(config)


@pytest.mark.slow
def test_labels_are_the_plan(pool):
    made, plans = pool
    for episode, demo in zip(made.episodes, plans, strict=True):
        truth = episode.record
        assert (truth.sequence, truth.correct) == (demo.sequence, not demo.plan.mistakes)
        spans = episode.spans()
        assert tuple(span.subtask for span in spans) == demo.plan.steps
        assert (spans[0].start, spans[-1].stop) == (0, episode.length)
        assert all(a.stop == b.start for a, b in pairwise(spans))
        assert all(span.stop - span.start > 30 for span in spans)
        assert {m.subtask for m in truth.mistakes} == set(SUBTASKS) - set(demo.plan.steps)
        for label, planned in zip(truth.mistakes, demo.plan.mistakes, strict=True):
            assert label.start == label.stop == spans[planned.position].start


@pytest.mark.slow
def test_labels_are_what_physics_saw(pool):
    made, _ = pool
    for episode in made.episodes:
        columns = episode.column("observation.environment_state").T
        world = dict(zip(ENVIRONMENT_STATE_NAMES, columns, strict=True))
        for span in episode.spans():
            last = span.stop - 1
            if span.subtask in SIGNS:
                column, reached = SIGNS[span.subtask]
                assert reached(world[column][last]), span
                assert not reached(world[column][span.start]), span
        for label in episode.record.mistakes:
            column, reached = SIGNS[label.subtask]
            assert not reached(world[column][-1]), label


SIGNS = {
    "turn_on_oven": ("knob_angle", lambda angle: angle > KNOB_ON),
    "turn_off_oven": ("knob_angle", lambda angle: angle < KNOB_OFF),
    "add_water": ("cup_water", lambda amount: amount > 90),
    "add_milk": ("cup_milk", lambda amount: amount > 45),
    "add_sugar": ("cup_sugar", lambda amount: amount > 22),
    "stir": ("cup_mixed", lambda share: share > 0.5),
}


@pytest.mark.slow
def test_success_and_reward_are_those_of_the_verdict(pool):
    made, _ = pool
    for episode in made.episodes:
        success, reward = episode.column("next.success"), episode.column("next.reward")
        assert success[-1] == episode.record.correct
        assert not success[0]
        assert reward.sum() == float(episode.record.correct)
        if episode.record.correct:
            assert reward.argmax() == success.argmax()


@pytest.mark.slow
def test_logs_are_what_a_policy_can_be_trained_on(pool):
    made, _ = pool
    assert check_pool(made.root) == []
    for episode in made.episodes:
        state, action = episode.column("observation.state"), episode.column("action")
        assert np.isfinite(state).all()
        # Each action is the target of the coming step, so the next state is near to it.
        arms = slice(0, 14)
        assert np.abs(state[1:, arms] - action[:-1, arms]).max() < 0.03
        for span in episode.spans():
            assert state[span.start, arms] == pytest.approx(state[0, arms], abs=0.01)
