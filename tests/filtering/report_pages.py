"""Pages of any size for tests: many demonstrations that share a few small videos."""

from pathlib import Path

import cv2
import numpy as np

from filtering.report import DemoView, Mark, Segment, render_report
from filtering.report.page import ExcerptView, ExhibitView, Truth
from filtering.report.videos import FOLDER, write_still
from teasim.pool.clips import VideoWriter

STEPS = ("turn_on", "add_tea", "add_sugar", "add_milk", "turn_off", "add_water", "stir")
SECONDS = 14.0
CAMERAS = ("left", "cup")
GROUPS = ("kept", "out of order", "steps left out")


def write_page(folder: Path, count: int) -> Path:
    """Write the page of `count` demonstrations, every fifth of them flagged, and its videos."""
    videos = folder / FOLDER
    videos.mkdir(parents=True)
    for number, camera in enumerate(CAMERAS):
        _write_film(videos / f"demo_000000_{number}.mp4", camera)
    path = folder / "report.html"
    demos = [view(index) for index in range(count)]
    render_report(path, demos=demos, threshold=0.5, subtasks=STEPS)
    return path


def view(index: int) -> DemoView:
    """The view of one demonstration."""
    flagged = index % 5 == 4
    number = (1 + index % 3 % 2) if flagged else 0
    steps = [step for step in STEPS if not (flagged and step == "add_water")]
    parts = tuple(Segment(step, 2.0 * k, 2.0 * k + 1.9) for k, step in enumerate(steps))
    weight = round(0.02 * (index % 7), 3) if flagged else 1 - round(0.01 * (index % 9), 3)
    films = {name: f"{FOLDER}/demo_000000_{k}.mp4" for k, name in enumerate(CAMERAS)}
    stills = {name: f"{FOLDER}/demo_000000_{k}_0.jpg" for k, name in enumerate(CAMERAS)}
    return DemoView(
        episode_index=index,
        demo_id=f"demo-{index:04d}-of-a-test",
        name=f"Video {index}",
        weight=weight,
        loss=1 / 3 + index,
        p_incorrect=1 - weight,
        flagged=flagged,
        group=GROUPS[number],
        group_number=number,
        reason="After turn_off (8.0-9.9 s) 'add_water' was expected, \"never\" seen." * flagged,
        seconds=SECONDS,
        segments=parts,
        marks=(Mark(10.0, "add_water is missing"),) if flagged else (),
        videos=films if flagged else {"left": films["left"]},
        stills=stills if flagged else {"left": stills["left"]},
        exhibits=(_exhibit(index, stills),) if flagged else (),
        truth=Truth(correct=not flagged, mistakes="skip of add_water at 10.0 s" * flagged),
        labels=parts,
    )


def _exhibit(index: int, stills: dict[str, str]) -> ExhibitView:
    once = {camera: (still,) for camera, still in stills.items()}
    twice = {camera: (still, still) for camera, still in stills.items()}
    own = ExcerptView(index, "Here, expected at 10.0 s", 4.0, 5.0, once)
    return ExhibitView("add_water is missing", (own, ExcerptView(0, "Video 0, 8-9 s", 8, 9, twice)))


def _write_film(path: Path, text: str) -> None:
    """Write a video of a moving number, and its picture."""
    writer = VideoWriter(path, height=64, width=64, fps=10, quality=35)
    for number in range(int(SECONDS * 10)):
        frame = np.full((64, 64, 3), 90, dtype=np.uint8)
        cv2.putText(frame, f"{text} {number}", (2, 36), cv2.FONT_HERSHEY_PLAIN, 0.8, (255,) * 3)
        writer.add(frame)
        if number == 0:
            write_still(path.with_name(path.stem + "_0.jpg"), frame)
    writer.close()
