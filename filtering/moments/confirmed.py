"""Whether sub-tasks that were found in the videos are confirmed by the counterparts of moments.

Moments that correspond should belong to the same sub-task. Sub-tasks that were cut where there is
no border, or that are mixed up between videos, break this.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts, placed


def confirmation(found: Counterparts, labels: Sequence[NDArray[np.int64]]) -> float:
    """Return Cohen's kappa of the sub-tasks of counterparts: 1 if they always agree.

    Only counterparts that return, and have places of their own, are compared.

    Args:
        found: the counterparts.
        labels: per demonstration (n,) the sub-task of each moment, 0 or more, -1 for none.
    """
    pairs = []
    for r, row, rows_back in zip(found.references, found.there, found.back, strict=True):
        for d, (there, back) in enumerate(zip(row, rows_back, strict=True)):
            if there is None or back is None:
                continue
            mutual = placed(there, back)
            pairs.append(np.stack([labels[r][mutual], labels[d][there.at[mutual]]]))
    one, other = np.concatenate(pairs, axis=1) + 1
    if not len(one):
        return 0.0
    counts = np.zeros((max(one.max(), other.max()) + 1,) * 2)
    np.add.at(counts, (one, other), 1 / len(one))
    agreed, chance = np.trace(counts), float(counts.sum(axis=0) @ counts.sum(axis=1))
    return 1.0 if chance >= 1 else float((agreed - chance) / (1 - chance))
