"""Pools of demonstrations: planned, carried out in physics, checked, and written with video.

The names below are imported when they are first used: the settings alone need no simulator.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from teasim.generation.config import GenerateConfig
    from teasim.generation.making import Generated, generate
    from teasim.generation.plan import DemoPlan, plan_pool
    from teasim.generation.recording import demo_rng

__all__ = ["DemoPlan", "GenerateConfig", "Generated", "demo_rng", "generate", "plan_pool"]

_MODULES = {
    "DemoPlan": "plan",
    "GenerateConfig": "config",
    "Generated": "making",
    "demo_rng": "recording",
    "generate": "making",
    "plan_pool": "plan",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for from the module that defines it."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
