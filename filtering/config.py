"""Settings of the filter; light, so that `teasim filter --help` is fast."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro

from filtering.features.config import POOLED
from filtering.judging.config import FOR_NORM, JudgingConfig
from filtering.vision.pretrained import LITE, Backbone
from teasim.common.errors import ConfigError
from teasim.pool.source import Source

Cameras = Annotated[
    tuple[str, ...], tyro.conf.arg(name="camera", metavar="NAME"), tyro.conf.UseAppendAction
]
"""Names of cameras; on the command line `--camera NAME`, which may be repeated."""
Frames = Annotated[int, tyro.conf.arg(aliases=["--frames"])]
"""A number of frames; on the command line also `--frames`."""


AUTO = "auto"
"""Name of the score and of the segmenter that are chosen by what the source holds."""
MOMENTS = "moments"
"""Name of the score that needs no segments."""
COMBINED = "combined"
"""Name of the score of moments and the norm together."""
CLUSTERING = "clustering"
"""Name of the segmenter that needs videos alone."""
AGREEMENT = "agreement"
"""Name of the segmenter that the score `moments` brings along."""
TOLD = ("logged", "predictions")
"""Names of the segmenters that read sub-tasks in place of finding them in videos."""


@dataclass(frozen=True)
class FilterConfig(JudgingConfig):
    """How a pool is filtered."""

    segmenter: str = "auto"
    """Source of the segments: agreement (what the counterparts of the score moments agree on),
    clustering (the videos alone, without labels), logged (sub-tasks logged in the pool),
    predictions (stored in an MS-TCN folder), or a folder that `teasim segment fit` made. Only
    logged reads logged labels. auto: clustering; for step lists without videos the stored
    predictions, or else the logged labels."""
    subtasks: str = "auto"
    """Number of sub-tasks for the segmenter clustering; auto infers it."""
    cameras: Cameras = ()
    """Camera whose pictures are used; may be repeated. By default the main camera, and all cameras
    for effects."""
    effects: bool = True
    """Compare the video, or without one the logged state of the environment, before and after each
    segment: an ineffective step counts like one left out. For the score norm."""
    frames_per_segment: Frames = 64
    """Largest number of frames used per segment (paper section 3.2); with vgg16 exactly so many,
    those of shorter segments repeated. For the score equation3."""
    backbone: str = LITE
    """Network that looks at the frames: efficientnet-lite0, or vgg16 of the paper, at 224 x 224
    pixels. For the score equation3 with pooled features."""
    backbone_weights: str = ""
    """File with the weights of vgg16: safetensors or a state dict of torch, with the names of
    torchvision."""
    background: str = "median"
    """Background subtraction: none, median or mog2. For the score equation3."""
    features: str = POOLED
    """Features of a segment: pooled (nothing is learned), or a folder that `teasim segment fit
    --features` made, with its own camera, frames and background. For the score equation3."""

    def __post_init__(self) -> None:
        """Refuse unknown names, numbers out of range, and settings that exclude each other.

        Raises:
            ConfigError: in one sentence, with the choices.
            CheckpointError: the folder of the segmenter holds none, or a damaged one.
        """
        self._check_names()
        super().__post_init__()
        if self.frames_per_segment < 1:
            raise ConfigError(f"frames_per_segment is {self.frames_per_segment}; choose 1 or more.")
        for name, usual in (("features", POOLED), ("backbone", LITE)):
            if self.score != "equation3" and getattr(self, name) != usual:
                raise ConfigError(f"The score '{self.score}' takes no {name}; choose equation3.")
        if self.features != POOLED and self.backbone != LITE:
            raise ConfigError("The features of a folder have a backbone already; leave it out.")
        self.network  # noqa: B018  checks both

    @property
    def network(self) -> Backbone:
        """The network that looks at the frames of segments."""
        return Backbone(self.backbone, self.backbone_weights)

    def for_source(self, source: Source) -> "FilterConfig":
        """Return these settings with `auto` replaced by what it stands for in a source.

        Videos are judged by moments, and by the norm on sub-tasks that a segmenter finds in them;
        on sub-tasks that are told by the norm alone; step lists without videos on the predictions
        that are stored, or else on the logged labels.
        """
        score, segmenter = self.score, self.segmenter
        if score == AUTO and segmenter == AGREEMENT:
            score = MOMENTS
        elif score == AUTO:
            alone = source.cameras and segmenter not in TOLD and self._is_plain
            score = COMBINED if alone else "norm"
        if segmenter == AUTO and score == MOMENTS:
            segmenter = AGREEMENT
        elif segmenter == AUTO and source.cameras:
            segmenter = CLUSTERING
        elif segmenter == AUTO:
            segmenter = "predictions" if source.has_predictions else "logged"
        chosen = replace(self, score=score, segmenter=segmenter)
        asked = chosen.decision == "learned" and score == COMBINED
        return replace(chosen, decision="learned" if chosen.learns or asked else "clusters")

    @property
    def _is_plain(self) -> bool:
        """Whether no setting is given that the norm alone can follow."""
        told = any(getattr(self, name) for name in FOR_NORM)
        return self.decision != "learned" and not told

    def _check_names(self) -> None:
        # Imported here because the registries need SciPy, which `--help` must not wait for.
        from filtering.judging.equation3.solvers import solver_named
        from filtering.judging.judges import judge_named
        from filtering.judging.thresholds import GROUPS, METHODS
        from filtering.segmentation.segmenter import segmenter_named
        from filtering.vision.background import subtraction_named

        if self.segmenter not in (AUTO, AGREEMENT):
            segmenter_named(self.segmenter, self.subtasks)
        if self.segmenter == AGREEMENT and self.score not in (AUTO, MOMENTS):
            raise ConfigError(
                f"The segmenter '{AGREEMENT}' is for the score '{MOMENTS}'; choose another one."
            )
        if self.score not in (AUTO, MOMENTS, COMBINED):
            judge_named(self.score)
        solver_named(self.solver)
        subtraction_named(self.background)
        if self.features != POOLED and not Path(self.features).is_dir():
            raise ConfigError(
                f"Unknown features '{self.features}'; choose {POOLED} or the folder of a segmenter "
                "that `teasim segment fit --features` made."
            )
        if self.groups not in GROUPS:
            raise ConfigError(
                f"Unknown number of groups '{self.groups}'; choose {', '.join(GROUPS)}."
            )
        if isinstance(self.threshold, str) and self.threshold not in ("auto", *METHODS):
            raise ConfigError(
                f"Unknown threshold '{self.threshold}'; choose a number between 0 and 1, auto, "
                f"{', '.join(METHODS)}."
            )
