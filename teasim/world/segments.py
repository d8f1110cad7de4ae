"""Which thing every shape belongs to, as numbers for segmentation masks."""

import mujoco
import numpy as np

from teasim.task.subtasks import ROWS
from teasim.world.monitor import roles

_STATION = (
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
    "ground",
    "distractor",
    "stream",
)

SEGMENT_NAMES = tuple(dict.fromkeys((*_STATION, *(row.segment for row in ROWS))))
"""Names of the segments; the index is the number in a mask. Sky and walls are background, the
content of a vessel belongs to the vessel, and what was spilled to the stream."""

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
    """Return the number in `SEGMENT_NAMES` of every shape (ngeom,) int32."""
    return np.array([SEGMENT_NAMES.index(_segment(role)) for role in roles(model)], np.int32)


def _segment(role: str) -> str:
    if role in SEGMENT_NAMES:
        return role
    # Everything else belongs to the body of the demonstrator.
    return _PARTS.get(role, _PARTS.get(role.partition("_")[0], "torso"))
