"""Names, timesteps and limits that more than one room needs. Units: m, rad, s, kg, ml."""

from importlib.resources import files
from pathlib import Path

PHYSICS_TIMESTEP = 0.0025
"""Length of one physics step [s]."""
STEPS_PER_UPDATE = 8
"""Physics steps between two updates of the motor targets and the liquids (50 Hz)."""
UPDATES_PER_CONTROL = 5
"""Updates in one control step: control runs at 10 Hz, and one control step is one video frame."""
CONTROL_TIMESTEP = PHYSICS_TIMESTEP * STEPS_PER_UPDATE * UPDATES_PER_CONTROL
"""Length of one control step and of one frame [s]."""
FPS = round(1 / CONTROL_TIMESTEP)
"""Control steps and frames per second."""

ARMS = ("right", "left")
JOINT_NUMBERS = (1, 2, 7, 3, 4, 5, 6)
"""ABB's axis numbers from the base to the flange."""
ARM_JOINTS = {arm: tuple(f"{arm}_joint_{number}" for number in JOINT_NUMBERS) for arm in ARMS}
STATE_NAMES = (*ARM_JOINTS["right"], *ARM_JOINTS["left"], "right_gripper", "left_gripper")
"""The 16 joint-log columns: joint angles [rad] of both arms, then gripper openings [m]."""

GRIPPER_OPEN = 0.05
"""Largest distance between the fingers of a gripper [m] (ABB servo gripper)."""
GRIPPER_SQUEEZE = -0.04
"""Opening command that presses with the full 20 N whatever is between the fingers [m]."""

SUBTASKS = (
    "turn_on_oven",
    "add_water",
    "add_sugar",
    "add_milk",
    "add_tea_bag",
    "stir",
    "turn_off_oven",
)
"""The seven sub-tasks; their position is their index in pools and environments."""

CAMERAS = ("left", "cup", "front", "top")
QUALITIES = ("fast", "nice")


def assets_folder() -> Path:
    """Folder of the MJCF models: inside the installed package, or beside it in a source tree."""
    package = Path(str(files("teasim")))
    shipped = package / "assets"
    return shipped if shipped.is_dir() else package.parent / "assets"
