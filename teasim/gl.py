"""Headless OpenGL: selection of the back end with which MuJoCo renders.

EGL is tried first (it uses a graphics card if there is one), then OSMesa (processor only). Both
render identical frames on a machine without a graphics card.

MuJoCo reads the back end from the environment variable MUJOCO_GL when it is imported and has no
other interface for it. `choose_gl` therefore sets this variable, and no other, for this process and
its children. It never replaces a value that the user has set.
"""

import ctypes
import gc
import importlib
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from teasim.common.errors import RenderError

BACKENDS = ("egl", "osmesa")
"""Headless back ends in the order in which they are tried."""
USER_CHOICES = (*BACKENDS, "glfw", "glx")
"""Admissible values of MUJOCO_GL."""

LIBRARIES = {"egl": ("libEGL.so.1", "libOpenGL.so.0"), "osmesa": ("libOSMesa.so.8",)}
"""Shared libraries that each back end needs."""
FIXES = {
    "egl": "apt-get install libegl1 libgl1-mesa-dri libopengl0",
    "osmesa": "apt-get install libosmesa6",
}
"""Command that installs each back end on Debian and Ubuntu."""

# Constants of the EGL registry (EGL_EXT_platform_device).
_EGL_PLATFORM_DEVICE_EXT = 0x313F
_MAX_DEVICES = 32

_PROBE_SECONDS = 120.0  # the first start of a software renderer is slow on a busy machine
_PROBE_SCENE = """
<mujoco>
  <visual><quality shadowsize="0" offsamples="0"/></visual>
  <worldbody>
    <light pos="0 0 3"/>
    <geom type="plane" size="1 1 .1" rgba=".2 .4 .2 1"/>
    <geom type="sphere" size=".3" pos="0 0 .3" rgba=".8 .2 .2 1"/>
    <camera name="probe" pos="0 -2 1" xyaxes="1 0 0 0 .4 .9"/>
  </worldbody>
</mujoco>
"""
_PROBE_PROGRAM = """
import sys, time
import mujoco
model = mujoco.MjModel.from_xml_string(sys.argv[1])
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 224, 224) as renderer:
    for frame in range(21):
        if frame == 1:
            start = time.perf_counter()
        renderer.update_scene(data, camera="probe")
        pixels = renderer.render()
    seconds = time.perf_counter() - start
if pixels.std() < 1:
    sys.exit("the picture came out blank")
print(1000 * seconds / 20)
"""


def choose_gl() -> str:
    """Select a back end that renders without a display and return its name; cheap to repeat.

    MUJOCO_GL is set to the result unless the user has set it. Call this before the first
    `mujoco.Renderer` is made; mujoco may be imported before.

    Raises:
        RenderError: MUJOCO_GL has an inadmissible value, or no back end works.
    """
    wish = os.environ.get("MUJOCO_GL", "").strip().lower()
    if platform.system() != "Linux":  # elsewhere, MuJoCo's default renders off screen
        return wish or "default"
    if wish and wish not in USER_CHOICES:
        raise RenderError(
            f"MUJOCO_GL is '{wish}', which cannot render; unset it or choose "
            f"{', '.join(USER_CHOICES)}."
        )
    if wish in ("glfw", "glx"):
        return wish
    problems = []
    for backend in (wish,) if wish else BACKENDS:
        problem = find_problem(backend)
        if problem is None:
            if not wish:
                _set_backend(backend)
            return backend
        problems.append(f"{backend}: {problem}")
    raise RenderError(
        f"No headless OpenGL back end works ({'; '.join(problems)}); "
        f"run '{FIXES[wish or 'egl']}' and try again."
    )


def find_problem(backend: str) -> str | None:
    """Return why `backend`, one of `BACKENDS`, cannot work, or None; MuJoCo is not imported."""
    for name in LIBRARIES[backend]:
        if _load(name) is None:
            return f"{name} is missing"
    if backend == "egl" and not _egl_device_starts():
        return "libEGL.so.1 finds no device that starts"
    return None


