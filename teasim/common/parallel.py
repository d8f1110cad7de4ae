"""Ordered parallel maps with a progress bar; the only module that uses joblib."""

import os
import sys
import warnings
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

from joblib import Parallel, cpu_count, delayed, parallel_config
from joblib.externals.loky.process_executor import TerminatedWorkerError
from tqdm import tqdm

from teasim.common.errors import ConfigError, WorkerError

Item = TypeVar("Item")
Result = TypeVar("Result")

BACKENDS = ("loky", "dask", "ray")

# One thread per worker, because there is one worker per core. With 0 threads llvmpipe renders in
# the calling thread, which gives the best throughput in that case.
WORKER_ENVIRONMENT = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "LP_NUM_THREADS": "0",
}


def default_jobs() -> int:
    """Number of usable cores."""
    return int(cpu_count())


def run(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    jobs: int,
    backend: str = "loky",
    description: str = "",
    progress: bool | None = None,
) -> list[Result]:
    """Map `function` over `items` in `jobs` processes and return the results in order.

    With one job or one item everything runs in this process, so a debugger works and nothing is
    pickled. With `progress` None there is a bar if stderr is a terminal.

    Raises:
        ConfigError: see `check_workers`, or the back end's package is not installed.
        WorkerError: a process was killed from outside, usually because memory ran out.
    """
    check_workers(jobs, backend)
    show = sys.stderr.isatty() if progress is None else progress
    bar = tqdm(total=len(items), desc=description, disable=not show, file=sys.stderr, leave=False)
    with bar, warnings.catch_warnings():
        # joblib replaces workers that have used much memory; no work is lost.
        warnings.filterwarnings("ignore", message="A worker stopped while some jobs were given")
        results = []
        try:
            for result in _results(function, items, jobs, backend):
                results.append(result)
                bar.update()
        except TerminatedWorkerError as error:
            raise WorkerError(
                f"A worker process was killed after {len(results)} of {len(items)} {description}, "
                "usually because memory ran out; run the same command again with fewer --jobs."
            ) from error
    return results


def check_workers(jobs: int, backend: str) -> None:
    """Check the arguments of `run` before any work starts.

    Raises:
        ConfigError: `jobs` is not positive, or `backend` is unknown.
    """
    if jobs < 1:
        raise ConfigError(f"jobs is {jobs}; choose 1 or more.")
    if backend not in BACKENDS:
        raise ConfigError(f"Unknown parallel backend '{backend}'; choose {', '.join(BACKENDS)}.")


def _results(
    function: Callable[[Item], Result], items: Sequence[Item], jobs: int, backend: str
) -> Iterable[Result]:
    if jobs == 1 or len(items) <= 1:
        return (function(item) for item in items)
    for name, value in WORKER_ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    _register(backend)
    with parallel_config(backend=backend, n_jobs=min(jobs, len(items))):
        generator: Any = Parallel(return_as="generator", batch_size=1)(
            delayed(function)(item) for item in items
        )
    results: Iterable[Result] = generator
    return results


def _register(backend: str) -> None:
    """Register a joblib back end that another package provides."""
    try:
        if backend == "dask":
            import distributed.joblib  # noqa: F401
        elif backend == "ray":
            from ray.util.joblib import register_ray

            register_ray()
    except ImportError as error:
        raise ConfigError(
            f"The parallel backend '{backend}' is not installed; "
            f"run 'pip install teasim[{backend}]' or choose loky."
        ) from error
