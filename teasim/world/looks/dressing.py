"""Write a look into a compiled station; a later look replaces it without a new compilation."""

from functools import cache

import mujoco
import numpy as np

from teasim.world.looks.look import CameraShift, Colour, Distractor, Light, Look, Tint
from teasim.world.station import station_model

_SHOWN, _HIDDEN = 2, 5  # groups of shapes; see assets/tea_station/looks.xml
_UP = np.array([0.0, 0.0, 1.0])
_SURFACES = ("table", "table_grain", "ground", "ground_plain", "wall", "cloth", "stripe")


@cache
def _original() -> mujoco.MjModel:
    """Return the station as compiled, the base of every look."""
    return station_model()


def apply_look(model: mujoco.MjModel, look: Look, data: mujoco.MjData | None = None) -> None:
    """Write `look` into `model` in place of its present look; states and contacts do not change.

    With `data`, a picture can be taken at once; otherwise only after the next reset or step.
    """
    _light(model, look.light)
    _surfaces(model, look)
    _cloth(model, look.cloth.pattern if look.cloth else "")
    _tints(model, look.tints)
    for camera in range(_original().ncam):
        _camera(model, CameraShift(_original().camera(camera).name))
    for shift in look.cameras:
        _camera(model, shift)
    _distractors(model, look.distractors)
    if data is not None:
        _bring_up_to_date(model, data)


@cache
def dressed_materials() -> tuple[str, ...]:
    """Return the names of the materials whose colours a look decides."""
    materials = (_original().mat(k).name for k in range(_original().nmat))
    return (*_SURFACES, *(name for name in materials if "/" in name))


def is_distractor(body: str) -> bool:
    """Whether the body of this name is a distractor."""
    return body.startswith("distractor_")


def _light(model: mujoco.MjModel, light: Light) -> None:
    before, lamp = _original().light("lamp"), model.light("lamp")
    shine = light.brightness * np.array(light.colour)
    lamp.diffuse, lamp.specular = before.diffuse * shine, before.specular * shine
    for part in ("ambient", "diffuse"):
        getattr(model.vis.headlight, part)[:] = (
            getattr(_original().vis.headlight, part) * light.ambient
        )
    aim = before.pos - before.dir * before.pos[2] / before.dir[2]  # where it meets the table
    rotation = _product(_about(_UP, light.turn), _about(np.cross(-_UP, before.dir), light.lean))
    lamp.dir = _rotated(before.dir, rotation)
    lamp.pos = aim + _rotated(before.pos - aim, rotation)


def _surfaces(model: mujoco.MjModel, look: Look) -> None:
    cloth = look.cloth
    coloured = {
        "table": look.table,
        "table_grain": look.table,
        "ground_plain": look.ground,
        "wall": look.wall,
        "cloth": cloth.colour if cloth else None,
        "stripe": cloth.stripe if cloth else None,
    }
    for name, colour in coloured.items():
        before = _original().mat(name).rgba
        model.mat(name).rgba = before if colour is None else (*colour, 1)
    tiles, plain = _original().mat("ground").rgba, _original().mat("ground_plain").rgba
    model.mat("ground").rgba = tiles * model.mat("ground_plain").rgba / plain
    for wall in ("wall_back", "wall_right"):
        _show(model, model.geom(wall).id, look.wall is not None)


def _cloth(model: mujoco.MjModel, pattern: str) -> None:
    shown = {
        "cloth": bool(pattern),
        "cloth_row": pattern in ("stripes", "check"),
        "cloth_column": pattern == "check",
    }
    for geom in range(model.ngeom):
        part = model.geom(geom).name.rstrip("0123456789").rstrip("_")
        if part in shown:
            _show(model, geom, shown[part])


def _tints(model: mujoco.MjModel, tints: tuple[Tint, ...]) -> None:
    factors: dict[str, Colour] = {tint.name: tint.factor for tint in tints}
    for material in range(_original().nmat):
        before = _original().mat(material)
        thing, slash, _ = before.name.partition("/")
        if slash:
            rgb = np.clip(before.rgba[:3] * factors.get(thing, (1, 1, 1)), 0, 1)
            model.mat(before.name).rgba[:3] = rgb


def _camera(model: mujoco.MjModel, shift: CameraShift) -> None:
    before, camera = _original().camera(shift.camera), model.camera(shift.camera)
    angle = float(np.linalg.norm(shift.turn))
    camera.pos = before.pos + shift.offset
    camera.quat = _product(before.quat, _about(np.array(shift.turn), angle))
    camera.fovy = before.fovy * shift.zoom


def _distractors(model: mujoco.MjModel, things: tuple[Distractor, ...]) -> None:
    wanted = {f"distractor_{thing.name}": thing for thing in things}
    for geom in range(model.ngeom):
        body = model.body(model.geom_bodyid[geom]).name
        if not is_distractor(body):
            continue
        _show(model, geom, body in wanted)
        name = model.geom(geom).name
        if name.endswith("_tint"):
            before = _original().geom(name).rgba
            colour = wanted[body].colour if body in wanted else None
            model.geom_rgba[geom] = before if colour is None else (*colour, 1)
    for body, thing in wanted.items():
        model.body(body).pos = (thing.x, thing.y, 0)
        model.body(body).quat = _about(_UP, thing.yaw)


def _bring_up_to_date(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Update the poses of cameras, lamp and distractors without changing what physics reads."""
    still = mujoco.MjData(model)
    mujoco.mj_kinematics(model, still)
    mujoco.mj_camlight(model, still)
    data.cam_xpos[:], data.cam_xmat[:] = still.cam_xpos, still.cam_xmat
    data.light_xpos[:], data.light_xdir[:] = still.light_xpos, still.light_xdir
    for geom in range(model.ngeom):
        if is_distractor(model.body(model.geom_bodyid[geom]).name):
            data.geom_xpos[geom], data.geom_xmat[geom] = (
                still.geom_xpos[geom],
                still.geom_xmat[geom],
            )


def _show(model: mujoco.MjModel, geom: int, shown: bool) -> None:
    model.geom_group[geom] = _SHOWN if shown else _HIDDEN


def _about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the quaternion (4,), wxyz, of a turn by `angle` [rad]; the identity for no turn."""
    length = float(np.linalg.norm(axis))
    if not angle or not length:
        return np.array([1.0, 0.0, 0.0, 0.0])
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis / length)])


def _product(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    result = np.zeros(4)
    mujoco.mju_mulQuat(result, one, other)
    return result


def _rotated(vector: np.ndarray, quaternion: np.ndarray) -> np.ndarray:
    result = np.zeros(3)
    mujoco.mju_rotVecQuat(result, vector, quaternion)
    return result