def leave_gl() -> bool:
    """Close the display through which MuJoCo renders, and with it all threads of OpenGL.

    MuJoCo opens it again for the next renderer. It stays open if a context is in use, for example
    one of another library, or if the back end is not EGL, which alone can be left.

    Returns:
        Whether OpenGL does not run in this process any more.
    """
    mujoco_egl: Any = sys.modules.get("mujoco.egl")
    if mujoco_egl is None or mujoco_egl.EGL_DISPLAY is None:
        return False
    kind = mujoco_egl.GLContext
    if any(type(thing) is kind and thing._context for thing in gc.get_objects()):
        return False
    mujoco_egl.EGL.eglReleaseThread()
    mujoco_egl.EGL.eglTerminate(mujoco_egl.EGL_DISPLAY)
    mujoco_egl.EGL_DISPLAY = None
    return True


def _set_backend(backend: str) -> None:
    """Set MUJOCO_GL, the only variable this module writes, and make MuJoCo read it."""
    os.environ["MUJOCO_GL"] = backend
    # MuJoCo reads the variable on import, so a module that is imported already is reloaded.
    for name in ("mujoco.rendering.classic.gl_context", "mujoco.gl_context"):
        if name in sys.modules:
            importlib.reload(sys.modules[name])


def _load(name: str) -> ctypes.CDLL | None:
    try:
        return ctypes.CDLL(name)
    except OSError:
        return None


def _egl_device_starts() -> bool:
    """Whether EGL can initialise a device; without a driver the library alone cannot."""
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    pointer, integer = ctypes.c_void_p, ctypes.c_int

    def function(name: bytes, result: Any, *arguments: Any) -> Callable[..., Any]:
        address = egl.eglGetProcAddress(name)
        if not address:
            return lambda *_: None  # without this extension no device is found
        prototype = ctypes.CFUNCTYPE(result, *arguments)
        return prototype(address)

    query = function(b"eglQueryDevicesEXT", integer, integer, pointer, pointer)
    display_of = function(b"eglGetPlatformDisplayEXT", pointer, integer, pointer, pointer)
    initialize = function(b"eglInitialize", integer, pointer, pointer, pointer)
    devices, found = (pointer * _MAX_DEVICES)(), integer(0)
    query(_MAX_DEVICES, devices, ctypes.byref(found))
    displays = (display_of(_EGL_PLATFORM_DEVICE_EXT, devices[i], None) for i in range(found.value))
    return any(display and initialize(display, None, None) for display in displays)


@dataclass(frozen=True)
class Probe:
    """Result of rendering a small scene with one back end in a child process."""

    backend: str
    """Name as in MUJOCO_GL."""
    ok: bool
    """Whether the picture was rendered and is not blank."""
    ms_per_frame: float | None
    """Duration of a 224x224 frame [ms], or None if nothing was rendered."""
    problem: str | None
    """Why nothing was rendered, or None."""


def probe(backend: str) -> Probe:
    """Render a small scene with `backend` in a child process; this process is not affected."""
    environment = {k: v for k, v in os.environ.items() if k != "PYOPENGL_PLATFORM"}
    environment["MUJOCO_GL"] = backend
    try:
        child = subprocess.run(
            [sys.executable, "-c", _PROBE_PROGRAM, _PROBE_SCENE],
            env=environment,
            capture_output=True,
            text=True,
            timeout=_PROBE_SECONDS,
        )
    except subprocess.TimeoutExpired:
        return Probe(backend, False, None, f"no picture within {_PROBE_SECONDS:.0f} s")
    if child.returncode == 0:
        return Probe(backend, True, round(float(child.stdout), 2), None)
    # The message of a missing library is obscure; `find_problem` gives a plain reason.
    last = (child.stderr.strip().splitlines() or [f"exit code {child.returncode}"])[-1]
    reason = find_problem(backend) if backend in BACKENDS else None
    return Probe(backend, False, None, reason or last)


def first_working() -> Probe:
    """Probe the value of MUJOCO_GL, or without one each back end until one works.

    Raises:
        RenderError: none of them renders.
    """
    wish = os.environ.get("MUJOCO_GL", "").strip().lower()
    probes = []
    for backend in (wish,) if wish else BACKENDS:
        probes.append(probe(backend))
        if probes[-1].ok:
            return probes[-1]
    reasons = "; ".join(f"{p.backend}: {p.problem}" for p in probes)
    raise RenderError(
        f"No headless OpenGL back end renders ({reasons}); "
        f"run '{FIXES.get(wish, FIXES['egl'])}' and try again."
    )
