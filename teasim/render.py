"""Off-screen renderer of the station: pictures, segmentation masks and depth maps."""

import os
import weakref
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self

import mujoco
import numpy as np

from teasim.common.errors import RenderError
from teasim.gl import choose_gl, leave_gl
from teasim.world.liquids import VESSELS, Stream
from teasim.world.looks.borrowing import Borrowed
from teasim.world.looks.dressing import apply_look
from teasim.world.looks.look import Look
from teasim.world.pictures import check_picture
from teasim.world.segments import SEGMENT_NAMES, segments
from teasim.world.simulation import Simulation

STREAM_RADIUS = 0.003
"""Radius of a stream in the picture [m]."""
SHADOW_MAP = 2048
"""Side of the shadow map in `nice` quality [pixels]; 4096 takes three times as long."""
SHADOWED = 1.45
"""Radius of the shadowed region around the point the lamp aims at, in extents of the model."""
SMOOTHING = 2
"""Factor by which `nice` pictures are rendered larger, then averaged."""
FAR = 30.0
"""Distance of the far clipping plane in `nice` quality, in extents of the model."""
_TEXTURED = {"ground": "ground", "table": "table_grain"}
_PLAIN = {"ground": "ground_plain", "table": "table"}
_SHOWN_GROUPS = (0, 1, 2)
_GEOM, _DECORATION = int(mujoco.mjtObj.mjOBJ_GEOM), int(mujoco.mjtObj.mjOBJ_UNKNOWN)
_STREAM = SEGMENT_NAMES.index("stream")
_processes: set[int] = set()  # in which OpenGL runs: this one, or one it was forked from
_renderers: "weakref.WeakSet[StationRenderer]" = weakref.WeakSet()  # that are open


