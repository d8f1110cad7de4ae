"""The numbers that the paper prints (section 4), as far as they are known, and how to read them.

Tables 2 to 4 give accuracy, "precision" and recall of one pool per row. Recall is 100 % in every
row, so accuracy fixes the number of correct demonstrations that were flagged. The printed precision
then equals F1 = 2 P / (1 + P), not P = TP / (TP + FP).

Only the numbers of tables 2 to 4 and those in the text are available. For table 1 and the figures
the claim in the text is all there is, and `NOT_AVAILABLE` stands in the place of the number.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

CORRECT = 10
"""Correct demonstrations in every pool of tables 2 to 4."""
NOT_AVAILABLE = "not available"
"""Stands for a number of the paper that is not known here."""
SEGMENTED = 80
"""Frames that the paper's segmenter gets right on its own videos, about [%] (section 4.1)."""
SEGMENTED_SALADS = 77
"""Frames that it gets right on 50-Salads [%]."""


@dataclass(frozen=True)
class PaperRow:
    """A row of tables 2 to 4: one pool of CORRECT correct and k other demonstrations."""

    k: int
    """Number of other demonstrations."""
    accuracy: int
    """Printed accuracy [%]."""
    precision: int
    """Printed precision [%]."""

    @property
    def false_positives(self) -> int:
        """Correct demonstrations that were flagged: with all k found, they are all the errors."""
        return round((1 - self.accuracy / 100) * (CORRECT + self.k))

    @property
    def true_precision(self) -> float:
        """TP / (TP + FP) [%]."""
        return 100 * self.k / (self.k + self.false_positives)

    @property
    def f1(self) -> float:
        """F1 at a recall of 100 % [%]."""
        return 200 * self.k / (2 * self.k + self.false_positives)


def _rows(*numbers: tuple[int, int, int]) -> tuple[PaperRow, ...]:
    return tuple(PaperRow(*row) for row in numbers)


DETECTION: Mapping[str, tuple[PaperRow, ...]] = MappingProxyType(
    {
        "table2": _rows((1, 90, 67), (2, 92, 80), (4, 85, 80), (6, 81, 80), (8, 83, 84)),
        "table3": _rows((1, 90, 67), (2, 92, 80), (4, 93, 89), (6, 88, 86), (8, 89, 89)),
        "table4": _rows((1, 90, 67), (2, 83, 67), (4, 85, 80), (6, 81, 77)),
    }
)
"""Rows of the detection tables."""


def precision_sentence() -> str:
    """Say why the printed precision is F1, computed from the printed numbers."""
    rows = [row for table in DETECTION.values() for row in table]
    as_f1 = sum(abs(row.precision - row.f1) <= 1 for row in rows)
    as_precision = sum(abs(row.precision - row.true_precision) <= 1 for row in rows)
    return (
        f"The paper's recall is 100 % in every row, so its accuracy fixes the false positives. Its "
        f"printed precision then equals F1 in {as_f1} of {len(rows)} rows of tables 2 to 4 and "
        f"TP / (TP + FP) in {as_precision}; here both are given under their own names."
    )
