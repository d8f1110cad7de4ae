"""Finds incorrect demonstrations in a pool of videos without labels of correctness.

from filtering import DemoFilter, FilterConfig
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from filtering.config import FilterConfig
    from filtering.demo_filter import DemoFilter

__all__ = ["DemoFilter", "FilterConfig"]


def __getattr__(name: str) -> Any:
    """Import the public classes on first use, so that `import filtering` stays light."""
    if name == "DemoFilter":
        from filtering.demo_filter import DemoFilter

        return DemoFilter
    if name == "FilterConfig":
        from filtering.config import FilterConfig

        return FilterConfig
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
