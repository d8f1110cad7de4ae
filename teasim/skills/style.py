"""How a demonstrator does things: variation that is not a mistake."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Style:
    """The style of one demonstration or of one sub-task in it."""

    tempo: float = 1.7
    """Speed of all motions relative to the nominal one."""
    lift: float = 0.07
    """Height by which things are lifted before they are carried [m]."""
    bow: float = 0.0
    """Sideways bow of the free motions between READY and an object [rad of the base joint, m]."""
    pause: float = 0.3
    """Rest before each sub-task [s]."""
    stir_turns: float = 3.0
    """Turns of the spoon in the cup."""
    hand: str | None = None
    """Preferred hand where the embodiment can use either; None leaves it to the skill."""
    hesitation: float = 0.0
    """Stop in front of a thing before it is grasped [s]."""
    regrasp: bool = False
    """Whether a thing is grasped, released, and grasped again."""
