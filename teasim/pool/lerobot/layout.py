"""Names and places in a LeRobotDataset; ours have a data file and an mp4 per demonstration."""

from pathlib import Path
from typing import Any

from teasim.pool.types import PoolHeader

CODEBASE_VERSION = "v3.0"
CHUNK_SIZE = 1000
"""Demonstrations per folder, LeRobot's default `chunks_size`."""

INFO = Path("meta/info.json")
STATS = Path("meta/stats.json")
TASKS = Path("meta/tasks.parquet")
SUBTASKS = Path("meta/subtasks.parquet")
TEMPORAL_PROPORTIONS = Path("meta/temporal_proportions_sparse.json")
EPISODES_FOLDER = Path("meta/episodes")
EPISODES = EPISODES_FOLDER / "chunk-000/file-000.parquet"
EPISODES_LINES = Path("meta/episodes.jsonl")
TASKS_LINES = Path("meta/tasks.jsonl")
MANIFEST = Path("teasim/manifest.json")
STAGING = Path(".incomplete")

DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO_PATH = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"

CAMERA_PREFIX = "observation.images."
OBSERVATION_PREFIX = "observation."
STATE = "observation.state"
ACTION = "action"
ENVIRONMENT_STATE = "observation.environment_state"
SUBTASK_INDEX = "subtask_index"
LANGUAGE = "language_persistent"
"""What is said about the parts of a demonstration, since LeRobot 0.6."""
SCALARS = (
    *("timestamp", "frame_index", "episode_index", "index", "task_index", SUBTASK_INDEX),
    *("next.reward", "next.done", "next.success", "next.truncated"),
)
"""Columns with one value per frame; some writers store each as a list of one."""

NO_SUBTASK_NAME = "none"
"""Last row of `subtasks.parquet`: readers that index it by position find it under -1."""


def place_of(index: int) -> tuple[int, int]:
    """Chunk and file index of demonstration `index`."""
    return divmod(index, CHUNK_SIZE)


def data_path(index: int) -> str:
    """Path of the data file of demonstration `index`, relative to the pool."""
    chunk, file = place_of(index)
    return DATA_PATH.format(chunk_index=chunk, file_index=file)


def video_path(camera: str, index: int) -> str:
    """Path of the mp4 of demonstration `index` by `camera`, relative to the pool."""
    chunk, file = place_of(index)
    return VIDEO_PATH.format(video_key=CAMERA_PREFIX + camera, chunk_index=chunk, file_index=file)


def features_of(header: PoolHeader) -> dict[str, dict[str, Any]]:
    """The `features` of info.json: logs that were not made are absent, not zero."""
    features: dict[str, dict[str, Any]] = {}
    if header.state_names is not None:
        features[STATE] = vector(header.state_names)
        features[ACTION] = vector(header.state_names)
    if header.environment_state_names is not None:
        features[ENVIRONMENT_STATE] = vector(header.environment_state_names)
    for camera in header.cameras:
        features[CAMERA_PREFIX + camera] = video(
            height=header.height, width=header.width, fps=header.fps
        )
    features |= {
        SUBTASK_INDEX: scalar("int64"),
        "next.reward": scalar("float32"),
        "next.success": scalar("bool"),
        "next.done": scalar("bool"),
        "timestamp": scalar("float32"),
        "frame_index": scalar("int64"),
        "episode_index": scalar("int64"),
        "index": scalar("int64"),
        "task_index": scalar("int64"),
    }
    return features


def vector(names: tuple[str, ...]) -> dict[str, Any]:
    """Return the feature of a log with these names of dimensions."""
    return {"dtype": "float32", "shape": [len(names)], "names": list(names)}


def scalar(dtype: str) -> dict[str, Any]:
    """Return the feature of a column with one value per frame."""
    return {"dtype": dtype, "shape": [1], "names": None}


def video(*, height: int, width: int, fps: int) -> dict[str, Any]:
    """Return the feature of a camera whose videos are h264."""
    return {
        "dtype": "video",
        "shape": [height, width, 3],
        "names": ["height", "width", "channels"],
        "info": {
            "video.height": height,
            "video.width": width,
            "video.codec": "h264",
            "video.pix_fmt": "yuv420p",
            "video.is_depth_map": False,
            "is_depth_map": False,
            "video.fps": fps,
            "video.channels": 3,
            "has_audio": False,
        },
    }
