"""Where parallel work runs: worker processes of this machine, or those of a cluster."""

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Annotated

import tyro

from teasim.common.errors import ConfigError

BACKENDS = {"loky": "joblib", "dask": "distributed", "ray": "ray"}
"""Every back end and the package it needs."""


@dataclass(frozen=True)
class Workers:
    """Worker processes for many demonstrations or episodes; no result depends on them."""

    jobs: int | None = None
    """Number of worker processes; by default one per core. With an address, all workers of the
    cluster are used."""
    backend: str = "loky"
    """Package that runs the worker processes: loky (on this machine), dask or ray."""
    address: str | None = None
    """Address of a running dask or ray cluster, for example tcp://node:8786. Its machines must see
    the files under the same paths. Without an address dask and ray work on this machine."""

    def __post_init__(self) -> None:
        """Check the settings before any work starts.

        Raises:
            ConfigError: `jobs` is not positive, `backend` is unknown or not installed, or it takes
                no address.
        """
        if self.jobs is not None and self.jobs < 1:
            raise ConfigError(f"jobs is {self.jobs}; choose 1 or more.")
        if self.backend not in BACKENDS:
            raise ConfigError(
                f"Unknown parallel backend '{self.backend}'; choose {', '.join(BACKENDS)}."
            )
        if find_spec(BACKENDS[self.backend]) is None:
            raise ConfigError(
                f"The parallel backend '{self.backend}' is not installed; "
                f"run 'pip install teasim[{self.backend}]' or choose loky."
            )
        if self.address is not None and self.backend == "loky":
            raise ConfigError(
                "The parallel backend 'loky' takes no --address; choose dask or ray, or leave it "
                "out."
            )

    @property
    def count(self) -> int:
        """Number of worker processes, with the default filled in."""
        return default_jobs() if self.jobs is None else self.jobs


def default_jobs() -> int:
    """Return the number of usable cores."""
    from joblib import cpu_count

    return int(cpu_count())


WorkerOptions = Annotated[Workers, tyro.conf.OmitArgPrefixes]
"""The type of the field `workers` in the settings of a verb: --jobs, --backend and --address."""
IN_PROCESS = Workers(jobs=1)
"""No worker process: the work is done where it is asked for, so a debugger works."""
