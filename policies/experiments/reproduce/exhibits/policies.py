"""Figure 6: policy accuracy over the number of incorrect demonstrations, filtered or not.

The policies learn from pictures and joint positions, as those of the demo do. The same with the
state of the environment in place of pictures shows what the pictures cost.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pyarrow.parquet as pq

from policies.experiments.ablation import run_plan
from policies.experiments.ablation_config import AblationConfig
from policies.experiments.reproduce.exhibits.exhibit import Exhibit, Table
from policies.experiments.reproduce.paper import CORRECT
from policies.experiments.reproduce.plan import (
    FIRST_SEED,
    SECONDS_PER_DEMO,
    SECONDS_PER_EPISODE,
    SECONDS_PER_PICTURED,
    SECONDS_PER_WATCHED,
    Plan,
)
from policies.experiments.units import Result, Store, Unit
from policies.experiments.variants import FilterVariant, LearnerVariant, PoolVariant
from policies.play.evaluation import MODES
from teasim.common.figures import AccuracyFigure, Drawing
from teasim.common.figures.accuracy import Point
from teasim.common.workers import Workers

PICTURES, STATE = "pixels_agent_pos", "state"
"""What policies see: pictures of all cameras and joint positions, or the state."""
LEARNERS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {PICTURES: ("bc", "bc-rnn"), STATE: ("bc", "bc-rnn", "demodice", "r-maxent")}
)
"""Learners of the figure, by what their policies see."""
SEEN: Mapping[str, str] = MappingProxyType({PICTURES: "pictures", STATE: "state"})
"""What policies see, in a word."""
UNFILTERED, FILTERED, ORACLE = "all", "filtered", "oracle"
"""Training sets: all demonstrations, those that the default filter does not flag, and those that
are labelled correct."""
SIMPLE = ("length", "random")
"""Further training sets: without as many as the filter flags, the shortest or any."""
EXPERTS = 2
"""Demonstrations that DemoDICE is told to be good, the first that are labelled correct."""
POOL_SEED = FIRST_SEED + 100
"""Seed of the pool without incorrect demonstrations; K is added, so that no bank has the same."""


def units(plan: Plan) -> dict[tuple[int, str], Unit]:
    """Return a unit for each number K of incorrect demonstrations and what policies see."""
    return {(k, seen): _unit(plan, k, seen) for k in plan.size.incorrect for seen in LEARNERS}


def _unit(plan: Plan, k: int, seen: str) -> Unit:
    size = plan.size
    spec = {
        "learners": list(LEARNERS[seen]),
        "observe": seen,
        "seeds": list(range(size.training_seeds)),
        "episodes": size.episodes,
        "experts": EXPERTS,
    }
    policies = (3 + len(SIMPLE)) * len(LEARNERS[seen]) * size.training_seeds
    seconds = policies * len(MODES) * size.episodes * SECONDS_PER_EPISODE / 2
    needs = {"bank": _bank(plan, k)}
    if seen == PICTURES:
        looking = (CORRECT + k) * SECONDS_PER_WATCHED + policies * SECONDS_PER_PICTURED
        seconds += looking * (size.pixels / 224) ** 2
    else:
        needs["filtered"] = _unit(plan, k, PICTURES)
    return Unit("policies", spec, needs, seconds, wide=True)


def _bank(plan: Plan, k: int) -> Unit:
    seed = POOL_SEED + 100 * plan.seed + k
    options = {"seq1": CORRECT, "seq3": k, "size": plan.size.pixels, "seed": seed}
    return Unit("bank", {"options": options}, seconds=(CORRECT + k) * SECONDS_PER_DEMO, wide=True)


def run_policies(unit: Unit, store: Store, workers: Workers) -> Result:
    """Filter a pool from its videos, and train and score all policies; resumed policy by policy."""
    out = store.folder_of(unit)
    run_plan(config_of(unit, store), out, workers)
    return {name: _plain(out / f"{name}.parquet") for name in ("results", "detection")}


def config_of(unit: Unit, store: Store) -> AblationConfig:
    """Return the ablation of a unit; a pool is filtered once, whatever policies see."""
    spec = unit.spec
    stored = ""
    if "filtered" in unit.needs:
        tables = store.folder_of(unit.needs["filtered"]) / "filters"
        stored = str((tables / f"pool--{FILTERED}.csv").resolve())
    return AblationConfig(
        pools=(PoolVariant("pool", store.folder_of(unit.needs["bank"]).resolve()),),
        filters=(
            FilterVariant(UNFILTERED, "ignore"),
            FilterVariant(FILTERED, "discard", table=stored),
            FilterVariant(ORACLE, "labels"),
            *(FilterVariant(name, name, like=FILTERED) for name in SIMPLE),
        ),
        learners=tuple(LearnerVariant(name, name) for name in spec["learners"]),
        seeds=tuple(spec["seeds"]),
        experts=spec["experts"],
        observe=spec["observe"],
        episodes=spec["episodes"],
    )


def _plain(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a Parquet file, None in place of nan."""
    return [
        {
            name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in row.items()
        }
        for row in pq.read_table(path).to_pylist()
    ]


