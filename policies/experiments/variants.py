"""What an ablation varies: pools, ways to choose demonstrations, and learners with settings."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from filtering.config import FilterConfig
from policies.data.weighting import USES
from policies.learners.options import read_options
from policies.learners.registry import LearnerKind, find_learner
from teasim.common.errors import ConfigError

LABELS, RANDOM, LENGTH = "labels", "random", "length"
"""Uses that choose without a filter: by the pool's own labels, an upper bound for a filter; at
random; the shortest."""
CHOSEN = (LABELS, RANDOM, LENGTH)
"""All of these."""
FROM_ELSEWHERE = ("table", "command")
"""Settings by which somebody else's weight table is used; one of them, in place of settings of the
filter."""
OWN: Mapping[str, type] = {"like": str, "seed": int, "table": str, "command": str}
"""Settings of a filter in an ablation that are none of the filter's, and their types."""
FILE_NAME = re.compile(r"[\w.+-]+")
"""Names that can be part of a file name."""


@dataclass(frozen=True)
class PoolVariant:
    """A pool that exists, or the options of `teasim generate` from which it is made."""

    name: str
    """Name in the results."""
    folder: Path | None = None
    """Where it is; None: it is made."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Options of `teasim generate`."""
    incorrect: int | None = None
    """How many of its demonstrations labelled incorrect belong to it, the first ones; None: all."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a name that is not one of files, or a folder with options."""
        check_file_name("pool", self.name)
        if self.incorrect is not None and (type(self.incorrect) is not int or self.incorrect < 0):
            raise ConfigError(
                f"'incorrect' of the pool '{self.name}' must be a whole number, 0 or more."
            )
        if self.folder is not None and self.options:
            raise ConfigError(
                f"The pool '{self.name}' has a folder, so it takes no options of generate; leave "
                f"out '{next(iter(self.options))}'."
            )


@dataclass(frozen=True)
class FilterVariant:
    """One way to choose among the demonstrations of a pool."""

    name: str
    """Name in the results."""
    use: str
    """`discard`, `weight` or `ignore` as for training, or one of CHOSEN."""
    config: FilterConfig = field(default_factory=FilterConfig)
    """Settings of the filter, for `discard` and `weight`."""
    like: str = ""
    """For `random` and `length`: the filter of which as many demonstrations are left out; empty: as
    many as are labelled incorrect."""
    seed: int = 0
    """Seed of `random`."""
    table: str = ""
    """File of a weight table in place of the filter; {pool} stands for the pool's name."""
    command: str = ""
    """Command that writes a weight table, in place of the filter; {pool} stands for the folder of
    the pool and {table} for the file to write."""

    def __post_init__(self) -> None:
        """Raise ConfigError for an unknown use, or settings that exclude each other."""
        check_file_name("filter", self.name)
        choices = (*USES, *CHOSEN)
        if self.use not in choices:
            raise ConfigError(
                f"The filter '{self.name}' has the unknown use '{self.use}'; "
                f"choose {', '.join(choices)}."
            )
        given = [name for name in FROM_ELSEWHERE if getattr(self, name)]
        if given and (len(given) > 1 or self.use not in ("discard", "weight")):
            raise ConfigError(
                f"The filter '{self.name}' takes one of {' and '.join(FROM_ELSEWHERE)}, with the "
                "use discard or weight."
            )
        if self.like and self.use not in (RANDOM, LENGTH):
            raise ConfigError(
                f"The filter '{self.name}' takes 'like' only with the use {RANDOM} or {LENGTH}."
            )
        if "{table}" not in self.command and self.command:
            raise ConfigError(
                f"The command of the filter '{self.name}' lacks {{table}}, the file to write."
            )


@dataclass(frozen=True)
class LearnerVariant:
    """A learner with settings of its own."""

    name: str
    """Name in the results."""
    learner: str
    """Name of the learner."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Settings that differ from the learner's defaults."""
    level: str = "subtask"
    """What it chooses: subtask or joint."""

    def __post_init__(self) -> None:
        """Raise ConfigError for an unknown learner or setting, or a value of another type."""
        check_file_name("learner", self.name)
        read_options(self.learner, self.kind, self.settings)

    @property
    def kind(self) -> LearnerKind:
        """Row of the learner in the registry."""
        return find_learner(self.learner, self.level)


