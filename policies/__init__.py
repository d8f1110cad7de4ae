"""Policies learned from demonstrations, and their scores (the paper, section 4.3).

The names below are imported when they are used, so `import policies` is fast:

>>> from pathlib import Path
>>> from policies import TrainSettings, load_policy, train
>>> settings = TrainSettings(Path("pool"), Path("policy"), observe="state")
>>> settings.learner, settings.chosen_use
('bc', 'ignore')
>>> print(train(settings))  # doctest: +SKIP
bc on 14 of 14 demonstrations, 96 decisions, loss 0.021, 2 s -> policy
>>> policy = load_policy(Path("policy"))  # doctest: +SKIP
>>> action, memory = policy.predict(observation, deterministic=True)  # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from policies.checkpoint import load_policy as load_policy
    from policies.checkpoint import save_policy as save_policy
    from policies.play.evaluation import evaluate as evaluate
    from policies.settings import EnvironmentConfig as EnvironmentConfig
    from policies.settings import EvaluationConfig as EvaluationConfig
    from policies.settings import TrainSettings as TrainSettings
    from policies.training import train as train

_HOMES = {
    "EnvironmentConfig": "policies.settings",
    "EvaluationConfig": "policies.settings",
    "TrainSettings": "policies.settings",
    "evaluate": "policies.play.evaluation",
    "load_policy": "policies.checkpoint",
    "save_policy": "policies.checkpoint",
    "train": "policies.training",
}
"""Public name -> module that defines it."""

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module 'policies' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """List the public names too."""
    return sorted([*globals(), *_HOMES])
