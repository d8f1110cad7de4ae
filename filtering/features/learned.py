"""The paper's features from end to end: frames, bottleneck, intervals, ranked channels, one vector.

Learned from the labelled demonstrations of a segmenter and kept beside it; a segment then becomes
1 x 32 by the maximum over time of the channels that matter (paper section 3.2).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from filtering.features.bottleneck import Bottleneck
from filtering.features.config import BottleneckConfig, GeneratorConfig
from filtering.features.extraction import segment_maps
from filtering.features.generator import FeatureGenerator
from filtering.vision.pretrained import Backbone
from teasim.common import parallel
from teasim.common.errors import ConfigError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Span
from teasim.pool.source import Clip, Demonstration, Source


@dataclass(frozen=True)
class LookConfig:
    """Pictures from which features are learned."""

    camera: str
    """Camera whose pictures are used."""
    frames_per_segment: int = 64
    """Largest number of frames used per segment."""
    background: str = "median"
    """Background subtraction: none, median or mog2."""
    backbone: Backbone = field(default_factory=Backbone)
    """Pretrained network whose feature maps are used."""


@dataclass(frozen=True, eq=False)
class LearnedFeatures:
    """Describes a segment by the channels that discriminate between sub-tasks."""

    look: LookConfig
    """Pictures that are used."""
    bottleneck: Bottleneck
    """Feature maps to activations of N channels."""
    generator: FeatureGenerator
    """Activations over time to one vector."""

    def describe(
        self, pool: Source, segments: Sequence[tuple[Span, ...]], *, workers: Workers
    ) -> list[NDArray[np.float64]]:
        """Return per demonstration features (q, N) of its segments.

        Args:
            pool: where the videos are.
            segments: the segments of each demonstration.
            workers: where the work runs; the result does not depend on it.

        Raises:
            ConfigError: the pool lacks the camera that the features were learned from.
            PoolError: a video is missing or damaged.
        """
        if self.look.camera not in pool.cameras:
            raise ConfigError(
                f"The features were learned from the camera '{self.look.camera}', which the pool "
                f"'{pool.root}' lacks; it has {', '.join(pool.cameras) or 'none'}."
            )
        tasks = [
            _Task(episode.clip(self.look.camera), spans, self)
            for episode, spans in zip(pool.episodes, segments, strict=True)
        ]
        return parallel.run(_describe, tasks, workers=workers, description="describing segments")


def learn_features(
    episodes: Sequence[Demonstration],
    subtasks: Sequence[str],
    look: LookConfig,
    bottleneck: BottleneckConfig | None = None,
    generator: GeneratorConfig | None = None,
    *,
    workers: Workers = IN_PROCESS,
) -> LearnedFeatures:
    """Learn from the labelled segments of `episodes`; settings that are None are the defaults.

    Raises:
        ConfigError: fewer than two sub-tasks are shown, or a setting is out of range.
        PoolError: a video is missing or damaged.
    """
    tasks = [_MapsTask(episode.clip(look.camera), episode.spans(), look) for episode in episodes]
    found = parallel.run(_maps, tasks, workers=workers, description="describing labelled segments")
    clips = [maps for video in found for maps in video]
    labels = [subtasks.index(span.subtask) for task in tasks for span in task.spans]
    reduced = Bottleneck(bottleneck).fit(clips, labels)
    ranked = FeatureGenerator(generator).fit(reduced.transform(clips), labels)
    return LearnedFeatures(look, reduced, ranked)


@dataclass(frozen=True)
class _MapsTask:
    """The feature maps of one video."""

    clip: Clip
    """The video."""
    spans: tuple[Span, ...]
    """Its segments [frames]."""
    look: LookConfig
    """Frames that are used."""


@dataclass(frozen=True)
class _Task:
    """The features of one video."""

    clip: Clip
    """The video."""
    spans: tuple[Span, ...]
    """Its segments [frames]."""
    learned: LearnedFeatures
    """How they are described."""


def _maps(task: _MapsTask) -> list[NDArray[np.float16]]:
    look = task.look
    count, background = look.frames_per_segment, look.background
    return segment_maps(task.clip, task.spans, count, background, look.backbone)


def _describe(task: _Task) -> NDArray[np.float64]:
    learned = task.learned
    maps = _maps(_MapsTask(task.clip, task.spans, learned.look))
    return learned.generator.transform(learned.bottleneck.transform(maps))
