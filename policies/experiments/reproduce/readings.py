"""What a segmenter reads in the videos of a bank, as evidence about any pool drawn from it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from filtering.effects.rests import changes, look_at_rests
from filtering.effects.surprise import effect_surprises
from filtering.features.extraction import segment_features
from filtering.features.reduction import reduce_features
from filtering.judging.evidence import Evidence
from filtering.segmentation.segmenter import segmenter_named
from filtering.segmentation.segments import Segmentation
from filtering.vision.frame_features import FrameSource
from teasim.common.arrays import Array
from teasim.common.workers import IN_PROCESS
from teasim.pool import Pool


@dataclass(frozen=True)
class Reading:
    """What is seen of the D demonstrations of a pool; no label of correctness is in it."""

    found: Segmentation
    """Their segments."""
    changes: Sequence[Array]
    """Per demonstration (q, F) change of the picture in each segment."""
    features: Sequence[Array]
    """Per demonstration (q, F) features of each segment."""

    def evidence(self, places: Sequence[int]) -> Evidence:
        """Return the evidence about the pool of the demonstrations at `places`."""
        found, reliability = self.found, self.found.reliability()
        known = Evidence(found.subtasks, tuple(found.spans[place] for place in places))
        return Evidence(
            subtasks=known.subtasks,
            segments=known.segments,
            states=reduce_features([self.features[place] for place in places]),
            ineffective=effect_surprises([self.changes[place] for place in places], known.labels),
            reliability=reliability and [reliability[place] for place in places],
            told=found.told,
        )


def read(pool: Pool, segmenter: str, frames: int) -> Reading:
    """Segment all demonstrations of `pool` from its videos and describe the segments.

    Args:
        pool: the demonstrations.
        segmenter: as in `teasim filter`.
        frames: largest number of frames per segment for its features.
    """
    return describe(pool, segmenter_named(segmenter)(pool, workers=IN_PROCESS), frames)


def describe(pool: Pool, found: Segmentation, frames: int) -> Reading:
    """Describe the segments that were found in `pool`; see `read`."""
    source = FrameSource(pool.cameras)
    rests = look_at_rests(pool.episodes, found.spans, pool.fps, source, workers=IN_PROCESS)
    features = segment_features(
        pool,
        found.spans,
        cameras=pool.cameras,
        frames_per_segment=frames,
        background="none",
        workers=IN_PROCESS,
    )
    states = [rows.astype(np.float64) for rows in features]
    return Reading(found, [changes(rest) for rest in rests], states)


@lru_cache(maxsize=2)
def read_bank(bank: Path, network: Path, frames: int) -> Reading:
    """Return `read` of a whole bank by a fitted segmenter, once per process: neither changes."""
    return read(Pool.open(bank), str(network), frames)
