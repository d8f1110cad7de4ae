"""Figures 4 and 5: the weights of the demonstrations of a pool, and the groups made of them."""

from collections.abc import Sequence
from typing import Any

from policies.experiments.reproduce.exhibits.detecting import percent, pools_unit
from policies.experiments.reproduce.exhibits.exhibit import Exhibit, Table
from policies.experiments.reproduce.plan import SEGMENTERS, Plan
from policies.experiments.units import Store, Unit
from teasim.common.figures import Drawing, WeightsFigure
from teasim.common.statistics import Rate, rate

FIGURES: dict[str, tuple[int, tuple[tuple[str, int], ...]]] = {
    "figure4": (200, (("seq_1", 8), ("seq_3", 4))),
    "figure5": (201, (("seq_1", 6), ("seq_2", 4), ("seq_3", 2))),
}
"""Number from which the pools are drawn, and the paper's composition of the pool."""


def units(plan: Plan, name: str) -> dict[str, Unit]:
    """Return the unit of each segmenter."""
    row, kinds = FIGURES[name]
    return {one: pools_unit(plan, kinds, one, row=row, work="weights") for one in SEGMENTERS}


def table(plan: Plan, store: Store, name: str) -> Table:
    """Return a row per demonstration of the first pool, and how often the groups are right."""
    _, kinds = FIGURES[name]
    rows: list[dict[str, Any]] = []
    words = []
    found = {level: store.read(unit)["pools"] for level, unit in units(plan, name).items()}
    methods = list(dict.fromkeys(m for pools in found.values() for m in pools[0]["methods"]))
    for level, pools in found.items():
        rows += _rows(SEGMENTERS[level], [kind for kind, _ in kinds], pools[0], methods)
        for method in pools[0]["methods"]:
            right = exactly_right(pools, method)
            words.append(
                f"{SEGMENTERS[level]}, {method}, told {len(kinds)} groups: exactly the true groups "
                f"in {right.hits} of {right.trials} pools ({percent(right)} %)."
            )
    note = "The rows are the first pool; pools share demonstrations of one bank."
    return Table(rows, words, notes=(note,))


def exactly_right(pools: Sequence[dict[str, Any]], method: str) -> Rate:
    """Return the share of pools whose groups are the kinds of demonstrations."""
    return rate(sum(p["methods"][method]["groups"] == p["kinds"] for p in pools), len(pools))


def _rows(
    segmenter: str, kinds: Sequence[str], pool: dict[str, Any], methods: Sequence[str]
) -> list[dict[str, Any]]:
    said = pool["methods"]
    return [
        {
            "segmenter": segmenter,
            "demonstration": place,
            "sequence": kinds[pool["kinds"][place]],
            **{f"w, {m}": said[m]["weights"][place] if m in said else None for m in methods},
            **{f"group, {m}": said[m]["groups"][place] if m in said else None for m in methods},
        }
        for place in range(len(pool["kinds"]))
    ]


def figures(plan: Plan, store: Store, name: str) -> dict[str, Drawing]:
    """Return the weights of the first pool by every segmenter and method."""
    kinds = [kind for kind, _ in FIGURES[name][1]]
    drawn: dict[str, Drawing] = {}
    for level, unit in units(plan, name).items():
        pool = store.read(unit)["pools"][0]
        for method, said in pool["methods"].items():
            title = f"{name}-{level}-{method}".replace(", ", "-").replace(" ", "-")
            drawn[title] = WeightsFigure(
                tuple(said["weights"]),
                tuple(group > 0 for group in said["groups"]),
                tuple(kinds[kind] for kind in pool["kinds"]),
                0.0,
            )
    return drawn


def exhibit(name: str, title: str, paper: str) -> Exhibit:
    """Return the exhibit of a figure."""
    return Exhibit(
        title,
        paper,
        lambda plan: list(units(plan, name).values()),
        lambda plan, store: table(plan, store, name),
        lambda plan, store: figures(plan, store, name),
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
