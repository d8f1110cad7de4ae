"""A simulated YuMi at a tea-making station: the world and the data it makes.

Importing it registers `teasim/TeaMaking-v0` and `teasim/TeaMakingSubtasks-v0` with Gymnasium: at
once if Gymnasium has been imported, else when Gymnasium is imported. It loads neither Gymnasium nor
a simulator itself, because a pool can be read without them.
"""

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from teasim.generation import generate
    from teasim.pool import Pool

__all__ = ["Pool", "generate"]

_ENTRY_POINTS = {"Pool": "teasim.pool", "generate": "teasim.generation"}
"""Public name -> module that defines it; imported when it is first used."""


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that `import teasim` is fast."""
    if name == "__version__":  # it stands in pyproject.toml alone
        from importlib.metadata import version

        return version("teasim")
    if name not in _ENTRY_POINTS:
        raise AttributeError(f"module 'teasim' has no attribute '{name}'")
    return getattr(import_module(_ENTRY_POINTS[name]), name)


def _register_envs() -> None:
    from teasim.envs.registration import register_envs

    register_envs()


class _RegisterAfterImport(MetaPathFinder, Loader):
    """Registers the environments as soon as Gymnasium has been imported.

    Gymnasium reads no entry points of plug-ins, and `gymnasium.make("teasim:...")` only imports
    teasim, which does nothing if teasim was imported before Gymnasium. Nothing but a hook in the
    import system runs in that case. This one finds the module `gymnasium` with the other finders,
    loads it with its own loader, and removes itself; no loader is changed.
    """

    def __init__(self) -> None:
        self._loader: Loader | None = None

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find Gymnasium as the other finders do, to be loaded by this object."""
        if name != "gymnasium":
            return None
        others = (finder for finder in sys.meta_path if finder is not self)
        found = (finder.find_spec(name, path, target) for finder in others)
        spec = next(filter(None, found), None)
        if spec is not None and spec.loader is not None:
            self._loader, spec.loader = spec.loader, self
        return spec

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Create the module with its own loader."""
        return self._loader.create_module(spec) if self._loader else None

    def exec_module(self, module: ModuleType) -> None:
        """Hand the module over to its own loader, then register the environments."""
        if self._loader is None or module.__spec__ is None:
            raise ImportError("the module was not found by this finder", name=module.__name__)
        module.__loader__ = module.__spec__.loader = self._loader
        self._loader.exec_module(module)
        sys.meta_path.remove(self)
        _register_envs()


if "gymnasium" in sys.modules:
    _register_envs()
else:
    sys.meta_path.insert(0, _RegisterAfterImport())
