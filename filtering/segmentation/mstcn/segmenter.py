"""A fitted MS-TCN++ with all that is needed to use it on another pool."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from safetensors.torch import save as save_tensors

from filtering.segmentation.mstcn.network import MSTCN
from filtering.segmentation.mstcn.training import frame_posteriors
from filtering.segmentation.segments import Segmentation, decode, spans_of
from filtering.vision.frame_features import (
    FrameSource,
    frame_features,
    moment_of_frames,
)
from filtering.vision.frames import frame_rate
from teasim.common.errors import ConfigError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Span
from teasim.pool.source import Demonstration, Source


@dataclass(frozen=True)
class MSTCNSegmenter:
    """Labels the frames of videos and joins them to segments."""

    network: MSTCN
    """Ready for inference; C = T labels, or T + 1 where some frames belong to no sub-task."""
    subtasks: tuple[str, ...]
    """Names of the T sub-tasks."""
    source: FrameSource
    """What is looked at in a video."""
    scaling: str
    """What features are scaled by, see `MSTCNConfig`."""
    shortest: tuple[float, ...]
    """Least length of a run of each of the C labels [s]."""
    labelled: frozenset[str]
    """demo_id of the demonstrations it was fitted to."""

    def segment(self, pool: Source, *, workers: Workers = IN_PROCESS) -> Segmentation:
        """Return the segments of every demonstration; true labels are not read.

        Raises:
            ConfigError: the pool lacks a camera that the segmenter was fitted to.
            PoolError: a video is missing or damaged.
        """
        return self.segment_episodes(pool, pool.episodes, workers=workers)

    def segment_episodes(
        self, pool: Source, episodes: Sequence[Demonstration], *, workers: Workers = IN_PROCESS
    ) -> Segmentation:
        """Return the segments of some demonstrations of a pool; see `segment`."""
        missing = [camera for camera in self.source.cameras if camera not in pool.cameras]
        if missing:
            raise ConfigError(
                f"The segmenter was fitted to the camera '{missing[0]}', which the pool "
                f"'{pool.root}' lacks; it has {', '.join(pool.cameras) or 'none'}."
            )
        features = frame_features(episodes, frame_rate(pool), self.source, workers=workers)
        rate = self.source.rate_in(frame_rate(pool))
        shortest = [max(1, round(seconds * rate)) for seconds in self.shortest]
        described = [
            self._segment_video(moments, episode.length, shortest)
            for moments, episode in zip(features, episodes, strict=True)
        ]
        return Segmentation(
            subtasks=self.subtasks,
            spans=tuple(spans for spans, _ in described),
            posteriors=tuple(posteriors for _, posteriors in described),
            labelled=self.labelled,
            cameras=self.source.cameras,
            weights_sha256=hashlib.sha256(self.weights()).hexdigest(),
        )

    def weights(self) -> bytes:
        """Return the weights of the network as safetensors."""
        return save_tensors(self.network.state_dict())

    def posteriors(self, features: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the probability of each label at each moment, (n, C), for features (n, D).

        Raises:
            ConfigError: the features are not those the segmenter was fitted to.
        """
        wanted = self.network.shape.features
        if features.shape[1] != wanted:
            raise ConfigError(
                f"The video has {features.shape[1]} features per frame; the segmenter was fitted "
                f"to {wanted}."
            )
        return frame_posteriors(self.network, features, self.scaling)

    def _segment_video(
        self, moments: NDArray[np.float32], length: int, shortest: Sequence[int]
    ) -> tuple[tuple[Span, ...], NDArray[np.float32]]:
        """Return the segments and the posteriors (length, T) of a video of `length` frames."""
        posteriors = self.posteriors(moments)
        of_frame = moment_of_frames(length, len(moments))
        labels = decode(posteriors, shortest)[of_frame]
        per_frame = posteriors[of_frame]
        return spans_of(labels, per_frame, self.subtasks), per_frame[:, : len(self.subtasks)]
