"""The verb doctor: what it finds, what it advises, and the form of its JSON."""

import json
from dataclasses import replace

import av
import pytest

from teasim.cli import doctor
from teasim.gl import Probe
from teasim.pool.clips.codecs import ENCODERS, probe_codecs

WORKS = Probe("egl", True, 2.5, None)
FAILS = Probe("osmesa", False, None, "libOSMesa.so.8 is missing")
GOOD_VIDEO = doctor.VideoProbe(True, 1.0, None)
BAD_VIDEO = doctor.VideoProbe(False, None, "OSError: no ffmpeg")


@pytest.fixture
def machine(monkeypatch):
    """A machine of our making: set which back ends render and whether videos work."""

    def build(*, renders=("egl",), video=GOOD_VIDEO, codecs=None, wish=None):
        def probe(backend):
            works = backend in renders
            return replace(WORKS if works else FAILS, backend=backend)

        monkeypatch.setattr(doctor, "probe", probe)
        monkeypatch.setattr(doctor, "probe_video", lambda: video)
        monkeypatch.setattr(doctor, "probe_codecs", lambda: codecs or {"h264": None, "av1": None})
        if wish is None:
            monkeypatch.delenv("MUJOCO_GL", raising=False)
        else:
            monkeypatch.setenv("MUJOCO_GL", wish)

    return build


def test_json_names_types_and_code_when_all_is_well(machine, capsys):
    machine()
    assert doctor.main(["--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    kinds = {key: type(value).__name__ for key, value in report.items()}
    assert kinds == {
        "ok": "bool",
        "python": "str",
        "system": "str",
        "cpus": "int",
        "gl": "str",
        "rendering": "list",
        "video": "dict",
        "codecs": "dict",
        "packages": "dict",
        "fixes": "list",
    }
    assert [list(probe) for probe in report["rendering"]] == [
        ["backend", "ok", "ms_per_frame", "problem"]
    ] * 2
    assert list(report["video"]) == ["ok", "ms_per_frame", "problem"]
    assert report["packages"]["mujoco"]
    assert report["fixes"] == []


@pytest.mark.parametrize(
    ("renders", "wish", "used", "fixes"),
    [
        (("egl", "osmesa"), None, "egl", []),
        (("osmesa",), None, "osmesa", []),
        (("egl", "osmesa"), "osmesa", "osmesa", []),
        ((), None, None, ["apt-get install libegl1 libgl1-mesa-dri libopengl0"]),
        (("egl",), "osmesa", None, ["apt-get install libosmesa6"]),
        (("egl",), "off", None, ["unset MUJOCO_GL"]),
    ],
)
def test_the_back_end_in_use_and_the_fix(machine, capsys, renders, wish, used, fixes):
    machine(renders=renders, wish=wish)
    assert doctor.main(["--json"]) == (0 if used else 1)
    report = json.loads(capsys.readouterr().out)
    assert (report["gl"], report["fixes"]) == (used, fixes)


def test_without_video_the_code_is_1_and_the_text_ends_with_the_fix(machine, capsys):
    machine(video=BAD_VIDEO)
    assert doctor.main([]) == 1
    out = capsys.readouterr().out
    assert "--  h264    OSError: no ffmpeg" in out
    assert out.splitlines()[-1].startswith("To fix it, run: pip install ")


def test_a_codec_that_is_not_read_is_told_with_the_fix(machine, capsys):
    machine(codecs={"h264": None, "av1": "PyAV was built without its decoder"})
    assert doctor.main([]) == 1
    out = capsys.readouterr().out
    assert "ok  h264    is read exactly" in out
    assert "--  av1     PyAV was built without its decoder" in out
    assert out.splitlines()[-1] == (
        "To fix it, run: pip install --force-reinstall imageio-ffmpeg av"
    )


def test_every_codec_is_read_on_this_machine(capfd):
    assert probe_codecs() == dict.fromkeys(("h264", "hevc", "av1", "vp9", "mpeg4"))
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("codec", ["h264", "av1"])
def test_a_codec_without_decoder_or_encoder_is_found(monkeypatch, codec):
    encoder, _ = ENCODERS[codec]
    monkeypatch.setattr("av.codecs_available", av.codecs_available - {codec})
    assert probe_codecs()[codec] == "PyAV was built without its decoder"
    monkeypatch.undo()
    monkeypatch.setattr("av.codecs_available", av.codecs_available - {encoder})
    assert codec not in probe_codecs()


def test_the_text_of_a_healthy_machine(machine, capsys):
    machine()
    assert doctor.main([]) == 0
    out = capsys.readouterr().out
    assert "ok  egl     2.5 ms per 224x224 frame  (in use)" in out
    assert "--  osmesa  libOSMesa.so.8 is missing" in out
    assert out.splitlines()[-1] == "Rendering and video work."


def test_video_really_goes_there_and_back():
    result = doctor.probe_video()
    assert result.ok, result.problem
    assert 0 < result.ms_per_frame < 1000


def test_a_codec_that_loses_frames_is_found(monkeypatch):
    decode = doctor._decode
    monkeypatch.setattr(doctor, "_decode", lambda path: decode(path)[:-1])
    result = doctor.probe_video()
    assert (result.ok, result.problem) == (False, "49 of 50 frames were read back")


def test_a_codec_that_swaps_colours_is_found(monkeypatch):
    decode = doctor._decode
    monkeypatch.setattr(doctor, "_decode", lambda path: decode(path)[..., ::-1])
    result = doctor.probe_video()
    assert not result.ok
    assert "grey levels" in result.problem


def test_an_encoder_that_throws_is_found(monkeypatch):
    def refuse(path, frames):
        raise OSError("no ffmpeg")

    monkeypatch.setattr(doctor, "_encode", refuse)
    assert doctor.probe_video().problem == "OSError: no ffmpeg"
