"""The choice of the OpenGL back end: lazy, never over the user's choice, and with a way out."""

import os
import platform
import subprocess
import sys

import pytest

from teasim import gl
from teasim.common.errors import RenderError

pytestmark = pytest.mark.skipif(
    platform.system() != "Linux", reason="elsewhere MuJoCo renders without our help"
)


@pytest.fixture
def libraries(monkeypatch):
    """A machine on which only the given libraries load, and EGL's devices start or do not."""

    def build(*present, wish=None, device_starts=True):
        monkeypatch.setattr(gl, "_load", lambda name: object() if name in present else None)
        monkeypatch.setattr(gl, "_egl_device_starts", lambda: device_starts)
        if wish is None:
            # Set first, so that what the code under test writes is taken back afterwards.
            monkeypatch.setenv("MUJOCO_GL", "")
            monkeypatch.delenv("MUJOCO_GL")
        else:
            monkeypatch.setenv("MUJOCO_GL", wish)

    return build


EGL = gl.LIBRARIES["egl"]
OSMESA = gl.LIBRARIES["osmesa"]


@pytest.mark.parametrize(
    ("present", "wish", "device_starts", "chosen"),
    [
        ((*EGL, *OSMESA), None, True, "egl"),
        ((*EGL, *OSMESA), "", True, "egl"),
        (OSMESA, None, True, "osmesa"),
        (("libEGL.so.1", *OSMESA), None, True, "osmesa"),
        ((*EGL, *OSMESA), None, False, "osmesa"),
        ((*EGL, *OSMESA), "osmesa", True, "osmesa"),
        ((), "glfw", True, "glfw"),
    ],
)
def test_the_choice(libraries, monkeypatch, present, wish, device_starts, chosen):
    monkeypatch.setattr(gl.importlib, "reload", lambda module: module)
    libraries(*present, wish=wish, device_starts=device_starts)
    assert gl.choose_gl() == chosen
    assert os.environ["MUJOCO_GL"] == chosen
    assert gl.choose_gl() == chosen


@pytest.mark.parametrize(
    ("present", "wish", "sentence"),
    [
        (
            (),
            None,
            "No headless OpenGL back end works (egl: libEGL.so.1 is missing; "
            "osmesa: libOSMesa.so.8 is missing); run "
            "'apt-get install libegl1 libgl1-mesa-dri libopengl0' and try again.",
        ),
        (
            EGL,
            "osmesa",
            "No headless OpenGL back end works (osmesa: libOSMesa.so.8 is missing); "
            "run 'apt-get install libosmesa6' and try again.",
        ),
        (
            EGL,
            "off",
            "MUJOCO_GL is 'off', which cannot render; unset it or choose egl, osmesa, glfw, glx.",
        ),
    ],
)
def test_no_way_to_render_is_one_sentence_with_the_command(libraries, present, wish, sentence):
    libraries(*present, wish=wish)
    with pytest.raises(RenderError) as caught:
        gl.choose_gl()
    assert str(caught.value) == sentence
    assert os.environ.get("MUJOCO_GL") == wish, "a failed choice must not change the environment"


@pytest.mark.parametrize("first", ["import mujoco", "pass"])
def test_rendering_works_whether_mujoco_was_imported_before_or_not(first):
    program = f"""
{first}
from teasim import gl
import sys
backend = gl.choose_gl()
import mujoco
model = mujoco.MjModel.from_xml_string(gl._PROBE_SCENE)
with mujoco.Renderer(model, 32, 32) as renderer:
    renderer.update_scene(mujoco.MjData(model))
    renderer.render()
print(backend)
"""
    environment = {
        k: v for k, v in os.environ.items() if k not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")
    }
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() in gl.BACKENDS


def test_the_choice_does_not_import_mujoco():
    program = (
        "import sys; from teasim import gl; gl.choose_gl(); assert 'mujoco' not in sys.modules"
    )
    assert subprocess.run([sys.executable, "-c", program]).returncode == 0


def test_a_probe_renders_in_another_process():
    result = gl.probe(gl.first_working().backend)
    assert result.ok, result.problem
    assert result.ms_per_frame > 0


@pytest.mark.parametrize(
    ("missing", "problem"),
    [(None, "the picture came out blank"), ("libX.so is missing", "libX.so is missing")],
)
def test_a_failed_probe_gives_the_plain_reason_first(monkeypatch, missing, problem):
    monkeypatch.setattr(gl, "_PROBE_PROGRAM", "import sys; sys.exit('the picture came out blank')")
    monkeypatch.setattr(gl, "find_problem", lambda _: missing)
    assert gl.probe("egl") == gl.Probe("egl", False, None, problem)


def test_a_back_end_that_hangs_is_given_up(monkeypatch):
    monkeypatch.setattr(gl, "_PROBE_PROGRAM", "import time; time.sleep(60)")
    monkeypatch.setattr(gl, "_PROBE_SECONDS", 0.2)
    assert gl.probe("egl").problem == "no picture within 0 s"


def test_a_name_mujoco_does_not_know_is_no_back_end():
    result = gl.probe("no-such-back-end")
    assert not result.ok
    assert "MUJOCO_GL" in result.problem


def test_first_working_respects_the_users_choice(monkeypatch):
    asked = []

    def probe(backend):
        asked.append(backend)
        return gl.Probe(backend, False, None, "broken")

    monkeypatch.setattr(gl, "probe", probe)
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    with pytest.raises(RenderError, match=r"osmesa: broken.*libosmesa6"):
        gl.first_working()
    monkeypatch.delenv("MUJOCO_GL")
    with pytest.raises(RenderError, match=r"egl: broken; osmesa: broken.*libegl1"):
        gl.first_working()
    assert asked == ["osmesa", "egl", "osmesa"]
