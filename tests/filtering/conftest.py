"""A small toy pool and a feature cache of the test session's own."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from teasim.pool import Pool
from tests.toy_pool import SEQ_1, make_toy_pool

WITHOUT_WATER = tuple(name for name in SEQ_1 if name != "add_water")
WITHOUT_OFF = tuple(name for name in SEQ_1 if name != "turn_off_oven")
TOY_SEQUENCES = [SEQ_1, SEQ_1, WITHOUT_WATER, SEQ_1, SEQ_1, WITHOUT_OFF, SEQ_1]


def real_data(name: str) -> Path:
    """Folder of a public data set, in TEASIM_DATA or ../shared/data; without it the test skips."""
    shared = Path(__file__).parents[2].parent / "shared" / "data"
    folder = Path(os.environ.get("TEASIM_DATA", shared)) / name
    if not folder.is_dir():
        pytest.skip(f"the data set {name} is not here; set TEASIM_DATA to the folder it is in")
    return folder


@pytest.fixture(scope="session", autouse=True)
def feature_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TEASIM_CACHE", str(folder))
        yield folder


@pytest.fixture(scope="session")
def toy_pool(tmp_path_factory: pytest.TempPathFactory) -> Pool:
    path = tmp_path_factory.mktemp("pools") / "toy"
    return make_toy_pool(path, TOY_SEQUENCES, frames_per_subtask=6)


@pytest.fixture(scope="session")
def toy_filter(toy_pool: Pool) -> DemoFilter:
    return DemoFilter(FilterConfig(segmenter="logged")).fit(toy_pool)
