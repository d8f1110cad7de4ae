"""Settings of `teasim segment fit`; light, so that its `--help` is fast."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from filtering.segmentation.scaling import SCALINGS
from filtering.vision.pretrained import LITE
from teasim.common.errors import ConfigError

Advanced = tyro.conf.Suppress
"""Marks a setting that is for Python only; the published value is right on the command line."""


@dataclass(frozen=True)
class MSTCNConfig:
    """How MS-TCN++ is fitted; sizes and step size are those of its paper."""

    epochs: int = 100
    """Number of passes over the labelled videos."""
    learning_rate: Annotated[float, Advanced] = 5e-4
    """Step size of Adam."""
    channels: Annotated[int, Advanced] = 64
    """Channels of every hidden layer."""
    prediction_layers: Annotated[int, Advanced] = 11
    """Dual dilated layers of the prediction stage."""
    refinement_stages: Annotated[int, Advanced] = 3
    """Stages after the prediction stage."""
    refinement_layers: Annotated[int, Advanced] = 10
    """Dilated residual layers of each refinement stage."""
    scaling: str = "video"
    """Normalisation of features: video (mean 0 and scale 1 within each video, which reduces the
    influence of camera and light), or training (mean and scale of the training set alone)."""
    rearranged: float = 0.5
    """Probability that a training video is shown with its segments in a random order, 0 to 1."""
    left_out: Annotated[float, Advanced] = 0.2
    """Probability that a segment of a rearranged video is left out, 0 to 1."""
    seed: int = 0
    """Seed of the network, of its training, and of the choice of demonstrations."""

    def __post_init__(self) -> None:
        """Refuse settings that cannot train.

        Raises:
            ConfigError: in one sentence, with the choices.
        """
        counts = ("epochs", "channels", "prediction_layers", "refinement_layers")
        for name, least in [*((name, 1) for name in counts), ("refinement_stages", 0), ("seed", 0)]:
            if getattr(self, name) < least:
                raise ConfigError(f"{name} is {getattr(self, name)}; choose {least} or more.")
        if not self.learning_rate > 0.0:
            raise ConfigError(f"learning_rate is {self.learning_rate}; choose a number above 0.")
        for name in ("rearranged", "left_out"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ConfigError(
                    f"{name} is {getattr(self, name)}; choose a probability from 0 to 1."
                )
        if self.scaling not in SCALINGS:
            raise ConfigError(f"Unknown scaling '{self.scaling}'; choose {', '.join(SCALINGS)}.")


@dataclass(frozen=True)
class FitConfig:
    """Which demonstrations a segmenter is fitted to, and how."""

    episodes: tuple[int, ...] = ()
    """Numbers of the demonstrations whose labels are used; by default they are drawn at random."""
    labelled: int | None = None
    """How many demonstrations with labels are drawn; by default 12, or all if there are fewer."""
    cameras: Annotated[
        tuple[str, ...], tyro.conf.arg(name="camera", metavar="NAME"), tyro.conf.UseAppendAction
    ] = ()
    """Camera whose pictures are used; may be repeated. By default all cameras."""
    rate: float = 2.5
    """Number of frames used per second of video [Hz]."""
    shortest: float | None = None
    """Least length of a segment that the segmenter returns [s]; by default half of the shortest
    labelled segment of each sub-task."""
    features: bool = False
    """Also learn the features of the paper from the first camera, for `filter --features`."""
    backbone: str = LITE
    """Network whose feature maps these features are learned from: efficientnet-lite0, or vgg16 of
    the paper."""
    backbone_weights: str = ""
    """File with the weights of vgg16: safetensors or a state dict of torch."""
    network: Annotated[MSTCNConfig, tyro.conf.OmitArgPrefixes] = field(default_factory=MSTCNConfig)
    """Settings of the network; its seed also draws the demonstrations."""
