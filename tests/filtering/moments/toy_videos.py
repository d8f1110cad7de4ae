"""Synthetic videos: a step is a path in feature space and a square that appears in the cells."""

from collections.abc import Sequence

import numpy as np

from filtering.moments.vectors import Video

FEATURES, HEIGHT, WIDTH = 24, 18, 24
STEPS = 5
LENGTH = 14
"""Mean moments of a step."""


def toy_video(
    order: Sequence[int],
    seed: int,
    *,
    tempo: float = 1.0,
    works: Sequence[bool] | None = None,
    rests: Sequence[int] | None = None,
) -> Video:
    """A video of the steps `order`; a step that does not work leaves no square behind.

    `rests` are the numbers of moments after each step in which nothing happens.
    """
    rng = np.random.default_rng(seed)
    paths = np.random.default_rng(99).normal(0, 1, (STEPS + 1, 2, FEATURES))
    looks, cells = [], []
    image = np.full((HEIGHT, WIDTH, 3), 110.0)
    for place, step in enumerate(order):
        length = round(tempo * (LENGTH + rng.integers(-2, 3)))
        for moment in range(length):
            share = (moment + 0.5) / length
            looks.append(
                np.sin(np.pi * share) * paths[step, 0] + np.sin(2 * np.pi * share) * paths[step, 1]
            )
            if moment == length // 2 and (works is None or works[place]):
                image[4:9, 4 * step : 4 * step + 4] = (40 + 35 * step, 220 - 30 * step, 60)
            cells.append(image + rng.normal(0, 2, image.shape))
        for _ in range(rests[place] if rests else 0):
            looks.append(np.zeros(FEATURES))
            cells.append(image + rng.normal(0, 2, image.shape))
    noise = rng.normal(0, 0.1, (len(looks), FEATURES))
    return Video(
        (np.array(looks) + noise).astype(np.float32), np.clip(cells, 0, 255).astype(np.uint8)
    )


def usual_videos(count: int, **how: float) -> list[Video]:
    """Videos of all steps in order."""
    return [toy_video(range(STEPS), seed, **how) for seed in range(count)]
