"""Verdicts of a filter beside a LeRobot data set, in the forms that its trainers read."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa

from teasim.common.files import write_text
from teasim.pool.lerobot.writing.assembly import write_parquet
from teasim.pool.writers.content import Content

WEIGHTS = Path("meta/teasim_weights.parquet")
"""A weight per frame: `index`, `weight`; for LeRobot's sample weighting."""
PROGRESS = Path("sarm_progress.parquet")
"""Progress per frame, from which LeRobot's reward-aligned behaviour cloning makes its weights."""
CUTS = Path("meta/teasim_cuts.csv")
"""Frames to leave out: `episode_index`, `start`, `stop`, `from_index`, `to_index`, `demo_id`."""


def write_verdicts(root: Path, content: Content, lengths: Sequence[int]) -> None:
    """Write the files below `root`; nothing if there are no verdicts.

    Args:
        root: the data set.
        content: what it was made of.
        lengths: number of frames of each demonstration.
    """
    if not content.judged:
        return
    starts = np.cumsum([0, *lengths])
    weights = [0.0 if item.verdict is None else item.verdict.weight for item in content.items]
    flags = [item.verdict is not None and item.verdict.flagged for item in content.items]
    index = pa.array(np.arange(starts[-1]))
    per_frame = np.repeat(np.asarray(weights, np.float32), lengths)
    write_parquet(root / WEIGHTS, pa.table({"index": index, "weight": pa.array(per_frame)}))
    rises = [progress(n, w, f) for n, w, f in zip(lengths, weights, flags, strict=True)]
    columns = {
        "index": index,
        "episode_index": pa.array(np.repeat(np.arange(len(lengths)), lengths)),
        "progress_sparse": pa.array(np.concatenate(rises)),
    }
    write_parquet(root / PROGRESS, pa.table(columns))
    lines = ["episode_index,start,stop,from_index,to_index,demo_id"]
    for number, item in enumerate(content.items):
        if flags[number]:
            span = (number, 0, lengths[number], starts[number], starts[number + 1])
            lines.append(",".join(map(str, (*span, item.demo.demo_id))))
    write_text(root / CUTS, "\n".join(lines) + "\n")


def progress(length: int, weight: float, flagged: bool) -> np.ndarray:
    """Return a progress (length,) float32 in [0, 1] whose slope stands for the weight.

    Reward-aligned behaviour cloning weights a frame by the progress made in the chunk after it:
    falling progress has the weight 0, so that of a flagged demonstration falls from 1 to 0.
    """
    share = np.arange(length, dtype=np.float32) / max(length - 1, 1)
    return 1 - share if flagged else np.float32(weight) * share
