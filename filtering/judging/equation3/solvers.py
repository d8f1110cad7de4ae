"""The solvers of equation 3 by name."""

from collections.abc import Mapping
from types import MappingProxyType

from filtering.judging.equation3.alternating import Alternating
from filtering.judging.equation3.annealed import Annealed
from filtering.judging.equation3.exact import Exact
from filtering.judging.equation3.published import Published
from filtering.judging.equation3.solver import Solver
from teasim.common.registry import named

SOLVERS: Mapping[str, type[Solver]] = MappingProxyType(
    {"annealed": Annealed, "alternating": Alternating, "exact": Exact, "published": Published}
)


def solver_named(name: str) -> Solver:
    """Return a solver with its default settings.

    Raises:
        ConfigError: there is no solver of that name.
    """
    return named("solver", SOLVERS, name)()
