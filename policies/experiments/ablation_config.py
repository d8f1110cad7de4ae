"""What an ablation varies, read from a TOML file and checked before any work.

    pools = ["pools/a", "pools/b"]       # folders, relative to this file
    learners = ["bc", "r-maxent"]
    seeds = [0, 1, 2]                    # of the learners
    observe = "state"
    episodes = 20

    [filters.all]                        # every demonstration counts once
    use = "ignore"
    [filters.norm]                       # without what the filter flags; its settings may follow
    use = "discard"
    [filters.equation3]
    use = "weight"
    score = "equation3"
    [filters.labels]                     # without what is incorrect by the labels of the pool
    use = "labels"

The first filter is what the others are compared with.
"""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Self

from filtering.config import FilterConfig
from policies.data.demos import DemosConfig
from policies.data.weighting import USES
from policies.learners.registry import find_learner
from policies.play.evaluation import EvaluationConfig
from policies.play.rollout import EnvironmentConfig
from teasim.common.errors import ConfigError

LABELS = "labels"
"""The use of the pool's own verdicts, as good as a filter can be; the one that reads them."""


@dataclass(frozen=True)
class FilterVariant:
    """One way to choose among the demonstrations of a pool."""

    name: str
    """What it is called in the results."""
    use: str
    """`discard`, `weight` or `ignore` as for training, or `labels`."""
    config: FilterConfig = field(default_factory=FilterConfig)
    """Settings of the filter, for `discard` and `weight`."""

    def __post_init__(self) -> None:
        """Raise ConfigError for an unknown use."""
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
class AblationConfig:
    """Pools x filters x learners x seeds, and how the policies are tried out."""

    pools: tuple[Path, ...]
    """Folders of the pools; the last part of the path names one in the results."""
    filters: tuple[FilterVariant, ...]
    """Ways to choose demonstrations; the first is what the others are compared with."""
    learners: tuple[str, ...] = ("bc",)
    """Names of learners."""
    seeds: tuple[int, ...] = (0,)
    """Seeds of the learners."""
    expert: tuple[int, ...] = ()
    """Episodes known to be good in every pool, for learners that need some."""
    observe: str = "auto"
    """What the policies see: `auto`, `pixels`, `pixels_agent_pos` or `state`."""
    episodes: int = 20
    """Episodes per policy and mode."""
    first_seed: int = 1000
    """Seed of the first episode; every policy plays the same."""
    max_actions: int = 14
    """Actions after which an episode is cut off."""
    env_id: str = EnvironmentConfig().env_id
    """Gymnasium id of the environment."""

    def __post_init__(self) -> None:
        """Raise ConfigError for what cannot be run."""
        for name in ("pools", "filters", "learners", "seeds"):
            _check_list(name, getattr(self, name))
        names = [pool.name for pool in self.pools]
        if len(set(names)) < len(names):
            raise ConfigError(f"Two pools have the same name: {', '.join(names)}.")
        kinds = [find_learner(name, "subtask") for name in self.learners]
        if any(kind.takes_experts for kind in kinds) and not self.expert:
            raise ConfigError("A learner needs demonstrations known to be good; set 'expert'.")
        DemosConfig(observe=self.observe)
        EvaluationConfig(self.episodes)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read the TOML file at `path`.

        Raises:
            ConfigError: it cannot be read, a setting is unknown, missing or of another type.
        """
        try:
            given = tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"The configuration '{path}' cannot be read.") from error
        except tomllib.TOMLDecodeError as error:
            raise ConfigError(f"The configuration '{path}' is not TOML: {error}.") from error
        _check_names(f"The configuration '{path}'", given, cls)
        missing = {"pools", "filters"} - set(given)
        if missing:
            raise ConfigError(f"The configuration '{path}' lacks '{min(missing)}'.")
        values = {name: _typed(name, value) for name, value in given.items() if name != "filters"}
        values["pools"] = tuple(path.parent / pool for pool in values["pools"])
        return cls(filters=_variants(given["filters"]), **values)


LISTS: Mapping[str, type] = {"pools": str, "learners": str, "seeds": int, "expert": int}
"""Settings that are lists, and of what."""
SINGLES: Mapping[str, type] = {
    "observe": str,
    "episodes": int,
    "first_seed": int,
    "max_actions": int,
    "env_id": str,
}
"""Settings that are one value, and which kind."""


def _typed(name: str, value: Any) -> Any:
    if name in LISTS:
        if not isinstance(value, list) or not all(type(part) is LISTS[name] for part in value):
            raise ConfigError(f"'{name}' must be a list of {LISTS[name].__name__}.")
        return tuple(value)
    if type(value) is not SINGLES[name]:
        raise ConfigError(f"'{name}' must be of type {SINGLES[name].__name__}.")
    return value


def _variants(tables: Any) -> tuple[FilterVariant, ...]:
    if not isinstance(tables, dict) or not all(isinstance(t, dict) for t in tables.values()):
        raise ConfigError("'filters' must be tables, [filters.NAME] each.")
    return tuple(_variant(name, dict(table)) for name, table in tables.items())


def _variant(name: str, settings: dict[str, Any]) -> FilterVariant:
    use = settings.pop("use", "discard")
    _check_names(f"The filter '{name}'", settings, FilterConfig)
    try:
        return FilterVariant(name, use, FilterConfig(**settings))
    except TypeError as error:
        raise ConfigError(f"The filter '{name}' has a setting of another type.") from error


def _check_names(what: str, given: Iterable[str], config: type[Any]) -> None:
    known = [part.name for part in fields(config)]
    unknown = [name for name in given if name not in known]
    if unknown:
        raise ConfigError(
            f"{what} has the unknown setting '{unknown[0]}'; choose {', '.join(known)}."
        )


def _check_list(name: str, values: tuple[Any, ...]) -> None:
    if not values:
        raise ConfigError(f"'{name}' is empty; name one or more.")
    if len(set(values)) < len(values):
        raise ConfigError(f"'{name}' holds something twice.")
