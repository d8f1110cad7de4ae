"""A filter of your own, as a command that `teasim ablate` can run beside the others.

    python examples/own_filter.py POOL TABLE

In a plan: `[filters.mine]`, `use = "discard"`, `command = "python own_filter.py {pool} {table}"`
with the names that docs/policies.md gives. This one flags whoever takes much longer or shorter.
"""

import sys
from pathlib import Path

import numpy as np

from teasim import Pool
from teasim.pool.weight_table import WeightRow, write_weight_table

ODD = 3.0
"""Deviations from the median length at which a demonstration is flagged."""


def main(root: Path, table: Path) -> None:
    """Write a weight table in which demonstrations of unusual length are flagged."""
    episodes = Pool.open(root).episodes
    lengths = np.array([episode.length for episode in episodes], dtype=float)
    away = np.abs(lengths - np.median(lengths))
    odd = away / max(1.0, 1.4826 * float(np.median(away)))
    rows = [
        WeightRow(
            demo_id=episode.demo_id,
            episode_index=episode.index,
            weight=float(np.exp(-how / ODD)),
            loss=float(how),
            flagged=bool(how > ODD),
            group=int(how > ODD),
            reason="unusual length" if how > ODD else "",
        )
        for episode, how in zip(episodes, odd, strict=True)
    ]
    write_weight_table(table, rows)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
