"""The verb cache, and the limit of the cache."""

import os
from pathlib import Path

import numpy as np
import pytest

from filtering.vision.cache import ArrayCache, default_limit, parse_size
from teasim.cli.main import main
from teasim.common.errors import ConfigError


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ArrayCache:
    monkeypatch.setenv("TEASIM_CACHE", str(tmp_path))
    monkeypatch.delenv("TEASIM_CACHE_LIMIT", raising=False)
    found = ArrayCache(tmp_path / "features")
    for number in range(4):
        found.put(f"k{number}", np.zeros(1000, np.uint8))
        os.utime(found.folder / f"k{number}.safetensors", ns=(0, number))
    return found


def test_it_shows_place_size_and_limit(cache: ArrayCache, capsys) -> None:
    assert main(["cache"]) == 0
    assert capsys.readouterr().out == (
        f"Folder: {cache.folder}\n"
        "Size:   0.00 GB in 4 files\n"
        "Limit:  10.00 GB (environment variable TEASIM_CACHE_LIMIT)\n"
    )
    assert cache.size()[0] == 4


def test_the_least_recently_used_go_first(cache: ArrayCache) -> None:
    assert cache.get("k0") is not None  # used last now
    assert main(["cache", "--limit", "2.5KB"]) == 0
    assert [cache.get(f"k{number}") is not None for number in range(4)] == [
        True,
        False,
        False,
        True,
    ]


def test_the_limit_of_the_environment_holds_whenever_something_is_kept(
    cache: ArrayCache, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TEASIM_CACHE_LIMIT", "2500")
    cache.put("k4", np.zeros(1000, np.uint8))
    assert cache.size()[0] == 2
    assert cache.get("k4") is not None


def test_clear_removes_everything_but_what_is_not_ours(cache: ArrayCache) -> None:
    (cache.folder / "x.partial").write_text("interrupted")
    (cache.folder / "mine.txt").write_text("x")
    assert main(["cache", "--clear"]) == 0
    assert [path.name for path in cache.folder.iterdir()] == ["mine.txt"]


def test_sizes(cache: ArrayCache, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    sizes = {"5GB": 5 * 10**9, "1.5 mb": 1_500_000, "2k": 2000, "17": 17, "0": 0, "3B": 3}
    assert {text: parse_size(text, "x") for text in sizes} == sizes
    for text in ("", "much", "-1", "5XB", "1e9"):
        with pytest.raises(ConfigError):
            parse_size(text, "x")
    assert main(["cache", "--limit", "much"]) == 2
    assert capsys.readouterr().err == (
        "teasim: --limit is 'much'; write a size such as 5GB or 500MB.\n"
    )
    monkeypatch.setenv("TEASIM_CACHE_LIMIT", "lots")
    with pytest.raises(ConfigError, match="TEASIM_CACHE_LIMIT is 'lots'; write a size such as"):
        default_limit()
