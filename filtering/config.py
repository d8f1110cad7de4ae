"""How a pool is filtered: every setting with its meaning, checked at once."""

from dataclasses import dataclass, fields

from filtering.features.description import POOLED, check_description
from filtering.judging.equation3.solvers import solver_named
from filtering.judging.norm.precedence import Pairs
from filtering.judging.thresholds import GROUPS, METHODS
from filtering.judging.verdict import Rule, judge_named
from filtering.segmentation.segmenter import segmenter_named
from filtering.vision.background import subtraction_named
from teasim.common.errors import ConfigError


@dataclass(frozen=True)
class FilterConfig:
    """How a pool is filtered."""

    segmenter: str = "logged"
    """Where segments come from: logged (the sub-tasks logged in the pool), clustering (the videos
    alone), predictions (those stored in an MS-TCN folder), or the folder of a fitted segmenter; all
    but logged read no logged label."""
    subtasks: str = "auto"
    """Number of sub-tasks that clustering looks for; auto finds it out."""
    score: str = "norm"
    """What demonstrations are judged by: norm (omissions, order and next steps against what most
    of the pool does) or equation3 (the paper's next-step model)."""
    solver: str = "annealed"
    """Solver of equation 3: annealed, alternating, exact (24 different demonstrations at most) or
    published (SciPy's SLSQP without a ridge)."""
    groups: str = "auto"
    """Number of groups: auto (kept, and of the score norm what is out of order and where steps are
    left out), 1 (nothing is flagged), 2 or 3."""
    threshold: str = "auto"
    """How the threshold is found: auto (the score's own rule), or the mid-points between groups of
    weights by kmeans, gmm or minibatch."""
    precedence: Pairs = ()
    """Pairs (a, b) of sub-tasks, a before b: if there are any, no other order counts. Of norm."""
    tolerance: float = 0.0
    """How much what a minority does is let pass, 0 to below 1; 0.2 spares shared legal orders. Of
    the score norm."""
    cameras: tuple[str, ...] = ()
    """Cameras whose pictures are used; empty means the main one."""
    effects: bool = True
    """Look at the video before and after each segment, in all cameras unless some are named: a step
    of which nothing came is as bad as one left out. Of the score norm."""
    frames_per_segment: int = 64
    """Most frames looked at in a segment (paper section 3.2). Of the score equation3."""
    background: str = "median"
    """Background subtraction: none, median or mog2. Of the score equation3."""
    features: str = POOLED
    """What describes a segment for equation3: pooled (nothing is learned), or the folder of a
    segmenter that was fitted with features (they keep to the camera, frames and background they
    were learned from)."""
    trusted_share: float = 0.5
    """M / D, share of demonstrations that equation 3 trusts."""
    ridge: float = 0.01
    """Strength of the penalty on lambda [nats per unit squared]."""

    def __post_init__(self) -> None:
        """Refuse settings that name nothing or are out of range.

        Raises:
            ConfigError: in one sentence, with the choices.
        """
        segmenter_named(self.segmenter, self.subtasks)
        judge_named(self.score)
        solver_named(self.solver)
        subtraction_named(self.background)
        check_description(self.features)
        if self.groups not in GROUPS:
            raise ConfigError(
                f"Unknown number of groups '{self.groups}'; choose {', '.join(GROUPS)}."
            )
        if self.threshold != "auto" and self.threshold not in METHODS:
            raise ConfigError(
                f"Unknown threshold '{self.threshold}'; choose auto, {', '.join(METHODS)}."
            )
        self._check_numbers()
        self._check_score()

    def rule(self) -> Rule:
        """Return the settings by which evidence is judged."""
        return Rule(**{one.name: getattr(self, one.name) for one in fields(Rule)})

    def _check_score(self) -> None:
        if self.score != "norm" and (self.precedence or self.tolerance):
            raise ConfigError(
                f"The score '{self.score}' takes neither precedence nor tolerance; choose norm."
            )
        if self.score != "equation3" and self.features != POOLED:
            raise ConfigError(f"The score '{self.score}' takes no features; choose equation3.")

    def _check_numbers(self) -> None:
        if not 0.0 <= self.tolerance < 1.0:
            raise ConfigError(f"tolerance is {self.tolerance}; choose a share from 0 to below 1.")
        if self.frames_per_segment < 1:
            raise ConfigError(f"frames_per_segment is {self.frames_per_segment}; choose 1 or more.")
        if not 0.0 < self.trusted_share < 1.0:
            raise ConfigError(
                f"trusted_share is {self.trusted_share}; choose a share between 0 and 1."
            )
        if not self.ridge > 0.0:
            raise ConfigError(f"ridge is {self.ridge}; choose a number above 0.")
