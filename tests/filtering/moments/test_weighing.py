"""How much looks count beside places."""

import numpy as np

from filtering.moments.counterparts import find_counterparts
from filtering.moments.structure import shared_structure
from filtering.moments.vectors import Video, moment_blocks
from filtering.moments.weighing import WEIGHTS, weighed_vectors
from tests.filtering.moments.toy_videos import usual_videos


def same(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def with_other_places(videos):
    """Let what lies where change in another way in each video; looks are noisy."""
    rng, noise = np.random.default_rng(0), np.random.default_rng(1)
    walks = [np.cumsum(rng.normal(0, 9, video.cells.shape), axis=0) for video in videos]
    return [
        Video(
            video.looks + noise.normal(0, 1, video.looks.shape),
            np.clip(128 + walk, 0, 255).astype(np.uint8),
        )
        for video, walk in zip(videos, walks, strict=True)
    ]


def test_looks_and_places_count_alike_where_both_agree():
    videos = usual_videos(5)
    assert same(weighed_vectors(videos), moment_blocks(videos).vectors())


def test_looks_count_more_where_places_tell_nothing():
    videos = with_other_places(usual_videos(5))
    blocks = moment_blocks(videos)
    weighed = weighed_vectors(videos)
    assert same(weighed, blocks.vectors(WEIGHTS[-1]))
    plain = shared_structure(find_counterparts(blocks.vectors()))
    assert shared_structure(find_counterparts(weighed)) > plain + 0.1
