"""Fitting MS-TCN++ to labelled videos.

As published (Li et al., TPAMI 2020): Adam, one video per step. Two additions keep the network from
memorising the order of the sub-tasks, which is judged later: features are scaled within each video,
and some videos are shown with their segments rearranged.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from tqdm import tqdm

from filtering.segmentation.config import MSTCNConfig
from filtering.segmentation.mstcn.network import MSTCN, MSTCNShape, mstcn_loss
from filtering.segmentation.scaling import mean_and_scale, scaled
from filtering.vision.determinism import one_thread, seeded
from teasim.common.errors import ConfigError
from teasim.pool.types import runs

FEWEST_FRAMES = 2
"""Least number of frames of a video; the smoothing loss compares neighbouring frames."""

SHARE_OF_SHORTEST = 0.5
"""Least length of a run as a share of the shortest labelled one; others may be quicker."""


@dataclass(frozen=True)
class LabelledVideo:
    """A video whose frames are labelled."""

    name: str
    """Name in messages."""
    features: NDArray[np.float32]
    """(n, D), one row per frame."""
    labels: NDArray[np.int64]
    """(n,) label of each frame, 0..C-1."""

    def __post_init__(self) -> None:
        """Refuse videos that cannot be learned from.

        Raises:
            ConfigError: too few frames, features and labels of different length, or not finite.
        """
        if len(self.labels) < FEWEST_FRAMES:
            raise ConfigError(
                f"The video {self.name} has {len(self.labels)} labelled frame; a segmenter learns "
                f"from videos of {FEWEST_FRAMES} or more."
            )
        if self.features.ndim != 2 or len(self.features) != len(self.labels):
            raise ConfigError(
                f"The video {self.name} has features of shape {self.features.shape} but "
                f"{len(self.labels)} labels; one row per label is needed."
            )
        if not np.isfinite(self.features).all():
            raise ConfigError(f"The features of the video {self.name} are not all finite numbers.")


class MSTCNLearner:
    """Minimises the sum of `mstcn_loss` over videos by Adam, one video per step.

    After `fit`:
        network_: the network, ready for inference.
        history_: mean loss of each epoch [nats, summed over the stages].

    It runs on one thread with its own random numbers: the result is bitwise reproducible.
    """

    network_: MSTCN
    history_: tuple[float, ...]

    def __init__(self, config: MSTCNConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = MSTCNConfig() if config is None else config

    def fit(self, videos: Sequence[LabelledVideo], n_labels: int) -> Self:
        """Learn to label frames with 0..n_labels-1.

        Raises:
            ConfigError: there is no video, they differ in the number of features, or a label is
                out of range.
        """
        _check(videos, n_labels)
        with one_thread(), seeded(self.config.seed):
            network = MSTCN(_shape(self.config, videos[0].features.shape[1], n_labels))
            _standardise(network, [scaled(v.features, self.config.scaling) for v in videos])
            self.history_ = self._descend(network, videos)
        self.network_ = network.eval()
        return self

    def _descend(self, network: MSTCN, videos: Sequence[LabelledVideo]) -> tuple[float, ...]:
        rng = np.random.default_rng(self.config.seed)
        optimizer = torch.optim.Adam(network.parameters(), lr=self.config.learning_rate)
        network.train()
        history = []
        epochs = range(self.config.epochs)
        shown = sys.stderr.isatty()
        for _ in tqdm(epochs, "fitting", disable=not shown, file=sys.stderr, leave=False):
            losses = []
            for number in rng.permutation(len(videos)):
                features, labels = self._shown(videos[number], rng)
                optimizer.zero_grad()
                loss = mstcn_loss(network(_tensor(features)), torch.from_numpy(labels)[None])
                loss.backward()
                optimizer.step()
                losses.append(loss.item())
            history.append(float(np.mean(losses)))
        return tuple(history)

    def _shown(
        self, video: LabelledVideo, rng: np.random.Generator
    ) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
        """Return the features and labels of a video, rearranged with a certain probability."""
        order = np.arange(len(video.labels))
        if rng.random() < self.config.rearranged:
            order = rearrange(video.labels, rng, self.config.left_out)
        return scaled(video.features[order], self.config.scaling), video.labels[order]


def frame_posteriors(
    network: MSTCN, features: NDArray[np.float32], scaling: str
) -> NDArray[np.float32]:
    """Return the probability of each label in each frame, (n, C), for features (n, D).

    Args:
        network: the trained network.
        features: those of one whole video.
        scaling: that of the training.
    """
    with one_thread(), torch.inference_mode():
        scores = network(_tensor(scaled(features, scaling)))[-1, 0]
        posteriors: NDArray[np.float32] = torch.softmax(scores, dim=0).T.contiguous().numpy()
    return posteriors


def rearrange(
    labels: NDArray[np.int64], rng: np.random.Generator, left_out: float
) -> NDArray[np.int64]:
    """Return frame numbers of a video with its segments shuffled and some of them left out.

    At least two frames stay.

    Args:
        labels: (n,) label of each frame; a run of equal ones is a segment.
        rng: source of randomness.
        left_out: probability that a segment is left out.
    """
    found = runs(labels)
    order = rng.permutation(len(found))
    kept = [number for number in order if rng.random() >= left_out]
    if sum(found[number].length for number in kept) < FEWEST_FRAMES:
        kept = list(order)
    return np.concatenate([np.arange(found[n].start, found[n].stop) for n in kept])


def least_lengths(videos: Sequence[LabelledVideo], n_labels: int) -> list[float]:
    """Return the least length of a run of each of the C labels [frames].

    It is SHARE_OF_SHORTEST of the shortest labelled run, and 0 for labels that never occur.
    """
    shown = [run for video in videos for run in runs(video.labels)]
    return [
        SHARE_OF_SHORTEST * min((run.length for run in shown if run.label == label), default=0)
        for label in range(n_labels)
    ]


def _shape(config: MSTCNConfig, features: int, labels: int) -> MSTCNShape:
    """Return the sizes of the network for D features and C labels."""
    return MSTCNShape(
        features,
        labels,
        config.channels,
        config.prediction_layers,
        config.refinement_stages,
        config.refinement_layers,
    )


def _standardise(network: MSTCN, features: Sequence[NDArray[np.float32]]) -> None:
    """Set the network's normaliser to the moments of the training set, per video (n, D)."""
    mean, scale = mean_and_scale(np.concatenate(features))
    network.feature_mean.copy_(torch.from_numpy(mean)[:, None])
    network.feature_scale.copy_(torch.from_numpy(scale)[:, None])


def _tensor(features: NDArray[np.float32]) -> Tensor:
    """Turn (n, D) into a batch of one video, (1, D, n)."""
    return torch.from_numpy(np.ascontiguousarray(features.T, dtype=np.float32))[None]


def _check(videos: Sequence[LabelledVideo], n_labels: int) -> None:
    if not videos:
        raise ConfigError("There is no labelled video; a segmenter learns from one or more.")
    width = videos[0].features.shape[1]
    for video in videos:
        if video.features.shape[1] != width:
            raise ConfigError(
                f"The video {video.name} has {video.features.shape[1]} features per frame, "
                f"the video {videos[0].name} has {width}; they must agree."
            )
        if video.labels.min() < 0 or video.labels.max() >= n_labels:
            raise ConfigError(
                f"The video {video.name} has labels from {video.labels.min()} to "
                f"{video.labels.max()}; there are labels 0 to {n_labels - 1}."
            )
