"""The back ends of `parallel.run`: per back end, joblib's arguments while its workers are up."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from types import MappingProxyType
from typing import Any

from teasim.common.errors import ConfigError
from teasim.common.workers import Workers

TIMEOUT = 10.0
"""Longest wait for a cluster to answer [s]; distributed itself waits 30 s."""


class KilledError(Exception):
    """A worker of a cluster was killed from outside."""


@contextmanager
def _loky(workers: Workers) -> Iterator[dict[str, Any]]:
    yield {"n_jobs": workers.count}


@contextmanager
def _dask(workers: Workers) -> Iterator[dict[str, Any]]:
    from distributed import Client, KilledWorker, LocalCluster

    with ExitStack() as opened:
        target = workers.address
        try:
            if target is None:
                local = LocalCluster(workers.count, threads_per_worker=1, dashboard_address=None)
                target = opened.enter_context(local)
            client = Client(target, timeout=TIMEOUT, set_as_default=False)
        except (OSError, ValueError) as error:  # silent, or no address at all
            raise _unreachable(workers, "dask scheduler") from error
        opened.enter_context(client)
        try:
            yield {"n_jobs": -1, "client": client}
        except KilledWorker as error:
            raise KilledError from error


@contextmanager
def _ray(workers: Workers) -> Iterator[dict[str, Any]]:
    import ray
    from ray.util.joblib import register_ray

    register_ray()
    count = None if workers.address else workers.count
    try:
        ray.init(address=workers.address, num_cpus=count, log_to_driver=False)
    except (OSError, ValueError, RuntimeError) as error:
        raise _unreachable(workers, "ray start --head") from error
    try:
        yield {"n_jobs": -1}
    finally:
        ray.shutdown()


def _unreachable(workers: Workers, command: str) -> ConfigError:
    where = f" at '{workers.address}'" if workers.address else ""
    return ConfigError(
        f"No {workers.backend} cluster answers{where}; start one with '{command}' and give its "
        "address with --address, or choose the backend loky."
    )


CONTEXTS: Mapping[str, Callable[[Workers], AbstractContextManager[dict[str, Any]]]] = (
    MappingProxyType({"loky": _loky, "dask": _dask, "ray": _ray})
)
"""Per back end its context."""
