"""What is known about the demonstrations of a pool before they are judged."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from filtering.judging.norm.steps import StepCounts, StepList, count_steps
from filtering.judging.places import Places
from filtering.segmentation.segments import label_numbers
from teasim.common.arrays import Array
from teasim.pool import Span


@dataclass(frozen=True)
class Evidence:
    """The segments of a pool and what the videos show of them; counts are made on demand."""

    subtasks: tuple[str, ...]
    """Names of the T sub-task labels."""
    segments: tuple[tuple[Span, ...], ...]
    """Per demonstration its q segments."""
    states: Sequence[Array] = ()
    """Per demonstration (q, N): features of each segment, rows of mean squared length 1; empty
    where the score does not use them."""
    ineffective: Sequence[Array] | None = None
    """Per demonstration (q,): how surprisingly little each segment changed [nats], see
    `filtering.effects.surprise`; None where the videos were not examined for effects."""

    reliability: Sequence[Array] | None = None
    """Per demonstration (q,): mean probability that the segmenter gives the label of each segment;
    None where it gives none."""
    told: bool = False
    """Whether people or the environment labelled the segments, not a segmenter, which errs more."""

    @cached_property
    def labels(self) -> list[list[int]]:
        """Per demonstration the label numbers of its segments, 0..T-1."""
        return label_numbers(self.segments, self.subtasks)

    @property
    def step_lists(self) -> tuple[StepList, ...]:
        """Per demonstration its segments as labels and lengths [frames]."""
        return tuple(
            StepList(tuple(labels), tuple(span.stop - span.start for span in spans))
            for labels, spans in zip(self.labels, self.segments, strict=True)
        )

    @cached_property
    def counts(self) -> StepCounts:
        """Occurrence, precedence and next steps."""
        return count_steps(self.step_lists, len(self.subtasks))

    @property
    def places(self) -> Places:
        """Where the steps are in the videos."""
        return Places(self.segments, self.subtasks)
