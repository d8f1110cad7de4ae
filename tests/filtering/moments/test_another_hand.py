"""Honest demonstrations of another person, whose hands look different and rest elsewhere."""

import pytest

from filtering.moments.decision import DISTRUST
from filtering.moments.score import score_moments
from tests.filtering.moments.toy_videos import HEIGHT, STEPS, WIDTH, toy_video

LIGHT, DARK = (225, 180, 150), (90, 55, 35)
TEMPO = 3.0
"""So slow that an arm lies in one place for longer than effects are looked for."""


def by_hand(seed, colour, *, works=None):
    """A toy video in which an arm lies on the table in every step; the dark one elsewhere."""
    video = toy_video(range(STEPS), seed, tempo=TEMPO, works=works)
    for moment, cells in enumerate(video.cells):
        step, share = divmod(moment / len(video.cells) * STEPS, 1)
        if 0.15 < share < 0.85:
            column = (5 * int(step) + (9 if colour == DARK else 0) + moment % 2) % (WIDTH - 6)
            cells[HEIGHT - 7 :, column : column + 6] = colour
    return video


@pytest.mark.parametrize("others", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", [0, 400, 500])
def test_another_hand_is_hardly_accused(seed, others):
    """At most one of them is, and by so little that it still says what is usual."""
    videos = [by_hand(seed + number, LIGHT) for number in range(8)]
    videos += [by_hand(seed + 50 + number, DARK) for number in range(others)]
    score = score_moments({"front": videos})
    assert len(set(score.actors["front"])) == 2
    assert score.flagged.sum() <= 1
    assert score.strengths.max() < DISTRUST


def test_a_step_without_effect_stands_out_beside_another_hand():
    works = [True] * STEPS
    works[2] = False
    videos = [by_hand(seed, LIGHT) for seed in range(8)]
    videos += [by_hand(seed, DARK) for seed in range(8, 11)]
    videos.append(by_hand(11, LIGHT, works=works))
    score = score_moments({"front": videos})
    assert score.strengths.argmax() == 11
    assert score.findings[11][0].kind == "ineffective"
