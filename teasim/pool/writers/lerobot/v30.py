"""LeRobotDataset v3.0: an mp4 per demonstration and camera, sub-tasks in all of its forms."""

from collections.abc import Sequence
from pathlib import Path

from teasim.pool.lerobot.writing.assembly import Assembly
from teasim.pool.writers.content import Content
from teasim.pool.writers.lerobot import parts as lerobot_parts
from teasim.pool.writers.lerobot.verdicts import write_verdicts
from teasim.pool.writers.writer import Writer


def assemble(content: Content, folders: Sequence[Path], out: Path) -> list[str]:
    """Make a data set of the staged demonstrations."""
    parts = lerobot_parts.load(folders)
    Assembly(out, lerobot_parts.outline(content, parts), parts).write()
    write_verdicts(out, content, [part.length for part in parts])
    return lerobot_parts.notes(content, folders)


WRITER = Writer(
    "lerobot", "LeRobot data set", lerobot_parts.stage, assemble, check=lerobot_parts.check
)
