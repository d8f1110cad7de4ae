"""Who demonstrates: honest variation of tempo and path that is not a mistake."""

from dataclasses import replace

import numpy as np

from teasim.skills.arm import Style


def sample_style(rng: np.random.Generator) -> Style:
    """Draw the style of one demonstration."""
    return Style(
        tempo=rng.uniform(1.5, 1.9),
        lift=rng.uniform(0.065, 0.085),
        bow=rng.uniform(-0.06, 0.06),
        pause=rng.uniform(0.2, 0.6),
        stir_turns=rng.uniform(2.6, 3.6),
    )


def varied(style: Style, rng: np.random.Generator) -> Style:
    """The style as it comes out in one sub-task: nobody moves at the same tempo throughout."""
    return replace(
        style,
        tempo=style.tempo * rng.uniform(0.94, 1.06),
        pause=style.pause * rng.uniform(0.7, 1.3),
    )
