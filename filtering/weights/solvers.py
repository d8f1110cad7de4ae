"""The solvers of equation 3 by name."""

from collections.abc import Mapping
from types import MappingProxyType

from filtering.weights.alternating import Alternating
from filtering.weights.annealed import Annealed
from filtering.weights.exact import Exact
from filtering.weights.published import Published
from filtering.weights.solver import Solver
from teasim.errors import named

SOLVERS: Mapping[str, type[Solver]] = MappingProxyType(
    {"annealed": Annealed, "alternating": Alternating, "exact": Exact, "published": Published}
)


def solver_named(name: str) -> Solver:
    """Return a solver with its default settings.

    Raises:
        ConfigError: there is no solver of that name.
    """
    return named("solver", SOLVERS, name)()