class StationRenderer:
    """Renders one simulation from named cameras.

    Quality `fast` has no shadows and no smoothing; `nice` has both. Use it as a context manager: an
    OpenGL context has to be closed before Python exits. While it is open, it changes the appearance
    of the simulation's model but nothing that physics depends on; `close` restores the appearance.
    """

    def __init__(
        self,
        simulation: Simulation,
        *,
        width: int,
        height: int,
        quality: str = "fast",
        look: Look | None = None,
    ) -> None:
        """Start OpenGL and apply a look.

        Args:
            simulation: The station to render.
            width: Width of the pictures [pixels].
            height: Height of the pictures [pixels].
            quality: `fast` or `nice`.
            look: Look to apply; None keeps the present one.

        Raises:
            ConfigError: unknown quality, or a side out of range.
            RenderError: no headless back end works, or this process was forked from one that has
                rendered.
        """
        check_picture(width, height, quality)
        _check_not_forked()
        choose_gl()
        self._simulation = simulation
        self._model = simulation.model
        self._borrowed = Borrowed(self._model)
        if look is not None:
            self.wear(look)
        self._quality, self._size = quality, (height, width)
        self._set_quality()
        self._renderer: mujoco.Renderer | None = None
        self._meter: mujoco.Renderer | None = None
        self._closed = False
        self._drawing()
        _renderers.add(self)
        self._segments = segments(self._model)
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
        """Close the OpenGL context and restore the model; safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._borrowed.give_back()
        self.pause()

    def pause(self) -> None:
        """Close OpenGL until the next picture; what is drawn does not change."""
        for renderer in (self._renderer, self._meter):
            if renderer is not None:
                renderer.close()
        self._renderer = self._meter = None

    def wear(self, look: Look) -> None:
        """Apply another look to the station."""
        apply_look(self._model, look, self._simulation.data)

    def frames(self, cameras: Sequence[str]) -> dict[str, np.ndarray]:
        """Return a picture (height, width, 3) uint8 RGB of the present state by camera."""
        self._simulation.paint()
        return {camera: self._frame(camera) for camera in cameras}

    def picture(self, camera: str | mujoco.MjvCamera) -> np.ndarray:
        """Return a picture (height, width, 3) uint8 RGB from a named or a free camera."""
        self._simulation.paint()
        return self._frame(camera)

    def masks(self, cameras: Sequence[str]) -> dict[str, np.ndarray]:
        """Return a mask (height, width) int32 by camera: indices into `SEGMENT_NAMES`."""
        self._simulation.paint()
        meter = self._measuring()
        meter.enable_segmentation_rendering()
        try:
            return {camera: self._mask(meter, camera) for camera in cameras}
        finally:
            meter.disable_segmentation_rendering()

    def depths(self, cameras: Sequence[str]) -> dict[str, np.ndarray]:
        """Return a depth map (height, width) float32 [m] by camera.

        Depth is the distance along the camera's axis; that of the sky is the far clipping plane.
        """
        self._simulation.paint()
        meter = self._measuring()
        meter.enable_depth_rendering()
        try:
            return {camera: self._draw(meter, camera) for camera in cameras}
        finally:
            meter.disable_depth_rendering()

    def _frame(self, camera: str | mujoco.MjvCamera) -> np.ndarray:
        picture = self._draw(self._drawing(), camera)
        height, width = self._size
        if picture.shape[0] == height:
            return picture
        blocks = picture.reshape(height, SMOOTHING, width, SMOOTHING, 3)
        return np.asarray(np.rint(blocks.mean(axis=(1, 3))), np.uint8)

    def _mask(self, meter: mujoco.Renderer, camera: str) -> np.ndarray:
        shape, kind = np.moveaxis(self._draw(meter, camera), -1, 0)
        mask = np.zeros(shape.shape, np.int32)
        seen = kind == _GEOM
        mask[seen] = self._segments[shape[seen]]
        mask[kind == _DECORATION] = _STREAM
        return mask

    def _draw(self, renderer: mujoco.Renderer, camera: str | mujoco.MjvCamera) -> np.ndarray:
        renderer.update_scene(self._simulation.data, camera=camera, scene_option=self._option)
        for stream in self._simulation.streams:
            _draw_stream(renderer.scene, stream)
        return np.asarray(renderer.render())

    def _drawing(self) -> mujoco.Renderer:
        """Return the renderer of pictures, started if it does not run."""
        if self._renderer is None:
            self._renderer = self._start(SMOOTHING if self._quality == "nice" else 1)
        return self._renderer

    def _measuring(self) -> mujoco.Renderer:
        """Return a renderer without smoothing, which would average segment numbers at edges."""
        if self._quality == "fast":
            return self._drawing()
        if self._meter is None:
            self._meter = self._start(1)
        return self._meter

    def _start(self, scale: int) -> mujoco.Renderer:
        _check_not_forked()
        height, width = (scale * side for side in self._size)
        buffer = self._model.vis.global_  # as small as possible: it is cleared for each picture
        buffer.offwidth, buffer.offheight = width, height
        try:
            most = self._model.ngeom + len(VESSELS)  # every vessel may pour
            renderer = mujoco.Renderer(self._model, height, width, max_geom=most)
        except Exception as error:  # every back end fails in its own way
            raise RenderError(
                f"Rendering could not be started ({error}); run 'teasim doctor' to find out why."
            ) from error
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = scale > 1
        return renderer

    def _set_quality(self) -> None:
        nice = self._quality == "nice"
        model = self._model
        model.vis.quality.shadowsize = SHADOW_MAP if nice else 0
        model.vis.quality.offsamples = 0
        model.vis.quality.numslices = 32 if nice else 16
        model.light_active[model.light("fill").id] = nice
        if nice:
            model.vis.map.zfar, model.vis.map.shadowclip = FAR, SHADOWED
        # The texture of the ground alone is a quarter of the cost of a picture.
        surfaces = _TEXTURED if nice else _PLAIN
        for geom, material in surfaces.items():
            model.geom(geom).matid = model.mat(material).id


def _check_not_forked() -> None:
    """Refuse to render after a fork that OpenGL did not survive; rendering would hang.

    Raises:
        RenderError: this process was forked from one in which OpenGL ran and could not be left.
    """
    if _processes and os.getpid() not in _processes:
        raise RenderError(
            "This process was forked from one in which OpenGL was in use, and rendering would "
            "hang; start it with multiprocessing's 'spawn' (vector_kwargs={'context': 'spawn'})."
        )
    _processes.add(os.getpid())


def _before_fork() -> None:
    """Leave OpenGL, whose threads a fork would lose; both processes start it again when needed."""
    if os.getpid() not in _processes:
        return
    for renderer in list(_renderers):
        renderer.pause()
    if leave_gl():
        _processes.clear()


if hasattr(os, "register_at_fork"):  # not on Windows, which does not fork
    os.register_at_fork(before=_before_fork)


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
    geom.segid, geom.objtype, geom.objid = scene.ngeom, _DECORATION, -1
    scene.ngeom += 1
