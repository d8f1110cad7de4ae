"""Ordered parallel maps with a progress bar; the only module that runs joblib."""

import os
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Generic, TypeVar

from joblib import Parallel, delayed, parallel_config
from joblib.externals.loky.process_executor import TerminatedWorkerError
from tqdm import tqdm

from teasim.common.clusters import CONTEXTS, KilledError
from teasim.common.errors import WorkerError
from teasim.common.workers import Workers

Item = TypeVar("Item")
Result = TypeVar("Result")

# One thread per worker, because there is one worker per core. With 0 threads llvmpipe renders in
# the calling thread, which gives the best throughput in that case.
WORKER_ENVIRONMENT = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "LP_NUM_THREADS": "0",
}


class _Here(Generic[Item, Result]):
    """Calls a function in the current folder of the process that made it.

    Processes of loky are reused, and stay in the folder in which they were started.
    """

    def __init__(self, function: Callable[[Item], Result]) -> None:
        self._function, self._folder = function, os.getcwd()

    def __call__(self, item: Item) -> Result:
        os.chdir(self._folder)
        return self._function(item)


def run(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    workers: Workers,
    description: str = "",
    progress: bool | None = None,
) -> list[Result]:
    """Map `function` over `items` in worker processes and return the results in order.

    With one job or one item everything runs in this process, so a debugger works and nothing is
    pickled. With `progress` None there is a bar, with the time left, if stderr is a terminal.

    Raises:
        ConfigError: no cluster answers at the address.
        WorkerError: a process was killed from outside, usually because memory ran out.
    """
    show = sys.stderr.isatty() if progress is None else progress
    bar = tqdm(total=len(items), desc=description, disable=not show, file=sys.stderr, leave=False)
    with bar, warnings.catch_warnings():
        # joblib replaces workers that have used much memory; no work is lost.
        warnings.filterwarnings("ignore", message="A worker stopped while some jobs were given")
        results = []
        try:
            for result in _results(function, items, workers):
                results.append(result)
                bar.update()
        except (TerminatedWorkerError, KilledError) as error:
            raise WorkerError(
                f"A worker process was killed after {len(results)} of {len(items)} {description}, "
                "usually because memory ran out; run the same command again with fewer --jobs."
            ) from error
    return results


def _results(
    function: Callable[[Item], Result], items: Sequence[Item], workers: Workers
) -> Iterator[Result]:
    if len(items) <= 1 or (workers.backend, workers.count) == ("loky", 1):
        yield from map(function, items)
        return
    for name, value in WORKER_ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    needed = replace(workers, jobs=min(workers.count, len(items)))
    with CONTEXTS[workers.backend](needed) as options:
        with parallel_config(backend=workers.backend, **options):
            parallel = Parallel(return_as="generator", batch_size=1)
        # Workers of a cluster may be on another machine, which has no such folder.
        called = _Here(function) if workers.backend == "loky" else function
        yield from parallel(delayed(called)(item) for item in items)
