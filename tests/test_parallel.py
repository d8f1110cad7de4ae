"""Parallel maps whose workers fail."""

import os

import pytest

from teasim.common.errors import WorkerError
from teasim.common.parallel import run


def die(item: int) -> int:
    """End the worker process as the system does when memory runs out."""
    os._exit(item)


def test_a_killed_worker_is_named_and_the_cure_as_well():
    with pytest.raises(WorkerError) as error:
        run(die, [9, 9, 9], jobs=2, description="demonstrations", progress=False)
    assert str(error.value) == (
        "A worker process was killed after 0 of 3 demonstrations, usually because memory ran out; "
        "run the same command again with fewer --jobs."
    )
