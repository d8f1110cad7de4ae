"""The settings of a pool, checked before anything is begun; the options of `teasim generate`.

Simulator and skills are imported only when settings are checked, so that `--help` stays quick.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import tyro
from tyro.constructors import PrimitiveConstructorSpec

from teasim.common.errors import ConfigError
from teasim.task.recipes import OPTIONAL
from teasim.world.pictures import check_cameras, check_picture

if TYPE_CHECKING:
    from teasim.skills.demonstrators import Participant

SIZES = (32, 1024)
"""Smallest and largest side of a video [pixels]."""
MOST_NOISE = 0.01
"""Largest execution noise [rad], with which about two of three attempts fail; with 0.02 all do."""
MISTAKE_FORMAT = "NAME[@SUBTASK][+NAME...][:COUNT]"
"""How a mistake and a count are written on the command line."""

Mistakes = tuple[tuple[str, int], ...]
"""Specifications NAME[@SUBTASK][+NAME...], each with a number of demonstrations."""


def parse_mistakes(words: Sequence[str]) -> Mistakes:
    """Read words of the form NAME[@SUBTASK][+NAME...][:COUNT].

    Raises:
        ConfigError: a count is not a number, or a name is given twice.
    """
    counts: dict[str, int] = {}
    for word in words:
        name, _, count = word.partition(":")
        if name in counts:
            raise ConfigError(f"The mistake '{name}' is given twice; write it once as NAME:COUNT.")
        if count and not count.isdecimal():
            raise ConfigError(f"'{word}' is no mistake with a count; write {MISTAKE_FORMAT}.")
        counts[name] = int(count or 1)
    return tuple(counts.items())


_MISTAKES = PrimitiveConstructorSpec[Mistakes](
    nargs="*",
    metavar=MISTAKE_FORMAT,
    instance_from_str=lambda words: parse_mistakes(words),
    is_instance=lambda value: isinstance(value, tuple),
    str_from_instance=lambda value: [f"{name}:{count}" for name, count in value],
)


@dataclass(frozen=True)
class PoolOptions:
    """The settings of a pool as they are given; `GenerateConfig` checks them."""

    seq1: int = 10
    """Demonstrations in the optimal order, Seq_1."""
    seq2: int = 0
    """Demonstrations in the sub-optimal order, Seq_2, in which the tea bag comes late."""
    seq3: int = 0
    """Incorrect demonstrations, Seq_3, without one or two of tea bag, water and oven-off."""
    legal: int = 0
    """Correct demonstrations in a random order that respects the precedence."""
    mistakes: Annotated[Mistakes, _MISTAKES] = ()
    """Further incorrect demonstrations: Seq_1 with mistakes, for example skip@add_milk:2. The
    mistakes are skip, wrong_order, repeat, ineffective, wrong_object and abandoned."""
    optional: tuple[str, ...] = ()
    """Sub-tasks that a random half of the demonstrations leave out correctly: add_sugar,
    add_milk."""
    embodiment: str = "yumi"
    """Who demonstrates: yumi, with a joint log, or person, without one."""
    participants: int = 3
    """Number of people who take turns, 1 to 3; the robot has a single operator."""
    randomize: bool = True
    """Move and turn the things on the table in every demonstration; otherwise each demonstration
    starts with everything in its nominal place."""
    match_length: bool = False
    """Add rests so that the length of a demonstration does not depend on its sub-tasks."""
    cameras: Annotated[tuple[str, ...], tyro.conf.arg(name="camera")] = ("left", "cup")
    """Cameras that film: left, cup, front, top."""
    video: bool = True
    """Film the demonstrations; a pool without video holds the joint log alone, needs no OpenGL and
    takes 2 to 3 s of one core per demonstration."""
    size: int = 224
    """Width and height of the videos [pixels], an even number."""
    quality: str = "fast"
    """Quality of the pictures: fast, or nice, with shadows and smooth edges, which renders 20 to 40
    times slower."""
    look: str = "fixed"
    """Look of the station: fixed, or random, where light, colours, camera poses and distractors
    differ in every video."""
    execution_noise: float = 0.0
    """Standard deviation of a slow random disturbance of the executed joint targets [rad], at most
    0.01; 0.005 is a good start. The logged actions stay the planned targets, so the pool shows
    recoveries."""
    seed: int = 0
    """Seed of everything random; the same seed gives the same files."""


@dataclass(frozen=True)
class GenerateConfig(PoolOptions):
    """The settings of a pool, checked. They alone decide its content."""

    def __post_init__(self) -> None:
        """Check every field.

        Raises:
            ConfigError: a count is negative, the pool is empty, a name or size is unknown,
                mistakes do not fit together, or a person is to have a joint log.
        """
        check_cameras(self.cameras)
        check_picture(self.size, self.size, self.quality)
        self._check_counts()
        self._check_participants()
        self._check_log()
        for name in self.optional:
            if name not in OPTIONAL:
                raise ConfigError(f"'{name}' is not optional; choose {', '.join(OPTIONAL)}.")
        if not SIZES[0] <= self.size <= SIZES[1] or self.size % 2:
            raise ConfigError(
                f"The size is {self.size}; choose an even number from {SIZES[0]} to {SIZES[1]}."
            )
        if self.seed < 0:
            raise ConfigError(f"The seed is {self.seed}; choose 0 or more.")

    @property
    def filming(self) -> tuple[str, ...]:
        """The cameras that film; none without video."""
        return self.cameras if self.video else ()

    @property
    def noisy(self) -> bool:
        """Whether the execution is disturbed."""
        return self.execution_noise > 0

    @property
    def team(self) -> "tuple[Participant, ...]":
        """The participants who take turns."""
        from teasim.skills.demonstrators import PARTICIPANTS

        able = [one for one in PARTICIPANTS.values() if one.embodiment == self.embodiment]
        return tuple(able[: self.participants])

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of demonstrations by the option that asks for them."""
        sequences = {f"--{name}": getattr(self, name) for name in ("seq1", "seq2", "seq3", "legal")}
        return sequences | dict(self.mistakes)

    def _check_counts(self) -> None:
        import numpy as np

        from teasim.task.mistakes import Plan, spoil
        from teasim.task.recipes import SEQ_1

        for name, count in self.counts.items():
            if count < 0:
                raise ConfigError(f"{name} is {count}; give 0 or more demonstrations.")
        for spec, _ in self.mistakes:
            spoil(Plan(SEQ_1), spec, np.random.default_rng(0))
        if not sum(self.counts.values()):
            raise ConfigError("The pool would be empty; ask for demonstrations with --seq1 N.")

    def _check_participants(self) -> None:
        from teasim.skills.demonstrators import PARTICIPANTS
        from teasim.world.looks.look import check_look_kind

        check_look_kind(self.look)
        most = max(Counter(one.embodiment for one in PARTICIPANTS.values()).values())
        if not 1 <= self.participants <= most:
            raise ConfigError(
                f"The number of participants is {self.participants}; choose 1 to {most}."
            )

    def _check_log(self) -> None:
        from teasim.world.bodies.embodiments import find_embodiment

        logged = find_embodiment(self.embodiment).logged
        if not 0 <= self.execution_noise <= MOST_NOISE:
            raise ConfigError(
                f"The execution noise is {self.execution_noise} rad; choose 0 to {MOST_NOISE}."
            )
        for option, given in (("--no-video", not self.video), ("--execution-noise", self.noisy)):
            if given and not logged:
                raise ConfigError(
                    f"{option} needs a joint log, and '{self.embodiment}' has none; "
                    "choose --embodiment yumi."
                )
