"""Parallel maps: every back end gives the same result, and failures are told in one sentence."""

import os
import time
from importlib.util import find_spec

import pytest

from teasim.common import workers as module
from teasim.common.errors import ConfigError, WorkerError
from teasim.common.parallel import run
from teasim.common.workers import IN_PROCESS, Workers

NOWHERE = "tcp://127.0.0.1:9"  # the port of the service that discards everything


def die(item: int) -> int:
    """End the worker process as the system does when memory runs out."""
    os._exit(item)


def square(item: int) -> tuple[int, bool]:
    """Return a result, later ones sooner, and whether it was computed in the asking process."""
    time.sleep(0.02 * (4 - item))
    return item * item, os.environ.get("ASKING_PROCESS") == str(os.getpid())


def test_a_killed_worker_is_named_and_the_cure_as_well():
    with pytest.raises(WorkerError) as error:
        run(die, [9, 9, 9], workers=Workers(2), description="demonstrations", progress=False)
    assert str(error.value) == (
        "A worker process was killed after 0 of 3 demonstrations, usually because memory ran out; "
        "run the same command again with fewer --jobs."
    )


@pytest.mark.parametrize("backend", ["loky", "dask"])
def test_every_back_end_gives_the_results_in_order(backend, monkeypatch):
    monkeypatch.setenv("ASKING_PROCESS", str(os.getpid()))
    here = run(square, range(4), workers=IN_PROCESS)
    assert here == [(0, True), (1, True), (4, True), (9, True)]
    elsewhere = run(square, range(4), workers=Workers(2, backend))
    assert elsewhere == [(number, False) for number, _ in here]


def test_a_cluster_that_runs_is_used_by_its_address(monkeypatch):
    from distributed import LocalCluster

    monkeypatch.setenv("ASKING_PROCESS", str(os.getpid()))
    with LocalCluster(2, processes=False, dashboard_address=None) as cluster:
        found = run(square, range(3), workers=Workers(1, "dask", cluster.scheduler_address))
    assert found == [(0, True), (1, True), (4, True)]  # its workers are threads of this process


@pytest.mark.parametrize("address", [NOWHERE, "moon://node:1"])
def test_a_silent_cluster_is_one_sentence(address, monkeypatch):
    monkeypatch.setattr("teasim.common.clusters.TIMEOUT", 0.3)
    with pytest.raises(ConfigError) as error:
        run(square, range(3), workers=Workers(2, "dask", address))
    assert str(error.value) == (
        f"No dask cluster answers at '{address}'; start one with 'dask scheduler' and give its "
        "address with --address, or choose the backend loky."
    )


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"jobs": 0}, "jobs is 0; choose 1 or more."),
        ({"backend": "mpi"}, "Unknown parallel backend 'mpi'; choose loky, dask, ray."),
        (
            {"address": NOWHERE},
            "The parallel backend 'loky' takes no --address; choose dask or ray, or leave it out.",
        ),
    ],
)
def test_unusable_settings_are_one_sentence(given, told):
    with pytest.raises(ConfigError) as error:
        Workers(**given)
    assert str(error.value) == told


@pytest.mark.parametrize("backend", ["dask", "ray"])
def test_a_back_end_that_is_not_installed_is_one_sentence(backend, monkeypatch):
    absent = module.BACKENDS[backend]
    monkeypatch.setattr(
        module, "find_spec", lambda name: None if name == absent else find_spec(name)
    )
    with pytest.raises(ConfigError) as error:
        Workers(backend=backend)
    assert str(error.value) == (
        f"The parallel backend '{backend}' is not installed; run 'pip install teasim[{backend}]' "
        "or choose loky."
    )


def where(_):
    """The current folder of a worker."""
    return os.getcwd()


def test_workers_are_where_the_caller_is(tmp_path, monkeypatch):
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        monkeypatch.chdir(folder)
        assert set(run(where, range(4), workers=Workers(2))) == {str(folder)}
