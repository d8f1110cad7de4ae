"""Which features of a data set are pictures, and what their cameras are called."""

from collections.abc import Mapping
from typing import Any

from teasim.pool.lerobot import layout

PICTURES = ("video", "image")
"""Kinds of features that are pictures, in files of their own or in the log."""


def camera_keys(features: Mapping[str, Any]) -> dict[str, str]:
    """Return the feature key of each camera by its short name; depth cameras are left out.

    'observation.images.top' is 'top', 'observation.image' is 'image'. Where two keys would come
    to the same name, each camera is called by its key.
    """
    keys = [key for key in _pictures(features) if not is_depth(key, features[key])]
    names = [_short(key) for key in keys]
    return dict(zip(names if len(set(names)) == len(names) else keys, keys, strict=True))


def depth_keys(features: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the keys of the depth cameras."""
    return tuple(key for key in _pictures(features) if is_depth(key, features[key]))


def is_depth(key: str, spec: Mapping[str, Any]) -> bool:
    """Whether a feature holds distances in place of colours."""
    told = [spec, *(spec.get(name) for name in ("info", "video_info"))]
    facts = {
        name: value for part in told if isinstance(part, Mapping) for name, value in part.items()
    }
    if facts.get("video.is_depth_map") is True or facts.get("is_depth_map") is True:
        return True
    grey = str(facts.get("video.pix_fmt", "")).startswith("gray1")
    return "depth" in key.lower() and (grey or spec["shape"][-1:] == [1])


def _pictures(features: Mapping[str, Any]) -> list[str]:
    return [key for key, spec in features.items() if spec["dtype"] in PICTURES]


def _short(key: str) -> str:
    return key.removeprefix(layout.CAMERA_PREFIX).removeprefix(layout.OBSERVATION_PREFIX)
