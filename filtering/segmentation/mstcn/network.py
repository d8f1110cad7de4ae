"""MS-TCN++ (Li, Abu Farha, Liu, Cheng, Gall, TPAMI 2020): the network and its loss.

A prediction stage of dual dilated layers labels the frames, then refinement stages of dilated
residual layers each correct what the stage before said.
"""

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

KERNEL = 3
"""Frames per convolution."""
DROPOUT = 0.5
"""Share of activations dropped in training."""
SMOOTHING = 0.15
"""Weight of the smoothing loss, the paper's lambda."""
LARGEST_JUMP = 4.0
"""Jump of a log-probability from one frame to the next above which it costs no more [nats], the
paper's tau."""


@dataclass(frozen=True)
class MSTCNShape:
    """Sizes of an `MSTCN`; the defaults are those of the paper."""

    features: int
    """D, features of a frame."""
    labels: int
    """C, labels to choose from."""
    channels: int = 64
    """Channels of every hidden layer."""
    prediction_layers: int = 11
    """Dual dilated layers of the prediction stage."""
    refinement_stages: int = 3
    """Stages after the prediction stage."""
    refinement_layers: int = 10
    """Dilated residual layers of each refinement stage."""


class DualDilatedLayer(nn.Module):
    """Looks near and far at once: two dilations, fused, with a residual."""

    def __init__(self, channels: int, near: int, far: int) -> None:
        """Create a layer of dilations `near` and `far` [frames]."""
        super().__init__()
        self.near = _dilated(channels, near)
        self.far = _dilated(channels, far)
        self.fusion = nn.Conv1d(2 * channels, channels, 1)
        self.dropout = nn.Dropout(DROPOUT)

    def forward(self, frames: Tensor) -> Tensor:
        """(n, channels, T) -> (n, channels, T)."""
        both = torch.cat([self.near(frames), self.far(frames)], dim=1)
        change: Tensor = self.dropout(functional.relu(self.fusion(both)))
        return frames + change


class DilatedResidualLayer(nn.Module):
    """One dilated convolution, ReLU, a 1x1 convolution, with a residual, as in MS-TCN."""

    def __init__(self, channels: int, dilation: int) -> None:
        """Create a layer of `dilation` [frames]."""
        super().__init__()
        self.dilated = _dilated(channels, dilation)
        self.mix = nn.Conv1d(channels, channels, 1)
        self.dropout = nn.Dropout(DROPOUT)

    def forward(self, frames: Tensor) -> Tensor:
        """(n, channels, T) -> (n, channels, T)."""
        change: Tensor = self.dropout(self.mix(functional.relu(self.dilated(frames))))
        return frames + change


class MSTCN(nn.Module):
    """Frame features (n, D, T) -> label scores of every stage (S, n, C, T), the last one counts.

    The mean and the scale of the training set's features are part of the weights.
    """

    feature_mean: Tensor
    feature_scale: Tensor

    def __init__(self, shape: MSTCNShape) -> None:
        """Create the network with random weights of torch's global generator."""
        super().__init__()
        self.shape = shape
        self.register_buffer("feature_mean", torch.zeros(shape.features, 1))
        self.register_buffer("feature_scale", torch.ones(shape.features, 1))
        self.prediction = _stage(shape.features, shape, _dual_layers(shape))
        self.refinements = nn.ModuleList(
            _stage(shape.labels, shape, _residual_layers(shape))
            for _ in range(shape.refinement_stages)
        )

    def forward(self, features: Tensor) -> Tensor:
        """(n, D, T) float32 -> (S, n, C, T) logits."""
        scores = [self.prediction((features - self.feature_mean) / self.feature_scale)]
        for refine in self.refinements:
            scores.append(refine(functional.softmax(scores[-1], dim=1)))
        return torch.stack(scores)


def mstcn_loss(scores: Tensor, labels: Tensor) -> Tensor:
    """Sum over the stages of cross-entropy + SMOOTHING x truncated mean squared error.

    The smoothing loss (T-MSE) is the squared change of the log-probabilities from the
    frame before, which gets no gradient, over all labels and the T - 1 pairs of frames.

    Args:
        scores: (S, n, C, T) logits, T >= 2.
        labels: (n, T) label of each frame.
    """
    total = scores.new_zeros(())
    for stage in scores:
        logs = functional.log_softmax(stage, dim=1)
        jumps = (logs[:, :, 1:] - logs[:, :, :-1].detach()) ** 2
        total = total + functional.nll_loss(logs, labels)
        total = total + SMOOTHING * jumps.clamp(max=LARGEST_JUMP**2).mean()
    return total


def _dilated(channels: int, dilation: int) -> nn.Conv1d:
    """Return a convolution over KERNEL frames, `dilation` apart, that keeps the length."""
    return nn.Conv1d(channels, channels, KERNEL, padding=dilation, dilation=dilation)


def _dual_layers(shape: MSTCNShape) -> list[nn.Module]:
    """Return layers whose dilations grow on one side and shrink on the other: 2^i, 2^(L-1-i)."""
    last = shape.prediction_layers - 1
    return [
        DualDilatedLayer(shape.channels, near=2**i, far=2 ** (last - i)) for i in range(last + 1)
    ]


def _residual_layers(shape: MSTCNShape) -> list[nn.Module]:
    """Return layers whose dilations double, from 1."""
    return [DilatedResidualLayer(shape.channels, 2**i) for i in range(shape.refinement_layers)]


def _stage(inputs: int, shape: MSTCNShape, layers: list[nn.Module]) -> nn.Sequential:
    """Return 1x1 convolution to the channels, the layers, 1x1 convolution to the labels."""
    return nn.Sequential(
        nn.Conv1d(inputs, shape.channels, 1), *layers, nn.Conv1d(shape.channels, shape.labels, 1)
    )
