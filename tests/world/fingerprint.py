"""Run as a program: print check sums of a short episode's states and pictures."""

import hashlib

import numpy as np

from teasim.render import StationRenderer
from teasim.skills.library import perform
from teasim.skills.style import Style
from teasim.world.simulation import Simulation
from teasim.world.station import sample_layout


def fingerprint(seed: int) -> tuple[str, str]:
    """Check sums of all states and of some pictures while the oven is turned on."""
    states, pictures = hashlib.sha256(), hashlib.sha256()
    simulation = Simulation()
    simulation.reset(sample_layout(np.random.default_rng(seed)))
    with StationRenderer(simulation, width=64, height=64) as renderer:
        for step, target in enumerate(perform("turn_on_oven", simulation, Style())):
            simulation.step(target)
            states.update(simulation.data.qpos.tobytes() + simulation.data.qvel.tobytes())
            if step % 10 == 0:
                for frame in renderer.frames(("left", "cup")).values():
                    pictures.update(frame.tobytes())
    return states.hexdigest(), pictures.hexdigest()


if __name__ == "__main__":
    print(*fingerprint(seed=11))
