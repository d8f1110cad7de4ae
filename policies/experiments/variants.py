"""What an ablation varies: ways to choose demonstrations, and learners with their settings."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from filtering.config import FilterConfig
from policies.data.weighting import USES
from policies.learners.options import read_options
from policies.learners.registry import LearnerKind, find_learner
from teasim.common.errors import ConfigError

LABELS = "labels"
"""The use of the pool's own labels, an upper bound for a filter; no other use reads them."""
FILE_NAME = re.compile(r"[\w.+-]+")
"""Names that can be part of a file name."""


@dataclass(frozen=True)
class FilterVariant:
    """One way to choose among the demonstrations of a pool."""

    name: str
    """Name in the results."""
    use: str
    """`discard`, `weight` or `ignore` as for training, or `labels`."""
    config: FilterConfig = field(default_factory=FilterConfig)
    """Settings of the filter, for `discard` and `weight`."""

    def __post_init__(self) -> None:
        """Raise ConfigError for an unknown use."""
        check_file_name("filter", self.name)
        choices = (*USES, LABELS)
        if self.use not in choices:
            raise ConfigError(
                f"The filter '{self.name}' has the unknown use '{self.use}'; "
                f"choose {', '.join(choices)}."
            )

    @property
    def runs(self) -> bool:
        """Whether the filter has to be run."""
        return self.use in ("discard", "weight")


@dataclass(frozen=True)
class LearnerVariant:
    """A learner with settings of its own."""

    name: str
    """Name in the results."""
    learner: str
    """Name of the learner."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Settings that differ from the learner's defaults."""

    def __post_init__(self) -> None:
        """Raise ConfigError for an unknown learner or setting, or a value of another type."""
        check_file_name("learner", self.name)
        read_options(self.learner, self.kind, self.settings)

    @property
    def kind(self) -> LearnerKind:
        """Row of the learner in the registry."""
        return find_learner(self.learner, "subtask")


def read_filters(tables: Any) -> tuple[FilterVariant, ...]:
    """Read the tables [filters.NAME] of a configuration.

    Raises:
        ConfigError: it is not a table of tables, or a setting is unknown or of another type.
    """
    if not _are_tables(tables):
        raise ConfigError("'filters' must be tables, [filters.NAME] each.")
    return tuple(_filter(name, dict(table)) for name, table in tables.items())


def read_learners(given: Any) -> tuple[LearnerVariant, ...]:
    """Read a list of learners, or the tables [learners.NAME] of a configuration.

    The key `learner` of a table is the learner, by default the table's name; all other keys are
    settings of that learner.

    Raises:
        ConfigError: it is neither, or a learner or setting is unknown, or a value is of another
            type.
    """
    if isinstance(given, list) and all(isinstance(name, str) for name in given):
        return tuple(LearnerVariant(name, name) for name in given)
    if not _are_tables(given):
        raise ConfigError("'learners' must be a list of str, or tables, [learners.NAME] each.")
    return tuple(
        LearnerVariant(name, str(table.get("learner", name)), _without(table, "learner"))
        for name, table in given.items()
    )


def check_names(what: str, given: Iterable[str], config: type[Any]) -> None:
    """Raise ConfigError unless all names `given` are fields of the dataclass `config`."""
    known = [part.name for part in fields(config)]
    unknown = [name for name in given if name not in known]
    if unknown:
        raise ConfigError(
            f"{what} has the unknown setting '{unknown[0]}'; choose {', '.join(known)}."
        )


def check_file_name(what: str, name: str) -> None:
    """Raise ConfigError unless `name` can be part of a file name."""
    if not FILE_NAME.fullmatch(name):
        raise ConfigError(
            f"The {what} '{name}' names files; use letters, digits, '_', '.', '+' and '-' only."
        )


def _filter(name: str, settings: dict[str, Any]) -> FilterVariant:
    use = settings.pop("use", "discard")
    check_names(f"The filter '{name}'", settings, FilterConfig)
    try:
        return FilterVariant(name, use, FilterConfig(**settings))
    except TypeError as error:
        raise ConfigError(f"The filter '{name}' has a setting of another type.") from error


def _are_tables(given: Any) -> bool:
    return isinstance(given, dict) and all(isinstance(table, dict) for table in given.values())


def _without(table: Mapping[str, Any], key: str) -> dict[str, Any]:
    return {name: value for name, value in table.items() if name != key}
