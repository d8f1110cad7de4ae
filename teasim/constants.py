"""Names, timesteps and limits that several packages need. Units: m, rad, s, kg, ml."""

from importlib.resources import files
from pathlib import Path

from teasim.task.subtasks import ROWS

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
"""The 16 columns of YuMi's joint log: joint angles [rad] of both arms, then openings [m]."""

GRIPPER_OPEN = 0.05
"""Largest distance between the fingers of a gripper [m] (ABB servo gripper)."""
GRIPPER_SQUEEZE = -0.04
"""Opening command that presses with the full 20 N on whatever is between the fingers [m]."""

SUBTASKS = tuple(row.name for row in ROWS)
"""The sub-tasks; the position is the index in pools and environments."""

CAMERAS = ("left", "cup", "front", "top")
"""Cameras of the station."""
QUALITIES = ("fast", "nice")
"""`fast` draws neither shadows nor smooth edges; `nice` draws both."""


def assets_folder() -> Path:
    """Return the folder of the MJCF models: in the installed package, or next to it in a clone."""
    package = Path(str(files("teasim")))
    shipped = package / "assets"
    return shipped if shipped.is_dir() else package.parent / "assets"