def table(plan: Plan, store: Store) -> Table:
    """Return a row per K, what policies see, learner, training set, mode and training seed."""
    rows = result_rows(plan, store)
    words = []
    for k in plan.size.incorrect:
        found = store.read(_unit(plan, k, PICTURES))["detection"]
        flagged = next(row for row in found if row["filter"] == FILTERED)
        words.append(
            f"{CORRECT} + {k}: the filter found {flagged['recall']:.0%} of the incorrect and "
            f"accused {flagged['false_alarms']:.0%} of the correct demonstrations."
        )
    words += [_sentence(rows, key) for key in series(rows)]
    note = (
        "Ours is the default filter, from the videos alone; policies learn the next sub-task and "
        "are told when one ends. Differences are to all demonstrations, in the same scenes, with "
        "95 % intervals; with several training seeds, values and ends of intervals are their "
        "means. The oracle leaves out what is labelled incorrect; length and random leave out as "
        "many as ours."
    )
    return Table(rows, words, notes=(note,))


def result_rows(plan: Plan, store: Store) -> list[dict[str, Any]]:
    """Return the rows of the table."""
    return [
        {
            "incorrect": k,
            "sees": SEEN[seen],
            "learner": row["learner"],
            "trained on": row["filter"],
            "decisions": row["mode"],
            "training seed": row["seed"],
            "episodes": row["episodes"],
            **{name: row[name] for name in row if name.startswith("policy_accuracy")},
            **{name: row[name] for name in row if name.startswith("difference")},
            "goal reached": row["success"],
        }
        for (k, seen), unit in units(plan).items()
        for row in store.read(unit)["results"]
    ]


Key = tuple[str, str, str]
"""What policies see, their learner, and how they decide."""


def series(rows: Sequence[Mapping[str, Any]]) -> list[Key]:
    """Return the combinations that have a figure and a sentence of their own."""
    return list(dict.fromkeys((r["sees"], r["learner"], r["decisions"]) for r in rows))


def mean(rows: Sequence[Mapping[str, Any]], key: Key, name: str, k: int, column: str) -> float:
    """Return the mean of a column over the training seeds of a training set and K."""
    found = [
        row[column]
        for row in rows
        if (row["sees"], row["learner"], row["decisions"]) == key
        and (row["trained on"], row["incorrect"]) == (name, k)
    ]
    return float(sum(found) / len(found))


def _sentence(rows: Sequence[Mapping[str, Any]], key: Key) -> str:
    """Write what filtering changed at the largest K."""
    k = max(row["incorrect"] for row in rows)
    low, high = (100 * mean(rows, key, FILTERED, k, f"difference_{end}") for end in ("low", "high"))
    verdict = "helps" if low > 0 else "harms" if high < 0 else "makes no difference that shows"
    on = {
        name: f"{100 * mean(rows, key, name, k, 'policy_accuracy'):.1f} %"
        for name in (UNFILTERED, FILTERED, ORACLE, *SIMPLE)
    }
    sees, learner, mode = key
    return (
        f"{learner} from {sees}, {mode} decisions, {CORRECT} + {k}: policy accuracy "
        f"{on[UNFILTERED]} on all, {on[FILTERED]} filtered ({low:+.1f} to {high:+.1f} points), "
        f"{on[ORACLE]} without what is labelled incorrect, {on['length']} without the shortest, "
        f"{on['random']} without as many at random: filtering {verdict}."
    )


def figures(plan: Plan, store: Store) -> dict[str, Drawing]:
    """Return policy accuracy over K of every training set."""
    rows = result_rows(plan, store)

    def point(key: Key, name: str, k: int) -> Point:
        ends = ("policy_accuracy", "policy_accuracy_low", "policy_accuracy_high")
        return Point(k, *(mean(rows, key, name, k, column) for column in ends))

    return {
        f"figure6-{'-'.join(key)}": AccuracyFigure(
            {
                name: tuple(point(key, name, k) for k in plan.size.incorrect)
                for name in (UNFILTERED, FILTERED, ORACLE, *SIMPLE)
            }
        )
        for key in series(rows)
    }


FIGURE_6 = Exhibit(
    "policy accuracy over the number of incorrect demonstrations",
    "several learners learn a better policy when incorrect demonstrations are discarded; the "
    "figure's numbers are not in the text that was available.",
    lambda plan: list(units(plan).values()),
    table,
    figures,
)
