"""Segments of every demonstration of a pool, by name of the segmenter."""

from collections.abc import Callable
from dataclasses import dataclass

from teasim.errors import ConfigError, PoolError
from teasim.pool import Episode, Pool, Span


@dataclass(frozen=True)
class Segmentation:
    """The segments of a pool."""

    subtasks: tuple[str, ...]
    """Names of the T sub-task labels."""
    spans: tuple[tuple[Span, ...], ...]
    """Per demonstration its q segments in order of time [frames]."""

    def labels(self) -> list[list[int]]:
        """Return per demonstration the label numbers of its segments, 0..T-1."""
        numbers = {name: number for number, name in enumerate(self.subtasks)}
        return [[numbers[span.subtask] for span in spans] for spans in self.spans]


Segmenter = Callable[[Pool], Segmentation]


def truth(pool: Pool) -> Segmentation:
    """Use the sub-task spans logged in the pool.

    Raises:
        PoolError: a demonstration has no labelled sub-task, or a span leaves the video.
    """
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


SEGMENTERS: dict[str, Segmenter] = {"truth": truth}


def segmenter_named(name: str) -> Segmenter:
    """Return a segmenter.

    Raises:
        ConfigError: there is none of that name.
    """
    if name not in SEGMENTERS:
        raise ConfigError(f"Unknown segmenter '{name}'; choose {', '.join(SEGMENTERS)}.")
    return SEGMENTERS[name]
