"""The paper's feature generator (section 3.2): activations over time to one vector per segment."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from filtering.features.config import GeneratorConfig
from teasim.common.errors import ConfigError

if TYPE_CHECKING:
    from filtering.features.graphs.intervals import Activations, Intervals
    from filtering.features.graphs.rgcn import GraphClassifier


class FeatureGenerator:
    """Selects the channels whose intervals discriminate between sub-tasks.

    After `fit`:
        thresholds_ (N,): activation above which a channel is active.
        classifier_: names the sub-task of a graph of intervals.
        importance_ (T, N): how much each channel matters to each sub-task.
        kept_ (K,): the channels that stay in the features, the most important first.
    """

    thresholds_: NDArray[np.float64]
    classifier_: "GraphClassifier"
    importance_: NDArray[np.float64]
    kept_: NDArray[np.int64]

    def __init__(self, config: GeneratorConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or GeneratorConfig()

    def fit(self, activations: "Sequence[Activations]", labels: Sequence[int]) -> Self:
        """Learn from the activations (n, N) of S segments and their sub-tasks 0..T-1.

        Raises:
            ConfigError: the labels give nothing to learn, a segment has no frames or another
                number of channels, or more channels are to be kept than there are.
        """
        from filtering.features.erasure import erasure_importance, rank_channels
        from filtering.features.graphs.intervals import mean_thresholds
        from filtering.features.graphs.rgcn import GraphClassifier
        from filtering.features.training import class_labels

        numbers, _ = class_labels(labels, len(activations))
        channels = activations[0].shape[-1]
        _check(activations, channels)
        if self.config.kept_channels > channels:
            raise ConfigError(
                f"kept_channels is {self.config.kept_channels}; choose 1 to {channels}, "
                "the number of channels."
            )
        self.thresholds_ = mean_thresholds(activations)
        clips = self.intervals(activations)
        self.classifier_ = GraphClassifier(self.config.classifier)
        self.classifier_.fit(self._graphs(clips), labels)
        self.importance_ = erasure_importance(self.decide, clips, numbers, channels)
        self.kept_ = rank_channels(self.importance_)[: self.config.kept_channels]
        return self

    def transform(self, activations: "Sequence[Activations]") -> NDArray[np.float64]:
        """Return the features (S, N) of S segments; channels that were not kept are 0.

        Raises:
            ConfigError: a segment has no frames, or another number of channels than in `fit`.
        """
        from filtering.features.erasure import max_over_time

        _check(activations, len(self.thresholds_))
        return max_over_time(activations, self.kept_)

    def intervals(self, activations: "Sequence[Activations]") -> "list[Intervals]":
        """Return when the channels of S segments are active.

        Raises:
            ConfigError: a segment has no frames, or another number of channels than in `fit`.
        """
        from filtering.features.graphs.intervals import find_intervals

        _check(activations, len(self.thresholds_))
        return [
            find_intervals(segment, self.thresholds_, self.config.structure)
            for segment in activations
        ]

    def decide(self, clips: "Sequence[Intervals]") -> NDArray[np.float64]:
        """Return the classifier's logits (S, T) for the intervals of S segments."""
        return self.classifier_.decision_function(self._graphs(clips))

    def predict(self, activations: "Sequence[Activations]") -> NDArray[np.int64]:
        """Return the likeliest sub-task of each segment, (S,).

        Raises:
            ConfigError: a segment has no frames, or another number of channels than in `fit`.
        """
        return self.decide(self.intervals(activations)).argmax(axis=1)

    def _graphs(self, clips: "Sequence[Intervals]") -> list:
        from filtering.features.graphs.graph import interval_graph

        return [interval_graph(clip, len(self.thresholds_)) for clip in clips]


def _check(activations: "Sequence[Activations]", channels: int) -> None:
    for number, segment in enumerate(activations):
        if segment.ndim != 2 or segment.shape[1] != channels or not len(segment):
            raise ConfigError(
                f"The activations of segment {number} have shape {segment.shape}; "
                f"the generator reads (frames, {channels})."
            )
        if not np.isfinite(segment).all():
            raise ConfigError(f"The activations of segment {number} are not all finite numbers.")
