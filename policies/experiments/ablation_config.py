"""The configuration of an ablation, read from a TOML file and checked before any work.

    pools = ["pools/a", "pools/b"]       # folders, relative to this file; or tables, see below
    seeds = [0, 1, 2]                    # of the learners
    observe = "state"
    episodes = 20

    [learners.bc]                        # all defaults; short form: learners = ["bc", "r-maxent"]
    [learners.large]                     # a learner under another name, with settings of its own
    learner = "bc-rnn"
    hidden = 128

    [filters.all]                        # every demonstration counts once
    use = "ignore"
    [filters.norm]                       # without the flagged demonstrations; settings may follow
    use = "discard"
    [filters.equation3]
    use = "weight"
    score = "equation3"
    [filters.labels]                     # without the demonstrations labelled incorrect
    use = "labels"
    [filters.random]                     # without as many, drawn at random; length: the shortest
    use = "random"
    like = "norm"
    [filters.theirs]                     # somebody else's filter
    use = "weight"
    command = "mytool {pool} --out {table}"
    [filters.stored]                     # a weight table that exists
    use = "discard"
    table = "tables/{pool}.csv"

`pools` can also be tables, [pools.NAME] each, with `folder` or with options of `teasim generate`,
and with `incorrect`, the number of demonstrations labelled incorrect that belong to it.

The other filters are compared with the first one.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from policies.data.demos import DemosConfig
from policies.experiments.variants import (
    FilterVariant,
    LearnerVariant,
    PoolVariant,
    check_names,
    read_filters,
    read_learners,
    read_pools,
)
from policies.learners.registry import EXPERTS
from policies.settings import EvaluationConfig
from teasim.common.errors import ConfigError


@dataclass(frozen=True)
class AblationConfig:
    """Pools x filters x learners x seeds, and how the policies are evaluated."""

    pools: tuple[PoolVariant, ...]
    """Pools; the last part of a folder is the pool's name in the results."""
    filters: tuple[FilterVariant, ...]
    """Ways to choose demonstrations; the others are compared with the first one."""
    learners: tuple[LearnerVariant, ...] = (LearnerVariant("bc", "bc"),)
    """Learners and their settings."""
    seeds: tuple[int, ...] = (0,)
    """Seeds of the learners."""
    expert: tuple[int, ...] = ()
    """Episodes known to be good in every pool, for learners that need experts."""
    experts: int = 0
    """In place of `expert`: how many demonstrations of each pool, the first that are labelled
    correct, are known to be good."""
    segmenter: str = "auto"
    """Source of the segments for filters that name none."""
    observe: str = "auto"
    """What the policies see: `auto`, `pixels`, `pixels_agent_pos` or `state`."""
    episodes: int = 20
    """Episodes per policy and mode."""
    first_seed: int = 1000
    """Seed of the first episode; every policy runs in the same episodes."""
    max_actions: int = 14
    """Actions after which an episode is truncated."""
    env_id: str | None = None
    """Gymnasium id of the environment; None: TeaMakingSubtasks-v0."""
    joint_env_id: str | None = None
    """Gymnasium id of the environment for learners of the level joint; None: TeaMaking-v0."""
    home: Path = Path()
    """Folder of the configuration, to which its files are relative."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a configuration that cannot be run."""
        for name in ("pools", "filters", "learners", "seeds"):
            _check_list(name, getattr(self, name))
        names = [pool.name for pool in self.pools]
        if len(set(names)) < len(names):
            raise ConfigError(f"Two pools have the same name: {', '.join(names)}.")
        needy = [variant.name for variant in self.learners if EXPERTS in variant.kind.needs]
        if needy and not (self.expert or self.experts):
            raise ConfigError(
                f"The learner '{needy[0]}' needs demonstrations known to be good; set 'expert' "
                "(their episodes) or 'experts' (how many of those labelled correct)."
            )
        parts = [pool.name for pool in self.pools if pool.incorrect is not None]
        theirs = [variant.name for variant in self.filters if variant.command]
        if parts and theirs:
            raise ConfigError(
                f"The pool '{parts[0]}' is a part of a folder ('incorrect'), which the command of "
                f"the filter '{theirs[0]}' cannot be told; leave out one of them."
            )
        if self.expert and self.experts:
            raise ConfigError("Both 'expert' and 'experts' were given; choose one.")
        DemosConfig(observe=self.observe)
        EvaluationConfig(self.episodes)

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read the TOML file at `path`.

        Raises:
            ConfigError: it cannot be read, or a setting is unknown, missing or of another type.
        """
        try:
            given = tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"The configuration '{path}' cannot be read.") from error
        except tomllib.TOMLDecodeError as error:
            raise ConfigError(f"The configuration '{path}' is not TOML: {error}.") from error
        check_names(f"The configuration '{path}'", given, cls, without=("home",))
        missing = {"pools", "filters"} - set(given)
        if missing:
            raise ConfigError(f"The configuration '{path}' lacks '{min(missing)}'.")
        values = {name: _typed(name, value) for name, value in given.items() if name not in TABLES}
        values["pools"] = read_pools(given["pools"], path.parent)
        if "learners" in given:
            values["learners"] = read_learners(given["learners"])
        filters = read_filters(given["filters"], values.get("segmenter", cls.segmenter))
        return cls(filters=filters, home=path.parent, **values)


TABLES = ("pools", "filters", "learners")
"""Settings that are tables."""
LISTS: Mapping[str, type] = {"seeds": int, "expert": int}
"""Settings that are lists, and the type of their items."""
SINGLES: Mapping[str, type] = {
    "observe": str,
    "experts": int,
    "segmenter": str,
    "episodes": int,
    "first_seed": int,
    "max_actions": int,
    "env_id": str,
    "joint_env_id": str,
}
"""Settings that are a single value, and its type."""


def _typed(name: str, value: Any) -> Any:
    if name in LISTS:
        if not isinstance(value, list) or not all(type(part) is LISTS[name] for part in value):
            raise ConfigError(f"'{name}' must be a list of {LISTS[name].__name__}.")
        return tuple(value)
    if type(value) is not SINGLES[name]:
        raise ConfigError(f"'{name}' must be of type {SINGLES[name].__name__}.")
    return value


def _check_list(name: str, values: tuple[Any, ...]) -> None:
    if not values:
        raise ConfigError(f"'{name}' is empty; name one or more.")
    if len({str(value) for value in values}) < len(values):
        raise ConfigError(f"'{name}' has a duplicate entry.")
