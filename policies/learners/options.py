"""A learner's own settings by name, from the command line or from a TOML file.

>>> from policies.learners.registry import find_learner
>>> read_options("bc-rnn", find_learner("bc-rnn", "subtask"), parse_assignments(["hidden=400"]))
{'hidden': 400}
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, get_args, get_type_hints

from policies.learners.registry import LearnerKind
from teasim.common.errors import ConfigError


def parse_assignments(assignments: Sequence[str]) -> dict[str, Any]:
    """Turn texts `name=value` into values: whole numbers, numbers, None (`none`) or texts.

    Raises:
        ConfigError: a text has no `=`, or a name is given twice.
    """
    values: dict[str, Any] = {}
    for assignment in assignments:
        name, sign, text = (part.strip() for part in assignment.partition("="))
        if not (name and sign):
            raise ConfigError(f"--set '{assignment}' is not name=value; write --set steps=200.")
        name = name.replace("-", "_")
        if name in values:
            raise ConfigError(f"--set gives '{name}' twice; give it once.")
        values[name] = _value(text)
    return values


def read_options(name: str, kind: LearnerKind, given: Mapping[str, Any]) -> dict[str, Any]:
    """Check the settings `given` for the learner called `name` and return them.

    Raises:
        ConfigError: a setting is unknown, or its value is of another type or out of range.
    """
    hints = get_type_hints(kind.config)
    for setting in given:
        if setting not in kind.options:
            raise ConfigError(
                f"The learner '{name}' has no setting '{setting}'; "
                f"choose {', '.join(kind.options)}."
            )
    options = {key: _typed(name, key, hints[key], value) for key, value in given.items()}
    kind.config(**options)
    return options


def _typed(learner: str, setting: str, hint: Any, value: Any) -> Any:
    """Return `value` as the type that `hint` says: int, float, or one of them or None."""
    accepted = get_args(hint) or (hint,)
    if value is None and type(None) in accepted:
        return None
    if type(value) is int and int in accepted:
        return value
    if type(value) in (int, float) and float in accepted and math.isfinite(value):
        return float(value)
    words = "a whole number" if int in accepted else "a number"
    if type(None) in accepted:
        words += " or none"
    shown = f"'{value}'" if isinstance(value, str) else value
    raise ConfigError(
        f"The setting '{setting}' of the learner '{learner}' must be {words}, not {shown}."
    )


def _value(text: str) -> Any:
    if text.lower() == "none":
        return None
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text
