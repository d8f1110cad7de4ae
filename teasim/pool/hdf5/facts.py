"""What teasim adds to a demonstration in an HDF5 file: one attribute that holds JSON.

It keeps what the format has no place for: the stable identity, spans that repeat or leave frames
out, the task, and what is known for scoring.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from teasim.common.errors import PoolError
from teasim.pool.types import GroundTruth, MistakeSpan, Span

ATTRIBUTE = "teasim"


@dataclass(frozen=True)
class Facts:
    """What the attribute says about a demonstration."""

    demo_id: str
    """Its identity in the source it was converted from."""
    task: str = ""
    """The task as a sentence."""
    spans: tuple[Span, ...] = ()
    """Sub-task spans in order of time."""
    record: GroundTruth | None = None
    """What is known about it; None when nothing is."""

    def text(self) -> str:
        """Return the attribute."""
        record = self.record
        told = None if record is None else {**vars(record), "mistakes": _dicts(record.mistakes)}
        value = {**vars(self), "spans": _dicts(self.spans), "record": told}
        return json.dumps(value, ensure_ascii=False)


def read_facts(node: Any, length: int) -> Facts | None:
    """Return what the attribute of a group says; None without one.

    Raises:
        PoolError: it is not readable, or a span leaves the demonstration.
    """
    text = node.attrs.get(ATTRIBUTE)
    if text is None:
        return None
    try:
        value = json.loads(text)
        record = value["record"]
        if record is not None:
            mistakes = tuple(MistakeSpan(**mistake) for mistake in record["mistakes"])
            record = GroundTruth(**{**record, "mistakes": mistakes})
        spans = tuple(Span(**span) for span in value["spans"])
        facts = Facts(str(value["demo_id"]), str(value["task"]), spans, record)
        if any(span.stop > length for span in spans) or not facts.demo_id:
            raise ValueError("a span is too long")
    except (AttributeError, KeyError, TypeError, ValueError, PoolError) as error:
        raise PoolError(f"The attribute '{ATTRIBUTE}' of '{node.name}' is damaged.") from error
    return facts


def _dicts(spans: Sequence[Span] | Sequence[MistakeSpan]) -> list[dict[str, Any]]:
    return [dict(vars(span)) for span in spans]
