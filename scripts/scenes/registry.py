"""The scenes. Some of them are kept back: no choice is made by what a filter does on them."""

from scenes import bench, conveyor, hands, panel, pour, squares, stack, tabletop
from scenes.held_back import lunch, mending, service
from scenes.looked_at import assembly, drawers, garden, lab, parcel, salad, supper
from scenes.scene import Scene

TUNED_ON: tuple[Scene, ...] = (
    *(squares.SCENE, tabletop.SCENE, hands.SCENE, conveyor.SCENE),
    *(panel.SCENE, stack.SCENE, pour.SCENE, bench.SCENE),
    *(salad.SCENE, drawers.SCENE, assembly.SCENE, lab.SCENE),
    *(garden.SCENE, parcel.SCENE, supper.SCENE),
)
"""Scenes by which constants are chosen, together with tea-making."""
HELD_BACK: tuple[Scene, ...] = (lunch.SCENE, mending.SCENE, service.SCENE)
"""Scenes looked at only when everything is chosen."""
SCENES = {scene.name: scene for scene in (*TUNED_ON, *HELD_BACK)}
"""All scenes by name."""
