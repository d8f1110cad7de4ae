"""A simulated YuMi at a tea-making station: the world and the data it makes.

Importing it makes `teasim/TeaMaking-v0` and `teasim/TeaMakingSubtasks-v0` known to Gymnasium: at
once where Gymnasium is in use already, else as soon as somebody imports it. Reading a pool has no
need of it and does not load it.
"""

import sys
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from teasim.generation import generate as generate
    from teasim.pool import Pool as Pool

__version__ = "0.1.0"

_ENTRY_POINTS = {"Pool": "teasim.pool", "generate": "teasim.generation"}
"""Public name -> module that defines it; imported when it is first used."""


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that `import teasim` is fast."""
    if name not in _ENTRY_POINTS:
        raise AttributeError(f"module 'teasim' has no attribute '{name}'")
    return getattr(import_module(_ENTRY_POINTS[name]), name)


def _register_envs() -> None:
    from teasim.envs.registration import register_envs

    register_envs()


class _AfterGymnasium(MetaPathFinder):
    """Lets the other finders find Gymnasium, and registers the environments once it is there.

    `gymnasium.make("teasim:...")` imports teasim to learn about them, but that does nothing when
    teasim was imported before Gymnasium.
    """

    def find_spec(self, name: str, *_: Any) -> ModuleSpec | None:
        if name != "gymnasium":
            return None
        others = (finder for finder in sys.meta_path if finder is not self)
        spec = next(filter(None, (finder.find_spec(name, None) for finder in others)), None)
        if spec is None or spec.loader is None:
            return spec
        execute = spec.loader.exec_module

        def execute_and_register(module: ModuleType) -> None:
            execute(module)
            _register_envs()

        spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec


if "gymnasium" in sys.modules:
    _register_envs()
else:
    sys.meta_path.insert(0, _AfterGymnasium())
