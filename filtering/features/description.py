"""What describes the segments of a pool, by name: pooled frame features, or learned ones."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from filtering.features.extraction import segment_features
from teasim.common.errors import ConfigError
from teasim.pool import Span
from teasim.pool.source import Source

POOLED = "pooled"
"""Mean and maximum over time of what the pretrained network sees, without anything learned."""


def check_description(name: str) -> None:
    """Raise ConfigError unless `name` is POOLED or a folder."""
    if name != POOLED and not Path(name).is_dir():
        raise ConfigError(
            f"Unknown features '{name}'; choose {POOLED} or the folder of a segmenter that "
            "`teasim segment fit --features` made."
        )


def describe_segments(
    name: str,
    pool: Source,
    segments: Sequence[tuple[Span, ...]],
    *,
    cameras: Sequence[str],
    frames_per_segment: int,
    background: str,
    jobs: int,
) -> Sequence[NDArray[np.floating]]:
    """Return per demonstration (q, F): what each of its segments looks like.

    Cameras, frames and background are those of `segment_features`; learned features keep to what
    they were learned from.

    Raises:
        CheckpointError: the folder `name` holds no learned features, or damaged ones.
        ConfigError: the pool lacks the camera that they were learned from.
        PoolError: a video is missing or damaged.
    """
    if name == POOLED:
        return segment_features(
            pool,
            segments,
            cameras=cameras,
            frames_per_segment=frames_per_segment,
            background=background,
            jobs=jobs,
        )
    # Only here: pooled features that are cached need no torch.
    from filtering.features.checkpoint import load_features

    return load_features(Path(name)).describe(pool, segments, jobs=jobs)
