"""What a pool is to hold, checked before anything is begun."""

from dataclasses import dataclass

import numpy as np

from teasim.common.errors import ConfigError
from teasim.render import check_cameras, check_look
from teasim.skills.demonstrators import PARTICIPANTS, Participant
from teasim.task.mistakes import Plan, spoil
from teasim.task.recipes import SEQ_1
from teasim.world.embodiments import find_embodiment
from teasim.world.looks import check_look_kind

SIZES = (32, 1024)
"""Smallest and largest side of a video [pixels]."""
OPTIONAL = ("add_sugar", "add_milk")
"""Ingredients that tea can do without, when a pool says so."""


@dataclass(frozen=True)
class GenerateConfig:
    """What a pool is to hold. Everything here decides its content; workers do not."""

    seq1: int = 10
    """Demonstrations in the optimal order, Seq_1."""
    seq2: int = 0
    """Demonstrations in the sub-optimal order, Seq_2."""
    seq3: int = 0
    """Incorrect demonstrations, Seq_3: one or two of tea bag, water and oven-off left out."""
    legal: int = 0
    """Correct demonstrations in an order drawn from all that respect the precedence."""
    mistakes: tuple[tuple[str, int], ...] = ()
    """Further incorrect demonstrations: Seq_1 with mistakes (NAME[@SUBTASK][+...], how many)."""
    optional: tuple[str, ...] = ()
    """Ingredients which every other demonstration, drawn at random, does without."""
    embodiment: str = "yumi"
    """Who demonstrates: yumi, with a joint log, or people, whose hands have none."""
    participants: int = 3
    """How many people take turns; the robot has one operator."""
    randomize: bool = True
    """Move and turn the things on the table in every demonstration."""
    match_length: bool = False
    """Draw out all demonstrations so that their length says nothing."""
    cameras: tuple[str, ...] = ("left", "cup")
    """Cameras that film."""
    size: int = 224
    """Width and height of the videos [pixels]; even."""
    quality: str = "fast"
    """Look of the pictures: fast or nice."""
    look: str = "fixed"
    """fixed, or random: light, colours, camera poses and things around differ in every video."""
    seed: int = 0
    """Seed of layouts, styles and mistakes."""

    def __post_init__(self) -> None:
        """Check every field.

        Raises:
            ConfigError: a count is negative, the pool is empty, or a name or size is unknown,
                or mistakes do not fit together.
        """
        check_cameras(self.cameras)
        check_look(self.size, self.size, self.quality)
        self._check_counts()
        self._check_who()
        for name in self.optional:
            if name not in OPTIONAL:
                raise ConfigError(
                    f"'{name}' is no optional ingredient; choose {', '.join(OPTIONAL)}."
                )
        if not SIZES[0] <= self.size <= SIZES[1] or self.size % 2:
            raise ConfigError(
                f"The size is {self.size}; choose an even number from {SIZES[0]} to {SIZES[1]}."
            )
        if self.seed < 0:
            raise ConfigError(f"The seed is {self.seed}; choose 0 or more.")

    @property
    def team(self) -> tuple[Participant, ...]:
        """Those who take turns."""
        able = [one for one in PARTICIPANTS.values() if one.embodiment == self.embodiment]
        return tuple(able[: self.participants])

    @property
    def counts(self) -> dict[str, int]:
        """How many demonstrations of every kind, by the option that asks for them."""
        sequences = {f"--{name}": getattr(self, name) for name in ("seq1", "seq2", "seq3", "legal")}
        return sequences | dict(self.mistakes)

    def _check_counts(self) -> None:
        for name, count in self.counts.items():
            if count < 0:
                raise ConfigError(f"{name} is {count}; give 0 or more demonstrations.")
        for spec, _ in self.mistakes:
            spoil(Plan(SEQ_1), spec, np.random.default_rng(0))
        if not sum(self.counts.values()):
            raise ConfigError("The pool would be empty; ask for demonstrations with --seq1 N.")

    def _check_who(self) -> None:
        find_embodiment(self.embodiment)
        check_look_kind(self.look)
        most = sum(one.embodiment == "person" for one in PARTICIPANTS.values())
        if not 1 <= self.participants <= most:
            raise ConfigError(
                f"{self.participants} participants are asked for; choose 1 to {most}."
            )
