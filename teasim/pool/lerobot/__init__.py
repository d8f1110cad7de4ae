"""The native form of a pool: a LeRobotDataset directory, v3.0 or read from an older one."""

from teasim.pool.lerobot.episode import Episode
from teasim.pool.lerobot.reader import Pool
from teasim.pool.lerobot.writing.finalize import finalize_pool
from teasim.pool.lerobot.writing.staging import claim_folder, episode_is_done
from teasim.pool.lerobot.writing.writer import EpisodeWriter

__all__ = [
    "Episode",
    "EpisodeWriter",
    "Pool",
    "claim_folder",
    "episode_is_done",
    "finalize_pool",
]
