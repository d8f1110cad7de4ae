"""Pictures of the station, rendered off screen; OpenGL is started lazily, once per process."""

import os
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self

import mujoco
import numpy as np

from teasim.constants import CAMERAS, QUALITIES
from teasim.errors import ConfigError, RenderError
from teasim.gl import choose_gl
from teasim.world.liquids import Stream
from teasim.world.simulation import Simulation

STREAM_RADIUS = 0.003
"""Radius of a stream in the picture [m]."""
SHADOW_MAP = 4096
"""Side of the shadow map in `nice` quality [pixels]."""
LARGEST_SIDE = 4096
"""Largest width and height of a picture [pixels]."""
_PLAIN_FLOOR = (0.50, 0.51, 0.53, 1.0)
_SHOWN_GROUPS = (0, 1, 2)
_processes: set[int] = set()  # that started OpenGL: this one, or one it was forked from


class StationRenderer:
    """Renders one simulation from named cameras.

    `fast` has no shadows and no smoothing; `nice` has both. Use it as a context manager: an
    OpenGL context has to be closed before Python ends.
    """

    def __init__(
        self, simulation: Simulation, *, width: int, height: int, quality: str = "fast"
    ) -> None:
        """Start OpenGL.

        Raises:
            ConfigError: unknown quality, or a side out of range.
            RenderError: no headless back end works, or none can after a fork.
        """
        check_look(width, height, quality)
        check_not_forked()
        choose_gl()
        self._simulation = simulation
        self._model = simulation.model
        self._set_quality(quality)
        buffer = self._model.vis.global_  # a larger one would have to be cleared every time
        buffer.offwidth, buffer.offheight = width, height
        try:
            self._renderer = mujoco.Renderer(self._model, height, width)
        except Exception as error:  # every back end fails in its own way
            raise RenderError(
                f"Rendering could not be started ({error}); run 'teasim doctor' for the cure."
            ) from error
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = quality == "nice"
        self._option = mujoco.MjvOption()
        self._option.geomgroup[:] = [group in _SHOWN_GROUPS for group in range(6)]
        self._option.sitegroup[:] = 0

    def __enter__(self) -> Self:
        """Use the renderer."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the OpenGL context."""
        self.close()

    def close(self) -> None:
        """Close the OpenGL context; safe to call twice."""
        self._renderer.close()

    def frames(self, cameras: Sequence[str]) -> dict[str, np.ndarray]:
        """One (height, width, 3) uint8 RGB picture per camera of the present state."""
        self._simulation.paint()
        return {camera: self._frame(camera) for camera in cameras}

    def picture(self, camera: str | mujoco.MjvCamera) -> np.ndarray:
        """One (height, width, 3) uint8 RGB picture from a named camera or from anywhere."""
        self._simulation.paint()
        return self._frame(camera)

    def _frame(self, camera: str | mujoco.MjvCamera) -> np.ndarray:
        self._renderer.update_scene(self._simulation.data, camera=camera, scene_option=self._option)
        for stream in self._simulation.streams:
            _draw_stream(self._renderer.scene, stream)
        return np.asarray(self._renderer.render())

    def _set_quality(self, quality: str) -> None:
        nice = quality == "nice"
        visual = self._model.vis.quality
        visual.shadowsize = SHADOW_MAP if nice else 0
        visual.offsamples = 4 if nice else 0
        visual.numslices = 32 if nice else 16
        floor = self._model.geom("floor")
        if not nice:
            floor.matid = -1  # its texture is a quarter of the cost of a frame
            floor.rgba = _PLAIN_FLOOR


def check_not_forked() -> None:
    """Refuse what would hang: OpenGL's threads do not survive a fork.

    Raises:
        RenderError: a process that this one was forked from has rendered.
    """
    if _processes and os.getpid() not in _processes:
        raise RenderError(
            "This process was forked from one that has rendered, which OpenGL does not survive; "
            "start it with multiprocessing's 'spawn' (vector_kwargs={'context': 'spawn'})."
        )
    _processes.add(os.getpid())


def check_cameras(cameras: Sequence[str]) -> tuple[str, ...]:
    """Return `cameras` as a tuple.

    Raises:
        ConfigError: none is given, one is unknown, or one is given twice.
    """
    for camera in cameras:
        if camera not in CAMERAS:
            raise ConfigError(f"Unknown camera '{camera}'; choose {', '.join(CAMERAS)}.")
    if not cameras or len(set(cameras)) != len(cameras):
        raise ConfigError(f"Name each camera once, at least one of {', '.join(CAMERAS)}.")
    return tuple(cameras)


def check_look(width: int, height: int, quality: str) -> None:
    """Check what a renderer is asked for without starting OpenGL.

    Raises:
        ConfigError: unknown quality, or a side out of range.
    """
    if quality not in QUALITIES:
        raise ConfigError(f"Unknown quality '{quality}'; choose {', '.join(QUALITIES)}.")
    for name, side in (("width", width), ("height", height)):
        if not 1 <= side <= LARGEST_SIDE:
            raise ConfigError(f"The {name} is {side} pixels; choose from 1 to {LARGEST_SIDE}.")


def _draw_stream(scene: Any, stream: Stream) -> None:
    if scene.ngeom >= scene.maxgeom:
        return
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(
        geom,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        np.zeros(3),
        np.zeros(3),
        np.eye(3).flatten(),
        np.array(stream.rgba, dtype=np.float32),
    )
    mujoco.mjv_connector(
        geom, mujoco.mjtGeom.mjGEOM_CAPSULE, STREAM_RADIUS, stream.start, stream.end
    )
    scene.ngeom += 1
