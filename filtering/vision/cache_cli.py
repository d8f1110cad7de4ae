"""The verb `cache`: how much the cached features of videos take, and making that less."""

from collections.abc import Sequence
from dataclasses import dataclass

import tyro

from teasim.common.cli import parse

EXAMPLES = ("teasim cache", "teasim cache --limit 5GB")


@dataclass(frozen=True)
class CacheSettings:
    """Show or clear the cache of image features, $TEASIM_CACHE or ~/.cache/teasim."""

    limit: str | None = None
    """Remove the least recently used features until the cache takes at most this much, e.g. 5GB.
    The limit of every run is the environment variable TEASIM_CACHE_LIMIT, 10GB by default."""
    clear: tyro.conf.FlagCreatePairsOff[bool] = False
    """Remove all features; they are computed again when they are needed."""


def main(argv: Sequence[str] | None = None) -> int:
    """Show how large the cache of image features is; limit or clear it.

    Raises:
        ConfigError: the limit is no size.
    """
    settings = parse(CacheSettings, argv, verb="cache", examples=EXAMPLES)
    from filtering.vision.cache import ArrayCache, default_folder, default_limit, parse_size

    cache = ArrayCache(default_folder())
    if settings.limit is not None:
        cache.shrink(parse_size(settings.limit, "--limit"))
    if settings.clear:
        cache.clear()
    count, size = cache.size()
    print(f"Folder: {cache.folder}")
    print(f"Size:   {size / 1e9:.2f} GB in {count} files")
    print(f"Limit:  {default_limit() / 1e9:.2f} GB (environment variable TEASIM_CACHE_LIMIT)")
    return 0
