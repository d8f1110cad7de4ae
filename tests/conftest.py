"""What all tests share: one thread per process, and a cache folder of their own."""

import os
from collections.abc import Iterator

import pytest
from hypothesis import settings

from teasim.common.parallel import WORKER_ENVIRONMENT

# Before torch or a renderer is loaded: the processes of the test run are the parallelism.
for name, value in WORKER_ENVIRONMENT.items():
    os.environ.setdefault(name, value)

# A slow machine is no defect: property tests are bounded by their number of examples, and the same
# examples are drawn in every run.
settings.register_profile("teasim", deadline=None, derandomize=True)
settings.load_profile("teasim")


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the tests out of the user's cache of image features."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TEASIM_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield
