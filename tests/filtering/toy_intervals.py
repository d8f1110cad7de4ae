"""Clips whose classes differ only in how the intervals of two channels lie to each other."""

from dataclasses import dataclass

import numpy as np

from filtering.features.config import TrainingConfig

TRAINING = TrainingConfig(epochs=10, batch=16, learning_rate=2e-2)
"""Enough to learn the classes with a hidden width of 32."""
TRAIN_CLIPS = 320
"""Clips to learn from; with few of them a network finds chance patterns in the distractors."""
TEST_CLIPS = 100
"""Clips to be scored on."""
FRAMES = 64
"""Length of a clip [activation frames]."""
CHANNELS = 6
"""The two that tell classes apart, then the distractors."""
TELLING = (0, 1)
"""The channels that tell classes apart."""
LENGTHS = (10, 20, 8, 12, 9, 15)
"""Length of the one interval of each channel, in every clip [activation frames]."""
PLACES = (-5, 5, 15, 25)
"""Per class when channel 0 begins, counted from where channel 1 does [activation frames]:
it overlaps channel 1, lies inside it, is overlapped by it, comes after it."""


@dataclass(frozen=True)
class ToyClips:
    """Activations of clips, and their classes."""

    activations: list[np.ndarray]
    """One array (FRAMES, CHANNELS) per clip."""
    labels: list[int]
    """Class of each clip."""


def toy_clips(clips: int, seed: int) -> ToyClips:
    """Return `clips` clips, the classes in turn."""
    rng = np.random.default_rng(seed)
    labels = [number % len(PLACES) for number in range(clips)]
    return ToyClips([_clip(rng, label) for label in labels], labels)


def _clip(rng: np.random.Generator, label: int) -> np.ndarray:
    starts = np.array([rng.integers(FRAMES - length) for length in LENGTHS])
    # Channel 1 lies so that channel 0 fits into the clip in every class alike.
    starts[1] = rng.integers(6, FRAMES - 36)
    starts[0] = starts[1] + PLACES[label]
    activations = rng.normal(0.0, 0.02, (FRAMES, CHANNELS))
    for channel, (start, length) in enumerate(zip(starts, LENGTHS, strict=True)):
        activations[start : start + length, channel] += rng.uniform(0.8, 1.2)
    return activations
