"""The registry of segmenters, with the two that read stored segments."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from filtering.segmentation.segments import Segmentation, Segmenter
from filtering.segmentation.unlabelled.clustering import AUTO, clustering, subtask_count
from teasim.common.errors import ConfigError, PoolError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Span
from teasim.pool.source import Demonstration, Source


def logged(source: Source, *, workers: Workers = IN_PROCESS) -> Segmentation:
    """Use the sub-task spans logged in the source.

    Raises:
        PoolError: a demonstration has no logged sub-task, or a span beyond its end.
    """
    del workers  # nothing to compute
    spans = [demo.spans() for demo in source.episodes]
    return Segmentation(_names(source, spans), _checked(source, spans, "logged"), told=True)


def predictions(source: Source, *, workers: Workers = IN_PROCESS) -> Segmentation:
    """Use the spans that a segmenter stored in the source, with its posteriors if all exist.

    Raises:
        PoolError: a demonstration has no stored span, or one beyond its end.
    """
    del workers  # nothing to compute
    spans = [demo.predicted_spans() for demo in source.episodes]
    checked = _checked(source, spans, "predictions")
    found = [demo.posteriors() for demo in source.episodes]
    known = tuple(values for values in found if values is not None)
    posteriors = known if len(known) == len(found) else None
    return Segmentation(_names(source, spans), checked, posteriors)


def _names(source: Source, spans: Sequence[tuple[Span, ...]]) -> tuple[str, ...]:
    """Return the names of the sub-tasks of `spans`, as the source numbers them."""
    seen = {span.subtask for demo in spans for span in demo}
    # Some recorders log spans without a table of names; their order must not depend on the demos'.
    names = source.subtasks or tuple(sorted(seen))
    unknown = sorted(seen - set(names))
    if unknown:
        raise PoolError(
            f"'{source.root}' has segments of the unknown sub-task '{unknown[0]}'; "
            f"its sub-tasks are {', '.join(names)}."
        )
    return names


def _checked(
    source: Source, spans: Sequence[tuple[Span, ...]], segmenter: str
) -> tuple[tuple[Span, ...], ...]:
    """Return the spans of every demonstration after checking them."""
    return tuple(
        _checked_spans(source, demo, found, segmenter)
        for demo, found in zip(source.episodes, spans, strict=True)
    )


def _checked_spans(
    source: Source, demo: Demonstration, spans: tuple[Span, ...], segmenter: str
) -> tuple[Span, ...]:
    if not spans:
        raise PoolError(
            f"The demonstration '{demo.name}' of '{source.root}' has no sub-tasks that the "
            f"segmenter '{segmenter}' could read; choose another segmenter."
        )
    if spans[-1].stop > demo.length:
        raise PoolError(
            f"The sub-task '{spans[-1].subtask}' of the demonstration '{demo.name}' ends at frame "
            f"{spans[-1].stop}, after the last of its {demo.length} frames."
        )
    return spans


SEGMENTERS: dict[str, Segmenter] = {
    "logged": logged,
    "clustering": clustering,
    "predictions": predictions,
}
"""Every segmenter by name; others are folders."""


def segmenter_named(name: str, subtasks: str = AUTO, cameras: tuple[str, ...] = ()) -> Segmenter:
    """Return a segmenter by its name, or the one that was saved in the folder of that name.

    Args:
        name: of SEGMENTERS, or a folder.
        subtasks: number of sub-tasks for `clustering`; AUTO infers it.
        cameras: cameras for `clustering`; empty means the main one.

    Raises:
        ConfigError: there is no segmenter of that name, or it takes no number of sub-tasks.
        CheckpointError: the folder holds no segmenter, or a damaged one.
    """
    count = subtask_count(subtasks)
    if name == "clustering":
        return partial(clustering, subtasks=count, cameras=cameras)
    if count is not None:
        raise ConfigError(
            f"The segmenter '{name}' takes no number of sub-tasks; only 'clustering' does."
        )
    if name in SEGMENTERS:
        return SEGMENTERS[name]
    if not Path(name).is_dir():
        raise ConfigError(
            f"Unknown segmenter '{name}'; choose {', '.join(SEGMENTERS)} or the folder of one "
            "that `teasim segment fit` made."
        )
    # Only here: logged labels need no torch.
    from filtering.segmentation.mstcn.checkpoint import load_segmenter

    return load_segmenter(Path(name)).segment
