"""Segments of every demonstration of a pool, by name of the segmenter."""

from functools import partial
from pathlib import Path

from filtering.segmentation.clustering import AUTO, clustering, subtask_count
from filtering.segmentation.segments import Segmentation, Segmenter
from teasim.common.errors import ConfigError, PoolError
from teasim.pool import Episode, Pool, Span


def truth(pool: Pool, *, jobs: int = 1) -> Segmentation:
    """Use the sub-task spans logged in the pool.

    Raises:
        PoolError: a demonstration has no labelled sub-task, or a span leaves the video.
    """
    del jobs  # nothing to compute
    spans = tuple(_logged_spans(episode) for episode in pool.episodes)
    seen = {span.subtask for demo in spans for span in demo}
    # Some recorders log spans without a table of names; their order must not depend on the demos'.
    names = pool.subtasks or tuple(sorted(seen))
    unknown = sorted(seen - set(names))
    if unknown:
        raise PoolError(
            f"The pool '{pool.root}' has segments of '{unknown[0]}', "
            f"which is none of its sub-tasks {', '.join(names)}."
        )
    return Segmentation(names, spans)


def _logged_spans(episode: Episode) -> tuple[Span, ...]:
    spans = episode.spans()
    if not spans:
        raise PoolError(
            f"Demonstration {episode.index} has no labelled sub-tasks, which the segmenter 'truth' "
            "needs (column subtask_index)."
        )
    if spans[-1].stop > episode.length:
        raise PoolError(
            f"The sub-task '{spans[-1].subtask}' of demonstration {episode.index} ends at frame "
            f"{spans[-1].stop}, after the last of its {episode.length} frames."
        )
    return spans


def predictions(pool: Pool, *, jobs: int = 1) -> Segmentation:
    """Refuse a pool: stored predictions are those of an MS-TCN folder (`SequencePool`).

    Raises:
        ConfigError: always.
    """
    del jobs  # nothing to compute
    raise ConfigError(
        f"The segmenter 'predictions' reads predictions/*.txt of an MS-TCN folder, but "
        f"'{pool.root}' is a pool; choose another segmenter."
    )


SEGMENTERS: dict[str, Segmenter] = {
    "truth": truth,
    "clustering": clustering,
    "predictions": predictions,
}


def segmenter_named(name: str, subtasks: str = AUTO, cameras: tuple[str, ...] = ()) -> Segmenter:
    """Return a segmenter by its name, or the one that was saved in the folder of that name.

    Args:
        name: of SEGMENTERS, or a folder.
        subtasks: how many sub-tasks `clustering` looks for, AUTO to find that out.
        cameras: whose pictures it compares; empty means the main one.

    Raises:
        ConfigError: there is none of that name, or it does not count sub-tasks.
        CheckpointError: the folder holds no segmenter, or a damaged one.
    """
    count = subtask_count(subtasks)
    if name == "clustering":
        return partial(clustering, subtasks=count, cameras=cameras)
    if count is not None:
        raise ConfigError(
            f"The segmenter '{name}' knows its sub-tasks; a number of them is for 'clustering'."
        )
    if name in SEGMENTERS:
        return SEGMENTERS[name]
    if not Path(name).is_dir():
        raise ConfigError(
            f"Unknown segmenter '{name}'; choose {', '.join(SEGMENTERS)} or the folder of one "
            "that `teasim segment fit` made."
        )
    # Only here: true labels need no torch.
    from filtering.segmentation.mstcn_checkpoint import load_segmenter

    return load_segmenter(Path(name)).segment
