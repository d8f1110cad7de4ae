"""How much is done: the sizes `quick` and `full`, and the units that many exhibits need."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from policies.experiments.generating import demo_count
from policies.experiments.units import Unit
from teasim.common.registry import named

FILMED: Mapping[str, Any] = MappingProxyType({"camera": ["left"], "size": 128})
"""Options of `teasim generate` for all banks: one camera, as in the paper, and small pictures."""

FIRST_SEED = 2201
"""Seed of the first bank; every bank has one of its own, so that no layout occurs in two of them,
and none is a seed of docs/results.md, with which constants were chosen."""

PEOPLE_LEVEL = "people"
"""Segmenter at the paper's level: MS-TCN++ fitted to people, used on the robot."""
ROBOT_LEVEL = "robot"
"""Segmenter at our level: MS-TCN++ fitted to other videos of the robot."""
UNLABELLED = "clustering"
"""Segmenter without labels, that of the default filter; it is fitted to every pool anew."""
SEGMENTERS: Mapping[str, str] = MappingProxyType(
    {
        PEOPLE_LEVEL: "MS-TCN++ fitted to people",
        ROBOT_LEVEL: "MS-TCN++ fitted to the robot",
        UNLABELLED: "clustering, no labels",
    }
)
"""Every segmenter and what it is called in tables."""

# Time of one idle core for each kind of work, measured once; used for the estimate alone.
SECONDS_PER_DEMO = 3.5
"""Generating and filming a demonstration [s]."""
SECONDS_PER_VIDEO = 1.0
"""Looking at a video for the first time [s]."""
SECONDS_PER_EPOCH = 0.03
"""An epoch of MS-TCN++ over one video of 190 moments [s]."""
SECONDS_PER_POOL = 1.0
"""Judging a pool by all methods, mostly SLSQP [s]."""
SECONDS_PER_CLUSTERED = 20.0
"""Clustering the videos of a pool and judging it [s]."""
SECONDS_PER_FILTERED = 20.0
"""Judging a pool by the default filter with a network, the videos looked at already [s]; most of it
is clustering, where the sub-tasks of the network are not confirmed."""
SECONDS_PER_WATCHED = 5.0
"""Judging a video of two cameras of 224 pixels by the default filter, for the first time [s]; less
in proportion to the pixels."""
SECONDS_PER_PICTURED = 10.0
"""Learning a policy from pictures of 224 pixels and scoring it [s]; likewise."""
SECONDS_PER_EPISODE = 1.0
"""An episode of a policy [s]; episodes that repeat another's decisions are nearly free."""


@dataclass(frozen=True)
class Size:
    """How much is done."""

    name: str
    """quick or full."""
    people: Mapping[str, int]
    """Demonstrations by people, which teach the segmenter of the paper's level."""
    taught: int
    """Demonstrations of the robot in legal orders, which teach the segmenter of our level."""
    robot: Mapping[str, int]
    """Demonstrations of the robot that pools are drawn from."""
    epochs: int
    """Epochs of every network."""
    networks: int
    """Networks of table 1, each from another seed."""
    ladder: tuple[int, ...]
    """Labelled videos of the networks of appendix E, few to many."""
    pools: int
    """Random pools per row and fitted segmenter."""
    clustered: int
    """Random pools per row for the segmenter without labels."""
    unlabelled: tuple[int, ...]
    """Numbers of incorrect demonstrations for which the segmenter without labels is run."""
    frames: int
    """Frames per segment for the features of equation 3."""
    incorrect: tuple[int, ...]
    """Numbers of incorrect demonstrations of figure 6."""
    pixels: int
    """Side of the pictures that the policies of figure 6 learn from."""
    episodes: int
    """Episodes per policy and mode of figure 6."""
    training_seeds: int
    """Seeds of every learner of figure 6."""


SIZES: Mapping[str, Size] = MappingProxyType(
    {
        "quick": Size(
            name="quick",
            people={"seq1": 6, "seq2": 3, "seq3": 3},
            taught=6,
            robot={"seq1": 14, "seq2": 9, "seq3": 9},
            epochs=60,
            networks=1,
            ladder=(1, 3),
            pools=3,
            clustered=1,
            unlabelled=(1, 4, 8),
            frames=8,
            incorrect=(2, 8),
            pixels=128,
            episodes=4,
            training_seeds=1,
        ),
        "full": Size(
            name="full",
            people={"seq1": 20, "seq2": 10, "seq3": 6},  # the paper's 36 videos
            taught=12,
            robot={"seq1": 40, "seq2": 20, "seq3": 20},
            epochs=100,
            networks=3,
            ladder=(1, 2, 3, 6),
            pools=50,
            clustered=10,
            unlabelled=(1, 2, 4, 6, 8),
            frames=64,
            incorrect=(1, 2, 4, 6, 8),
            pixels=224,  # the paper's, section 3.2
            episodes=50,
            training_seeds=3,
        ),
    }
)
"""Every size by name."""


@dataclass(frozen=True)
class Plan:
    """What is reproduced, and from what."""

    size: Size
    """How much is done."""
    seed: int = 0
    """Seed of all banks, networks, pools and policies."""
    salads: Path | None = None
    """MS-TCN folder of 50-Salads; None where the user has none."""

    @classmethod
    def sized(cls, name: str, seed: int = 0, salads: Path | None = None) -> "Plan":
        """Return the plan of a size.

        Raises:
            ConfigError: there is no such size.
        """
        return cls(named("size", SIZES, name), seed, salads)

    def bank(self, name: str) -> Unit:
        """Return the unit that films a bank of demonstrations: people, taught or robot."""
        size = self.size
        counts: Mapping[str, Mapping[str, Any]] = {
            "people": {**size.people, "embodiment": "person"},
            "taught": {"seq1": 0, "legal": size.taught},
            "robot": size.robot,
        }
        seed = FIRST_SEED + len(counts) * self.seed + list(counts).index(name)
        options = {**counts[name], **FILMED, "seed": seed}
        seconds = demo_count(options) * SECONDS_PER_DEMO
        return Unit("bank", {"options": options}, seconds=seconds, wide=True)

    def network(self, bank: str, labelled: int | None = None, seed: int = 0) -> Unit:
        """Return the unit that fits MS-TCN++ to some or all videos of a bank."""
        videos = labelled or demo_count(self.bank(bank).spec["options"])
        spec = {"labelled": videos, "epochs": self.size.epochs, "seed": self.seed + seed}
        seconds = videos * (self.size.epochs * SECONDS_PER_EPOCH + SECONDS_PER_VIDEO)
        return Unit("network", spec, {"bank": self.bank(bank)}, seconds)

    def segmenter(self, name: str) -> Mapping[str, Unit]:
        """Return what a segmenter needs: its network, or nothing without labels."""
        banks = {PEOPLE_LEVEL: "people", ROBOT_LEVEL: "taught"}
        return {"network": self.network(banks[name])} if name in banks else {}

    def tested(self, bank: str, network: Unit) -> Unit:
        """Return the unit that scores a network on the videos of a bank it was not fitted to."""
        videos = demo_count(self.bank(bank).spec["options"])
        needs = {"bank": self.bank(bank), "network": network}
        return Unit("segmentation", {}, needs, videos * SECONDS_PER_VIDEO)
