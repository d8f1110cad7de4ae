"""Keeps what pictures change in a simulation's model, so that it can be put back."""

from typing import Any

import mujoco
import numpy as np

from teasim.world.looks.dressing import dressed_materials, is_distractor

_SHAPES = ("geom_pos", "geom_size", "geom_rgba", "geom_matid", "geom_group")
_LIGHTS = ("light_active", "light_diffuse", "light_specular", "light_dir", "light_pos")
_CAMERAS = ("cam_pos", "cam_quat", "cam_fovy")
_PLACES = ("body_pos", "body_quat")
_VISUAL = {
    "map": ("zfar", "shadowclip"),
    "quality": ("shadowsize", "offsamples", "numslices"),
    "global_": ("offwidth", "offheight"),
    "headlight": ("ambient", "diffuse"),
}
"""Settings of `MjModel.vis` that a renderer or a look changes, by group."""


class Borrowed:
    """The appearance of a model as it was when this was made.

    It holds what a renderer, a look and the painting of levels change. It does not hold what others
    change in the meantime: the layout of the station and the colours of a person.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        bodies = [k for k in range(model.nbody) if is_distractor(model.body(k).name)]
        rows: dict[str, Any] = dict.fromkeys((*_SHAPES, *_LIGHTS, *_CAMERAS), slice(None))
        rows |= dict.fromkeys(_PLACES, bodies)
        rows["mat_rgba"] = [model.mat(name).id for name in dressed_materials()]
        self._rows = rows
        self._arrays = {name: getattr(model, name)[row].copy() for name, row in rows.items()}
        self._visual = {
            (group, name): np.copy(getattr(getattr(model.vis, group), name))
            for group, names in _VISUAL.items()
            for name in names
        }

    def give_back(self) -> None:
        """Restore the appearance; safe to call twice."""
        for name, row in self._rows.items():
            getattr(self._model, name)[row] = self._arrays[name]
        for (group, name), value in self._visual.items():
            settings = getattr(self._model.vis, group)
            if value.ndim:
                getattr(settings, name)[:] = value
            else:
                setattr(settings, name, value.item())
