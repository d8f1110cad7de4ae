"""Things that are chosen by name."""

from collections.abc import Mapping
from typing import TypeVar

from teasim.common.errors import ConfigError

Registered = TypeVar("Registered")


def named(what: str, registry: Mapping[str, Registered], name: str) -> Registered:
    """Return what a registry has under a name; `what` says of which kind it is.

    Raises:
        ConfigError: it has nothing under that name.
    """
    if name not in registry:
        raise ConfigError(f"Unknown {what} '{name}'; choose {', '.join(registry)}.")
    return registry[name]