def read_pools(given: Any, home: Path) -> tuple[PoolVariant, ...]:
    """Read a list of folders relative to `home`, or the tables [pools.NAME] of a configuration.

    The key `folder` of a table is where a pool is, and `incorrect` how many of its demonstrations
    that are labelled incorrect belong to it; all other keys are options of `teasim generate`, by
    which the pool is made.

    Raises:
        ConfigError: it is neither.
    """
    if isinstance(given, list) and all(isinstance(path, str) for path in given):
        return tuple(PoolVariant(Path(path).name, home / path) for path in given)
    if not _are_tables(given):
        raise ConfigError("'pools' must be a list of str, or tables, [pools.NAME] each.")
    return tuple(
        PoolVariant(
            name,
            home / str(table["folder"]) if "folder" in table else None,
            _without(table, "folder", "incorrect"),
            table.get("incorrect"),
        )
        for name, table in given.items()
    )


def read_filters(tables: Any, segmenter: str = "auto") -> tuple[FilterVariant, ...]:
    """Read the tables [filters.NAME] of a configuration; `segmenter` is for those that name none.

    Raises:
        ConfigError: it is not a table of tables, or a setting is unknown or of another type.
    """
    if not _are_tables(tables):
        raise ConfigError("'filters' must be tables, [filters.NAME] each.")
    found = tuple(_filter(name, dict(table), segmenter) for name, table in tables.items())
    names = [variant.name for variant in found]
    for variant in found:
        if variant.like and variant.like not in names:
            raise ConfigError(
                f"The filter '{variant.name}' is like '{variant.like}', which is no filter of the "
                f"configuration; choose {', '.join(names)}."
            )
    return found


def read_learners(given: Any) -> tuple[LearnerVariant, ...]:
    """Read a list of learners, or the tables [learners.NAME] of a configuration.

    The key `learner` of a table is the learner, by default the table's name, and the key `level`
    its level, by default subtask; all other keys are settings of that learner.

    Raises:
        ConfigError: it is neither, or a learner or setting is unknown, or a value is of another
            type.
    """
    if isinstance(given, list) and all(isinstance(name, str) for name in given):
        return tuple(LearnerVariant(name, name) for name in given)
    if not _are_tables(given):
        raise ConfigError("'learners' must be a list of str, or tables, [learners.NAME] each.")
    return tuple(
        LearnerVariant(
            name,
            str(table.get("learner", name)),
            _without(table, "learner", "level"),
            str(table.get("level", "subtask")),
        )
        for name, table in given.items()
    )


def check_names(
    what: str, given: Iterable[str], config: type[Any], *, without: tuple[str, ...] = ()
) -> None:
    """Raise ConfigError unless all names `given` are fields of the dataclass `config`.

    Fields in `without` are not known either.
    """
    known = [part.name for part in fields(config) if part.name not in without]
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


def _filter(name: str, settings: dict[str, Any], segmenter: str) -> FilterVariant:
    use = settings.pop("use", "discard")
    own = {key: settings.pop(key) for key in OWN if key in settings}
    check_names(f"The filter '{name}'", settings, FilterConfig)
    for key, value in own.items():
        if type(value) is not OWN[key]:
            raise ConfigError(
                f"'{key}' of the filter '{name}' must be of type {OWN[key].__name__}."
            )
    if settings and (use in CHOSEN or set(own) & set(FROM_ELSEWHERE)):
        raise ConfigError(
            f"The filter '{name}' does not run ours, so it takes no '{next(iter(settings))}'."
        )
    try:
        config = FilterConfig(**{"segmenter": segmenter, **settings})
        return FilterVariant(name, use, config, **own)
    except TypeError as error:
        raise ConfigError(f"The filter '{name}' has a setting of another type.") from error


def _are_tables(given: Any) -> bool:
    return isinstance(given, dict) and all(isinstance(table, dict) for table in given.values())


def _without(table: Mapping[str, Any], *keys: str) -> dict[str, Any]:
    return {name: value for name, value in table.items() if name not in keys}
