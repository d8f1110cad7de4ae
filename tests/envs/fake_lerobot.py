"""The part of LeRobot that its environment plug-ins see, for a Python without LeRobot.

`scripts/check_lerobot.py` asks the real one.
"""

import sys
from dataclasses import dataclass
from enum import StrEnum
from types import ModuleType
from typing import Any, ClassVar


class FeatureType(StrEnum):
    STATE = "STATE"
    VISUAL = "VISUAL"
    ENV = "ENV"
    ACTION = "ACTION"


@dataclass
class PolicyFeature:
    type: FeatureType
    shape: tuple[int, ...]


@dataclass
class EnvConfig:
    choices: ClassVar[dict[str, type]] = {}
    max_parallel_tasks: int = 1
    disable_env_checker: bool = True

    @classmethod
    def register_subclass(cls, name: str) -> Any:
        return lambda subclass: cls.choices.setdefault(name, subclass)

    @property
    def gym_id(self) -> str:
        return f"{self.package_name}/{self.task}"


def modules() -> dict[str, ModuleType]:
    """LeRobot's modules by name, as `sys.modules` holds them."""
    contents = {
        "lerobot": {},
        "lerobot.configs": {"FeatureType": FeatureType, "PolicyFeature": PolicyFeature},
        "lerobot.envs": {"EnvConfig": EnvConfig},
        "lerobot.utils": {},
        "lerobot.utils.constants": {
            "ACTION": "action",
            "OBS_ENV_STATE": "observation.environment_state",
            "OBS_IMAGES": "observation.images",
            "OBS_STATE": "observation.state",
        },
    }
    made = {name: ModuleType(name) for name in contents}
    for name, values in contents.items():
        vars(made[name]).update(values)
    return made


def forget(prefix: str) -> None:
    """Remove the modules whose names begin with `prefix`, so that they are imported again."""
    for name in [name for name in sys.modules if name.split(".")[0] == prefix]:
        del sys.modules[name]
