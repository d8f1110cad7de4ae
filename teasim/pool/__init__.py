"""A pool of demonstrations on disk: reading, writing, checking, and the weights beside it."""

from teasim.pool.clips import VideoClip
from teasim.pool.lerobot import (
    Episode,
    EpisodeWriter,
    Pool,
    claim_folder,
    episode_is_done,
    finalize_pool,
)
from teasim.pool.types import (
    EpisodeRecord,
    GroundTruth,
    MistakeSpan,
    PoolHeader,
    Span,
)

__all__ = [
    "Episode",
    "EpisodeRecord",
    "EpisodeWriter",
    "GroundTruth",
    "MistakeSpan",
    "Pool",
    "PoolHeader",
    "Span",
    "VideoClip",
    "claim_folder",
    "episode_is_done",
    "finalize_pool",
]
