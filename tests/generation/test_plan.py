"""What a pool will hold, before anything moves."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.common.errors import ConfigError
from teasim.constants import FPS, STATE_NAMES, SUBTASKS
from teasim.generation import DemoPlan, GenerateConfig, plan_pool
from teasim.generation.config import parse_mistakes
from teasim.generation.recording import mismatch, pool_header
from teasim.task.mistakes import MISTAKES, Plan, PlannedMistake
from teasim.task.recipes import CRITICAL, SEQ_1, SEQ_2, is_legal
from teasim.world.events import Event
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES, Simulation

COUNTS = st.integers(0, 6)
MIXED = GenerateConfig(seq1=10, seq2=5, seq3=7, mistakes=(("skip", 3),))


@given(seq1=COUNTS, seq2=COUNTS, seq3=COUNTS, skips=COUNTS, seed=st.integers(0, 99))
def test_a_pool_holds_what_was_asked_for(seq1, seq2, seq3, skips, seed):
    if seq1 + seq2 + seq3 + skips == 0:
        return
    plans = plan_pool(GenerateConfig(seq1, seq2, seq3, mistakes=(("skip", skips),), seed=seed))
    assert [plan.index for plan in plans] == list(range(len(plans)))
    kinds = Counter(plan.sequence for plan in plans)
    assert (kinds["seq_1"], kinds["seq_2"], kinds["seq_3"]) == (seq1, seq2, seq3 + skips)
    for plan in plans:
        check(plan)
    omitted = Counter(len(plan.plan.mistakes) for plan in plans)
    assert omitted[2] == seq3 // 2  # one omission and two take turns
    assert omitted[1] == seq3 - seq3 // 2 + skips


def check(plan: DemoPlan) -> None:
    """A demonstration's plan is what its sequence says."""
    if plan.sequence != "seq_3":
        assert plan.plan == Plan({"seq_1": SEQ_1, "seq_2": SEQ_2}[plan.sequence])
        return
    missing = {label.subtask for label in plan.plan.mistakes}
    assert missing == set(SEQ_1) - set(plan.plan.steps)
    assert missing <= set(CRITICAL)
    assert len(missing) in (1, 2)
    assert plan.plan.steps == tuple(step for step in SEQ_1 if step not in missing)
    assert not is_legal(plan.plan.steps)


def test_a_seed_gives_one_plan():
    assert plan_pool(MIXED) == plan_pool(MIXED)
    assert plan_pool(MIXED) != plan_pool(GenerateConfig(10, 5, 7, mistakes=(("skip", 3),), seed=1))


def test_random_orders_are_legal_and_correct():
    plans = plan_pool(GenerateConfig(seq1=0, legal=30))
    assert {demo.sequence for demo in plans} == {"legal"}
    assert all(is_legal(demo.plan.steps) and not demo.plan.mistakes for demo in plans)
    assert len({demo.plan.steps for demo in plans}) > 10


def test_optional_ingredients_are_left_out_by_half_and_that_is_no_mistake():
    config = GenerateConfig(seq1=40, seq3=20, optional=("add_sugar",))
    plans = plan_pool(config)
    without = [demo for demo in plans if "add_sugar" not in demo.plan.steps]
    assert 15 < len(without) < 45
    for demo in plans:
        assert "add_milk" in demo.plan.steps
        assert "add_sugar" not in {label.subtask for label in demo.plan.mistakes}


@pytest.mark.parametrize("name", MISTAKES)
def test_every_mistake_can_be_asked_for(name):
    plans = plan_pool(GenerateConfig(seq1=0, mistakes=((name, 2), (f"{name}@add_milk", 1))))
    labels = [label for demo in plans for label in demo.plan.mistakes]
    assert [label.name for label in labels] == [name] * 3
    assert "add_milk" in {label.subtask for label in labels}
    assert {demo.sequence for demo in plans} == {"seq_3"}


def test_sequences_are_mixed_in_the_pool():
    for seed in range(5):
        kinds = [plan.sequence for plan in plan_pool(GenerateConfig(10, 0, 10, seed=seed))]
        assert kinds != sorted(kinds)
        assert kinds != sorted(kinds, reverse=True)


