"""Which thing every shape belongs to, as numbers for segmentation masks."""

import mujoco
import numpy as np

from teasim.world.monitor import roles

SEGMENT_NAMES = (
    "background",
    "right_arm",
    "left_arm",
    "torso",
    "kettle",
    "cup",
    "milk_jug",
    "sugar_pot",
    "tea_bag",
    "spoon",
    "holders",
    "hob",
    "knob",
    "table",
    "floor",
    "distractor",
    "stream",
)
"""Names of the segments; the index is the number in a mask. Sky and walls are background, what is
in a vessel belongs to the vessel, and what was spilled to the stream."""

_PARTS = {
    "right_fingers": "right_arm",
    "left_fingers": "left_arm",
    "tea_bag_holder": "holders",
    "spoon_holder": "holders",
    "spill": "stream",
    "leg": "table",
    "cloth": "table",
    "wall": "background",
    "distractor": "distractor",
}


def segments(model: mujoco.MjModel) -> np.ndarray:
    """Number in `SEGMENT_NAMES` of every shape (ngeom,) int32."""
    return np.array([SEGMENT_NAMES.index(_segment(role)) for role in roles(model)], np.int32)


def _segment(role: str) -> str:
    if role in SEGMENT_NAMES:
        return role
    # What is no thing of the station is the body of whoever makes the tea.
    return _PARTS.get(role, _PARTS.get(role.partition("_")[0], "torso"))
