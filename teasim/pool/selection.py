"""Some demonstrations of a data set: by task, and how other tools keep or leave them out."""

import json
import shlex
from collections.abc import Sequence
from pathlib import Path

from teasim.pool.source import Demonstration, Source


def tasks_of(source: Source) -> dict[str, list[int]]:
    """Return per task, in the order of first occurrence, the positions of its demonstrations."""
    found: dict[str, list[int]] = {}
    for position, episode in enumerate(source.episodes):
        found.setdefault(episode.task, []).append(position)
    return found


def task_line(episode: Demonstration) -> str:
    """Return the task of a demonstration in one line; empty where none is named."""
    return " ".join(episode.task.split())


def lerobot_usage(root: Path, indexes: Sequence[int], *, keep: bool) -> list[str]:
    """Return lines for LeRobot, robomimic and Minari; `indexes` are episode indexes of `root`."""
    if not indexes:
        return []
    numbers = json.dumps(list(indexes), separators=(",", ":"))
    names = " ".join(f"demo_{index}" for index in indexes)
    data_set = f"--dataset.repo_id={_name(root)} --dataset.root={shlex.quote(str(root))}"
    if keep:
        return [
            f'LeRobot:   lerobot-train {data_set} --dataset.episodes="{numbers}"',
            f"robomimic: put these names into mask/keep, set train.hdf5_filter_key=keep: {names}",
            f"Minari:    dataset.filter_episodes(lambda episode: episode.id in {numbers})",
        ]
    copy = shlex.quote(f"local/{root.name}_filtered")
    return [
        f'LeRobot:   lerobot-train {data_set} --dataset.exclude_episodes="{numbers}"   '
        "(needs a version after 0.6.1)",
        f"LeRobot:   lerobot-edit-dataset --repo_id {_name(root)} --root {shlex.quote(str(root))} "
        f"--new_repo_id {copy} --operation.type delete_episodes "
        f'--operation.episode_indices "{numbers}"   (makes a copy, without the columns teasim/*)',
        f"robomimic: leave these names out of the mask you train on: {names}",
        f"Minari:    dataset.filter_episodes(lambda episode: episode.id not in {numbers})",
    ]


def _name(root: Path) -> str:
    return shlex.quote(f"local/{root.name}")