def test_the_header_tells_how_the_pool_was_made():
    header = pool_header(MIXED)
    assert (header.fps, header.cameras, header.subtasks) == (FPS, ("left", "cup"), SUBTASKS)
    assert (header.height, header.width) == (224, 224)
    assert header.state_names == STATE_NAMES
    assert header.environment_state_names == ENVIRONMENT_STATE_NAMES
    assert header.config["seq3"] == 7


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"seq1": -1}, "--seq1 is -1; give 0 or more demonstrations."),
        ({"seq3": -2}, "--seq3 is -2; give 0 or more demonstrations."),
        ({"mistakes": (("skip", -1),)}, "skip is -1; give 0 or more demonstrations."),
        ({"seq1": 0}, "The pool would be empty; ask for demonstrations with --seq1 N."),
        (
            {"mistakes": (("sneeze", 1),)},
            f"Unknown mistake 'sneeze'; choose {', '.join(MISTAKES)}.",
        ),
        ({"cameras": ("back",)}, "Unknown camera 'back'; choose left, cup, front, top."),
        ({"cameras": ()}, "Name each camera once, at least one of left, cup, front, top."),
        ({"size": 63}, "The size is 63; choose an even number from 32 to 1024."),
        ({"size": 16}, "The size is 16; choose an even number from 32 to 1024."),
        ({"size": 2048}, "The size is 2048; choose an even number from 32 to 1024."),
        ({"quality": "great"}, "Unknown quality 'great'; choose fast, nice."),
        ({"legal": -1}, "--legal is -1; give 0 or more demonstrations."),
        (
            {"optional": ("add_water",)},
            "'add_water' is not optional; choose add_sugar, add_milk.",
        ),
        ({"seed": -1}, "The seed is -1; choose 0 or more."),
    ],
)
def test_a_bad_setting_is_named_with_the_choices(settings, sentence):
    with pytest.raises(ConfigError) as error:
        GenerateConfig(**settings)
    assert str(error.value) == sentence


def test_mistakes_are_read_as_names_with_counts():
    assert parse_mistakes(()) == ()
    assert parse_mistakes(("skip", "swap:3")) == (("skip", 1), ("swap", 3))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ("skip:two",),
            "'skip:two' is no mistake with a count; write NAME[@SUBTASK][+NAME...][:COUNT].",
        ),
        (
            ("skip:-1",),
            "'skip:-1' is no mistake with a count; write NAME[@SUBTASK][+NAME...][:COUNT].",
        ),
        (
            ("skip:²",),
            "'skip:²' is no mistake with a count; write NAME[@SUBTASK][+NAME...][:COUNT].",
        ),
        (("skip", "skip:2"), "The mistake 'skip' is given twice; write it once as NAME:COUNT."),
    ],
)
def test_what_cannot_be_read_as_a_mistake_is_named(words, sentence):
    with pytest.raises(ConfigError) as error:
        parse_mistakes(words)
    assert str(error.value) == sentence


WITHOUT_OFF = Plan(
    tuple(step for step in SEQ_1 if step != "turn_off_oven"),
    (PlannedMistake("skip", "turn_off_oven", 4),),
)
BESIDE = Plan(SEQ_1, (PlannedMistake("ineffective", "add_sugar", 2),))
WITHOUT_SUGAR = tuple(step for step in SEQ_1 if step != "add_sugar")


@pytest.mark.parametrize(
    ("plan", "done", "oven_on", "spilled", "reason"),
    [
        (Plan(SEQ_1), SEQ_1, False, 0.0, ""),
        (WITHOUT_OFF, WITHOUT_OFF.steps, True, 0.0, ""),
        (
            Plan(SEQ_1),
            SEQ_1[:-1],
            False,
            0.0,
            "Physics saw another order than planned (missing: stir; extra: none).",
        ),
        (
            Plan(SEQ_1),
            (*SEQ_1, "stir"),
            False,
            0.0,
            "Physics saw another order than planned (missing: none; extra: stir).",
        ),
        (
            Plan(SEQ_1),
            SEQ_2,
            False,
            0.0,
            "Physics saw another order than planned (missing: none; extra: none).",
        ),
        (Plan(SEQ_1), SEQ_1, False, 9.0, "Something went beside the cup (spilled_milk)."),
        (
            BESIDE,
            WITHOUT_SUGAR,
            False,
            0.0,
            "Something was to go beside the cup and did not (spilled_sugar).",
        ),
        (
            BESIDE,
            SEQ_1,
            False,
            9.0,
            "Physics saw another order than planned (missing: none; extra: add_sugar).",
        ),
        (
            Plan(SEQ_1),
            SEQ_1,
            True,
            0.0,
            "The oven is not as the knob was turned.",
        ),
    ],
)
def test_a_label_has_to_be_what_physics_saw(plan, done, oven_on, spilled, reason):
    simulation = Simulation()
    simulation.recogniser.events = [Event(name, k) for k, name in enumerate(done)]
    simulation.recogniser.oven_on = oven_on
    simulation.liquids.spilled["milk"] = spilled
    assert mismatch(DemoPlan(0, "", plan), simulation) == reason
