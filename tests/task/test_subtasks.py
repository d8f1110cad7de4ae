"""A sub-task is one row: an eighth one works everywhere once its row and its skill are written."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from teasim.common.errors import ConfigError
from teasim.constants import ARMS, SUBTASKS
from teasim.skills.library import SKILLS
from teasim.task.recipes import CRITICAL, OPTIONAL, POURED, SEQ_1, SEQ_2
from teasim.task.subtasks import REGISTRY, ROWS, Subtask, Turned, find_subtask
from teasim.world.bodies.embodiments import EMBODIMENTS
from teasim.world.events import WATCHERS
from teasim.world.segments import SEGMENT_NAMES, segments
from teasim.world.station import station_model

ROOT = Path(__file__).parents[2]

SKILL = '''
"""Waving with the left hand: a turn of the wrist and back."""

from teasim.skills.arm import Arm, Motion
from teasim.skills.geometry import DOWN, about, pose, position, rotation
from teasim.task.mistakes import WELL, Manner


def wave(arm: Arm, manner: Manner) -> Motion:
    """Turn the wrist by a radian and go back to READY."""
    start = arm.tcp
    turn = 1.0 if manner == WELL else 0.1
    yield from arm.line(pose(position(start), about(DOWN, turn) @ rotation(start)))
    yield from arm.park()
'''
ROW = """
    Subtask(
        "wave",
        event=Turned("left_joint_6", reached=radians(130), set_back=radians(110)),
        waits_for=("turn_on_oven",),
        seq_1=15,
        seq_2=15,
        arm="left",
        skill="wave:wave",
        segment="left_arm",
        seconds={"yumi": 3.0, "person": 3.0},
    ),
"""
PROGRAM = """
import sys
from pathlib import Path
import gymnasium
from teasim.generation import DemoPlan, GenerateConfig, generate, making, plan_pool
from teasim.constants import SUBTASKS
from teasim.skills.demonstrators import PARTICIPANTS
from teasim.task.mistakes import Plan
from teasim.task.recipes import SEQ_1
from teasim.task.scoring import judge

assert SUBTASKS[7:] == ("wave",) and SEQ_1.index("wave") == 1, SEQ_1
config = GenerateConfig(seq1=2, size=32, cameras=("cup",), mistakes=(("skip@wave", 1),))
assert sorted("wave" in demo.plan.steps for demo in plan_pool(config)) == [False, True, True]
assert all("wave" in order for one in PARTICIPANTS.values() for order in one.orders)
assert judge(SEQ_1, oven_on=False, spilled={}).success
assert not judge([n for n in SEQ_1 if n != "wave"], oven_on=False, spilled={}).success
making.plan_pool = lambda _: (DemoPlan(0, "seq_1", Plan(("turn_on_oven", "wave"))),)
pool = generate(Path(sys.argv[1]), config).pool
assert pool.subtasks == SUBTASKS
assert [span.subtask for span in pool.episodes[0].spans()] == ["turn_on_oven", "wave"]
with gymnasium.make("teasim:teasim/TeaMakingSubtasks-v0") as env:
    assert env.action_space.n == 8
    assert env.metadata["violations"]["wave_before_turn_on_oven"] == "wave before turn_on_oven"
    env.reset(seed=0)
    info = env.step(7)[-1]
    assert info["subtasks_done"] == ("wave",), info
    assert info["violations"] == ("wave_before_turn_on_oven",)
    assert info["correct_action"] == 0
"""


def test_an_eighth_sub_task_is_one_row_and_one_skill(tmp_path):
    shutil.copytree(ROOT / "teasim", tmp_path / "teasim", ignore=shutil.ignore_patterns("*.pyc"))
    (tmp_path / "assets").symlink_to(ROOT / "assets")
    (tmp_path / "teasim/skills/wave.py").write_text(SKILL)
    rows = tmp_path / "teasim/task/subtasks.py"
    lines = rows.read_text().splitlines()
    (end,) = (
        node.end_lineno
        for node in ast.parse(rows.read_text()).body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "ROWS"
    )
    rows.write_text("\n".join([*lines[: end - 1], ROW, *lines[end - 1 :]]))
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(tmp_path / "pool")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


def test_names_and_their_order_are_those_of_existing_pools():
    assert SUBTASKS == (
        "turn_on_oven",
        "add_water",
        "add_sugar",
        "add_milk",
        "add_tea_bag",
        "stir",
        "turn_off_oven",
    )
    oven, bag, rest = "turn_on_oven", "add_tea_bag", ("turn_off_oven", "add_water", "stir")
    assert (oven, bag, "add_sugar", "add_milk", *rest) == SEQ_1
    assert (oven, "add_sugar", "add_milk", bag, *rest) == SEQ_2
    assert CRITICAL == ("add_tea_bag", "turn_off_oven", "add_water")
    assert POURED == ("add_water", "add_sugar", "add_milk")
    assert OPTIONAL == ("add_sugar", "add_milk")


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_every_row_names_what_exists(row):
    assert set(row.waits_for) <= set(SUBTASKS) - {row.name}
    assert row.arm in ARMS
    assert set(row.seconds) == set(EMBODIMENTS)
    assert type(row.event) in WATCHERS
    assert callable(SKILLS[row.name].motion)
    assert SEGMENT_NAMES.index(row.segment) in segments(station_model())
    assert not (row.misses and row.content is None)


@pytest.mark.parametrize("column", ["name", "seq_1", "seq_2"])
def test_no_two_rows_share(column):
    values = [getattr(row, column) for row in ROWS]
    assert len(set(values)) == len(values) == len(REGISTRY)


def test_an_unknown_sub_task_is_named_with_the_choices():
    with pytest.raises(ConfigError) as error:
        find_subtask("sing")
    assert str(error.value) == f"Unknown sub-task 'sing'; choose {', '.join(SUBTASKS)}."


def test_a_row_cannot_be_changed():
    row = Subtask(
        "wave", Turned("knob", 1, 0), (), 1, 1, arm="left", skill="", segment="", seconds={}
    )
    with pytest.raises(TypeError):
        row.seconds["yumi"] = 1.0
