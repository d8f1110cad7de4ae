"""Render the picture of README.md: YuMi pours the water, in `nice` quality."""

import argparse
from pathlib import Path

import imageio.v3 as iio
import mujoco
import numpy as np

from teasim.render import StationRenderer
from teasim.rollout import run_subtask
from teasim.skills.library import perform
from teasim.skills.style import Style
from teasim.world.simulation import Simulation
from teasim.world.station import nominal_layout

PICTURE = Path(__file__).resolve().parent.parent / "docs" / "images" / "station.png"
WIDTH, HEIGHT = 1200, 720


def pouring() -> Simulation:
    """Return the station while water is poured."""
    simulation = Simulation()
    simulation.reset(nominal_layout())
    for subtask in ("turn_on_oven", "add_tea_bag"):
        run_subtask(simulation, subtask, Style())
    for target in perform("add_water", simulation, Style()):
        simulation.step(target)
        if simulation.liquids.cup["water"] > 40:
            break
    return simulation


def draw(path: Path) -> None:
    """Render the picture and write it to `path`."""
    simulation = pouring()
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (0.24, 0.0, 0.16)
    camera.distance, camera.azimuth, camera.elevation = 1.32, -148, -24
    with StationRenderer(simulation, width=WIDTH, height=HEIGHT, quality="nice") as renderer:
        image: np.ndarray = renderer.picture(camera)
    path.parent.mkdir(parents=True, exist_ok=True)
    iio.imwrite(path, image)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=PICTURE, help="PNG file to write")
    draw(parser.parse_args().output)
