"""Figures 4 and 5: the weights of the demonstrations of a pool, and the groups made of them."""

from collections.abc import Sequence
from typing import Any

from policies.experiments.reproduce.exhibits.detecting import percent, pools_unit
from policies.experiments.reproduce.exhibits.exhibit import Exhibit, Table
from policies.experiments.reproduce.plan import PEOPLE_LEVEL, ROBOT_LEVEL, SEGMENTERS, Plan
from policies.experiments.units import Store, Unit
from teasim.common.figures import WeightsFigure
from teasim.common.statistics import Rate, rate

FIGURES: dict[str, tuple[int, tuple[tuple[str, int], ...]]] = {
    "figure4": (200, (("seq_1", 8), ("seq_3", 4))),
    "figure5": (201, (("seq_1", 6), ("seq_2", 4), ("seq_3", 2))),
}
"""Number from which the pools are drawn, and the paper's composition of the pool."""
LEVELS = (PEOPLE_LEVEL, ROBOT_LEVEL)
"""Segmenters whose weights are shown."""


def units(plan: Plan, name: str) -> dict[str, Unit]:
    """Return the unit of each segmenter."""
    row, kinds = FIGURES[name]
    return {level: pools_unit(plan, kinds, level, row=row, work="weights") for level in LEVELS}


def table(plan: Plan, store: Store, name: str) -> Table:
    """Return a row per demonstration of the first pool, and how often the groups are right."""
    _, kinds = FIGURES[name]
    rows: list[dict[str, Any]] = []
    words, figures = [], {}
    for level, unit in units(plan, name).items():
        pools = store.read(unit)["pools"]
        rows += _rows(SEGMENTERS[level], [kind for kind, _ in kinds], pools[0])
        for method in pools[0]["methods"]:
            right = exactly_right(pools, method)
            words.append(
                f"{SEGMENTERS[level]}, {method}, told {len(kinds)} groups: exactly the true groups "
                f"in {right.hits} of {right.trials} pools ({percent(right)} %)."
            )
            shows = f"{SEGMENTERS[level]}, {method}"
            figures[shows] = _figure([kind for kind, _ in kinds], pools[0], method)
    note = "The rows are the first pool; pools share demonstrations of one bank."
    return Table(rows, words, notes=(note,), figures=figures)


def exactly_right(pools: Sequence[dict[str, Any]], method: str) -> Rate:
    """Return the share of pools whose groups are the kinds of demonstrations."""
    return rate(sum(p["methods"][method]["groups"] == p["kinds"] for p in pools), len(pools))


def _figure(kinds: Sequence[str], pool: dict[str, Any], method: str) -> WeightsFigure:
    """Draw the weights of a pool; marked are those in another group than the best."""
    said = pool["methods"][method]
    return WeightsFigure(
        tuple(said["weights"]),
        tuple(group > 0 for group in said["groups"]),
        tuple(kinds[kind] for kind in pool["kinds"]),
        threshold=0.0,  # there are several groups
    )


def _rows(segmenter: str, kinds: Sequence[str], pool: dict[str, Any]) -> list[dict[str, Any]]:
    return [
        {
            "segmenter": segmenter,
            "demonstration": place,
            "sequence": kinds[pool["kinds"][place]],
            **{f"w, {m}": said["weights"][place] for m, said in pool["methods"].items()},
            **{f"group, {m}": said["groups"][place] for m, said in pool["methods"].items()},
        }
        for place in range(len(pool["kinds"]))
    ]


def exhibit(name: str, title: str, paper: str) -> Exhibit:
    """Return the exhibit of a figure."""
    return Exhibit(
        title,
        paper,
        lambda plan: list(units(plan, name).values()),
        lambda plan, store: table(plan, store, name),
    )


FIGURE_4 = exhibit(
    "figure4",
    "weights of 8 correct and 4 incorrect demonstrations, two groups",
    "graded weights of one pool in two groups; the figure's numbers were not available.",
)
FIGURE_5 = exhibit(
    "figure5",
    "weights of 6 correct, 4 sub-optimal and 2 incorrect demonstrations, three groups",
    "graded weights of one pool in three groups; the figure's numbers were not available.",
)
