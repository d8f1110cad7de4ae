"""Named sets of pools."""

from collections.abc import Mapping
from types import MappingProxyType

from teasim.common.registry import named
from teasim.generation.config import GenerateConfig

PRESETS: Mapping[str, Mapping[str, GenerateConfig]] = MappingProxyType(
    {
        # The paper (section 4): 36 videos of three people and 12 of a tele-operated YuMi, most of
        # them Seq_1. It does not say how many of the others; its pools need 4 Seq_2 and 2 Seq_3.
        "paper": {
            "people": GenerateConfig(seq1=20, seq2=10, seq3=6, embodiment="person"),
            "yumi": GenerateConfig(seq1=6, seq2=4, seq3=2),
        },
    }
)
"""Settings of pools by their folder; people have no joint log and need a pool of their own."""


def find_preset(name: str) -> Mapping[str, GenerateConfig]:
    """Return the pools of a preset.

    Raises:
        ConfigError: there is none of that name.
    """
    return named("preset", PRESETS, name)
