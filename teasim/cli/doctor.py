"""The verb `doctor`: whether this machine renders and makes videos, how fast, and what to fix."""

import json
import os
import platform
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
import tyro

from teasim.common.cli import parse
from teasim.common.workers import default_jobs
from teasim.gl import BACKENDS, FIXES, Probe, probe
from teasim.pool.clips import VideoClip, VideoWriter, probe_codecs

PACKAGES = (
    "teasim",
    "mujoco",
    "gymnasium",
    "numpy",
    "scipy",
    "torch",
    "opencv-python-headless",
    "imageio-ffmpeg",
    "av",
    "pyarrow",
    "mink",
)

"""Packages whose versions decide whether a result can be repeated."""

EXAMPLES = ("teasim doctor", "teasim doctor --json > machine.json")

_SIDE = 224  # pixels, as in a pool
_FRAMES = 50
_FPS = 10
_LARGEST_MEAN_ERROR = 8.0  # grey levels of 255; crf 20 stays far below on a smooth picture


@dataclass(frozen=True)
class DoctorSettings:
    """Check that this machine renders and makes videos; print how to fix it."""

    json: tyro.conf.FlagCreatePairsOff[bool] = False
    """Print one JSON object instead of text."""


@dataclass(frozen=True)
class VideoProbe:
    """Result of writing a short h264 video and reading it back."""

    ok: bool
    """Whether all frames were read back and look the same."""
    ms_per_frame: float | None
    """Wall milliseconds per 224x224 frame, encoding and decoding, or None on failure."""
    problem: str | None
    """What went wrong in a few words, or None."""


@dataclass(frozen=True)
class Report:
    """All findings about this machine."""

    ok: bool
    """Whether rendering and video both work."""
    python: str
    """Version of the interpreter."""
    system: str
    """Operating system and processor type."""
    cpus: int
    """Cores this process may use."""
    gl: str | None
    """The back end that is used, or None where none renders."""
    rendering: tuple[Probe, ...]
    """One entry per back end."""
    video: VideoProbe
    """Result of the check of h264 videos."""
    codecs: dict[str, str | None]
    """Per codec what keeps its videos from being read; None where all is well."""
    packages: dict[str, str | None]
    """Version of each package in `PACKAGES`; None where it is missing."""
    fixes: tuple[str, ...]
    """Commands that install what is missing; empty when `ok`."""


def main(arguments: Sequence[str]) -> int:
    """Check that this machine renders and makes videos; print how to fix it."""
    settings = parse(DoctorSettings, arguments, verb="doctor", examples=EXAMPLES)
    report = examine()
    print(json.dumps(asdict(report), indent=2) if settings.json else _text(report))
    return 0 if report.ok else 1


def examine() -> Report:
    """Render with every back end, write and read a video, and collect the versions."""
    wish = os.environ.get("MUJOCO_GL", "").strip().lower()
    names = BACKENDS if wish in ("", *BACKENDS) else (wish, *BACKENDS)
    rendering = tuple(probe(name) for name in names)
    working = [p.backend for p in rendering if p.ok and wish in ("", p.backend)]
    video, codecs = probe_video(), probe_codecs()
    packages = {name: _version(name) for name in PACKAGES}
    return Report(
        ok=bool(working) and video.ok and not any(codecs.values()),
        python=platform.python_version(),
        system=f"{platform.system()} {platform.machine()}",
        cpus=default_jobs(),
        gl=working[0] if working else None,
        rendering=rendering,
        video=video,
        codecs=codecs,
        packages=packages,
        fixes=_fixes(wish, bool(working), video.ok and not any(codecs.values())),
    )


def probe_video() -> VideoProbe:
    """Encode a moving gradient as h264 with imageio-ffmpeg and decode it with PyAV."""
    frames = _gradient()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "probe.mp4"
        try:
            import av  # noqa: F401  (imported here to keep it out of the measured time)
            import imageio_ffmpeg  # noqa: F401

            start = time.perf_counter()
            _encode(path, frames)
            decoded = _decode(path)
        except Exception as error:  # any failure of a codec or its binary is the finding
            return VideoProbe(False, None, f"{type(error).__name__}: {error}")
        seconds = time.perf_counter() - start
    if decoded.shape != frames.shape:
        return VideoProbe(False, None, f"{len(decoded)} of {len(frames)} frames were read back")
    change = float(np.abs(decoded.astype(np.int16) - frames).mean())
    if change > _LARGEST_MEAN_ERROR:
        return VideoProbe(False, None, f"the picture changed by {change:.0f} of 255 grey levels")
    return VideoProbe(True, round(1000 * seconds / len(frames), 2), None)


def _gradient() -> np.ndarray:
    """Smooth moving RGB images, (frames, 224, 224, 3) uint8."""
    row, column = np.mgrid[0:_SIDE, 0:_SIDE]
    shift = 2 * np.arange(_FRAMES)[:, None, None]
    red = (row + shift) % 256 * 0.5
    blue = np.broadcast_to(column * 0.5, red.shape)
    return np.stack([red, np.full_like(red, 90.0), blue], axis=-1).astype(np.uint8)


def _encode(path: Path, frames: np.ndarray) -> None:
    writer = VideoWriter(path, height=_SIDE, width=_SIDE, fps=_FPS)
    for frame in frames:
        writer.add(frame)
    writer.close()


def _decode(path: Path) -> np.ndarray:
    clip = VideoClip.whole(path)
    return clip.frames(np.arange(clip.length))


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _fixes(wish: str, renders: bool, makes_videos: bool) -> tuple[str, ...]:
    fixes = []
    if not renders and wish not in ("", *BACKENDS):
        fixes.append("unset MUJOCO_GL")
    elif not renders:
        fixes.append(FIXES[wish or "egl"])
    if not makes_videos:
        fixes.append("pip install --force-reinstall imageio-ffmpeg av")
    return tuple(fixes)


def _text(report: Report) -> str:
    lines = [f"Python {report.python}, {report.system}, {report.cpus} cores", "", "rendering"]
    for result in report.rendering:
        used = "  (in use)" if result.backend == report.gl else ""
        outcome = f"{result.ms_per_frame} ms per 224x224 frame" if result.ok else result.problem
        lines.append(f"  {_mark(result.ok)}  {result.backend:<7} {outcome}{used}")
    video = report.video
    outcome = (
        f"{video.ms_per_frame} ms per 224x224 frame, written and read"
        if video.ok
        else video.problem
    )
    lines += ["video", f"  {_mark(video.ok)}  {'h264':<7} {outcome}", "reading"]
    for codec, problem in report.codecs.items():
        lines.append(f"  {_mark(problem is None)}  {codec:<7} {problem or 'is read exactly'}")
    lines.append("packages")
    lines += [f"  {name:<24} {found or 'missing'}" for name, found in report.packages.items()]
    lines += ["", *(f"To fix it, run: {fix}" for fix in report.fixes)]
    if report.ok:
        lines.append("Rendering and video work.")
    return "\n".join(lines)


def _mark(ok: bool) -> str:
    return "ok" if ok else "--"
