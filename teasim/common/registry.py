"""Lookup of registered entries by name."""

from collections.abc import Mapping
from typing import TypeVar

from teasim.common.errors import ConfigError

Registered = TypeVar("Registered")


def named(what: str, registry: Mapping[str, Registered], name: str) -> Registered:
    """Return the entry called `name`; `what` names the kind of entry in messages.

    Raises:
        ConfigError: there is no such entry.
    """
    if name not in registry:
        raise ConfigError(f"Unknown {what} '{name}'; choose {', '.join(registry)}.")
    return registry[name]
