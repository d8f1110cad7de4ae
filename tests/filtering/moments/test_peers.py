"""Which videos look alike, and who says what is usual for whom."""

import numpy as np
import pytest

from filtering.judging.moments import told_of_actors, told_of_looks
from filtering.moments import score
from filtering.moments.counterparts import compare
from filtering.moments.effects.observed import Effects
from filtering.moments.effects.unexpected import Unexpected
from filtering.moments.evidence.kinds import missing_order_extra
from filtering.moments.evidence.strange import strange_in
from filtering.moments.evidence.stretches import Stretch
from filtering.moments.evidence.usual import Reference, references_of
from filtering.moments.peers.peers import Peers, everybody, looks_of
from filtering.moments.score import gather, score_moments
from tests.filtering.moments.toy_videos import FEATURES, STEPS, toy_video

HAND = np.random.default_rng(5).normal(0, 1, (3, FEATURES)).astype(np.float32)
"""What another hand changes: something at all times, and more while it moves about."""


def pool(hands, orders=None):
    """Videos by the hand, 0 or 1, that each shows; all steps in order unless told otherwise."""
    orders = orders or [range(STEPS)] * len(hands)
    videos = [toy_video(order, seed) for seed, order in enumerate(orders)]
    for video, hand in zip(videos, hands, strict=True):
        here = np.tanh(video.looks @ HAND[1:].T / 4)  # (n, 2) where in the picture it is
        video.looks[:] += hand * (HAND[0] + here @ HAND[1:])
    return videos


def looks_in(videos):
    return looks_of(compare([video.looks for video in videos], range(len(videos))))


def test_videos_of_two_hands_look_different():
    hands = [0, 1, 0, 0, 1, 0, 0, 1, 0, 0]
    looks = looks_in(pool(hands))
    assert len(set(looks)) == 2
    assert all(len({looks[d] for d in range(10) if hands[d] == hand}) == 1 for hand in (0, 1))


@pytest.mark.parametrize("hands", [[0] * 10, [0] * 8 + [1] * 2])
def test_one_hand_or_two_videos_of_another_are_one_look(hands):
    assert set(looks_in(pool(hands))) == {0}


def test_what_is_left_out_makes_no_look():
    orders = [range(STEPS)] * 6 + [[0, 3, 4]] * 4
    assert set(looks_in(pool([0] * 10, orders))) == {0}


def test_what_is_seen_until_the_end_is_no_look_unless_it_was_there_from_the_beginning():
    """What comes of a mistake, such as an oven left on, is no other way of looking."""
    for begins, looks in ((0.3, 1), (0.0, 2)):
        videos = pool([0] * 12)
        for video in videos[1::3]:
            video.looks[round(begins * len(video.looks)) :] += 2 * HAND[0]
        assert len(set(looks_in(videos))) == looks


def test_videos_that_are_no_references_have_the_look_of_the_nearest():
    hands = [0, 1] * 6
    videos = pool(hands)
    found = compare([video.looks for video in videos], [0, 1, 2, 3, 4, 5])
    looks = looks_of(found)
    assert looks.tolist() in ([0, 1] * 6, [1, 0] * 6)


def test_peers_are_the_trusted_of_the_same_look_if_there_are_enough():
    peers = Peers(np.array([True] * 5 + [False]), np.array([0, 0, 0, 1, 1, 1]))
    assert peers.of(0).tolist() == [True] * 3 + [False] * 3
    assert peers.of(5).tolist() == [True] * 5 + [False]
    assert peers.alike(5).tolist() == [False] * 3 + [True] * 2 + [False]


def test_peers_told_apart_by_other_looks_are_alike_in_both():
    peers = Peers(np.ones(4, dtype=bool), np.array([0, 0, 1, 1])).told_apart(np.array([0, 1, 1, 1]))
    assert [peers.alike(d).sum() for d in range(4)] == [1, 1, 2, 2]


def test_a_few_correct_videos_of_another_hand_are_not_accused():
    hands = [1, 1, 1, 1, *[0] * 8]
    assert not score_moments({"front": pool(hands)}).flagged.any()


def test_an_order_is_judged_among_all_and_the_rest_among_the_same_actor():
    actors = np.array([1] * 5 + [0] * 8)
    orders = [[0, 1, 5, 3, 4]] * 2 + [[2, 0, 1, 3, 4]] * 2 + [range(STEPS)] * 9
    videos = pool(actors, orders)
    found = compare([video.looks for video in videos], range(len(videos)))
    everyone = everybody(np.zeros_like(actors))
    strange = strange_in(found, np.zeros_like(actors))
    references = references_of(found, everyone)
    alike = references_of(found, everyone.told_apart(actors))
    among_all = missing_order_extra(references, references, strange)
    by_actor = missing_order_extra(alike, alike, strange)
    nowhere = Stretch(0, 0, 1)
    effects = Effects((), (Unexpected(0.0, nowhere, nowhere),) * len(videos), actors)
    gathered = gather(found, references, strange, effects, everyone)
    for kind, same, whole in zip(("missing", "order", "extra"), by_actor, among_all, strict=True):
        expected = whole if kind == "order" else same
        assert (same.values != whole.values).any()
        assert gathered[kind].values.tolist() == expected.values.tolist()


def test_what_is_strange_is_so_among_those_that_look_and_act_alike(monkeypatch):
    asked: list[list[int]] = []

    def strange(found, looks):
        asked.append(looks.tolist())
        return strange_in(found, looks)

    monkeypatch.setattr(score, "strange_in", strange)
    monkeypatch.setattr(score, "looks_of", lambda found: np.zeros(len(found.lengths), int))
    hands = [1] * 3 + [0] * 5
    videos = pool([0] * 8)
    for video, hand in zip(videos, hands, strict=True):
        for moment, cells in enumerate(video.cells):
            column = moment * 5 % 18
            cells[-6:, column : column + 6] = (90, 55, 35) if hand else (225, 180, 150)
    told = score_moments({"front": videos})
    assert asked == [told.actors["front"].tolist()]
    assert len(set(asked[0])) == 2


def test_what_two_that_look_alike_do_is_usual_for_them_too():
    videos = pool([0] * 8, [[0, 1, 3, 4], [0, 1, 3, 4], *[range(STEPS)] * 6])
    found = compare([video.looks for video in videos], range(8))
    one, two = np.zeros(8, int), np.array([1, 1, *[0] * 6])
    lacks = [Reference(found, 5, everybody(looks)).lack(0).max() for looks in (one, two)]
    assert lacks[1] < lacks[0] / 2


@pytest.mark.parametrize(
    ("count", "consequence"),
    [
        (3, "what is usual among them does not count against them."),
        (2, "they are too few to tell whether a step of theirs had no effect."),
    ],
)
def test_another_hand_is_told_with_names(count, consequence):
    actors = np.array([1] * count + [0] * 4)
    names = [f"video {d}" for d in range(len(actors))]
    (told,) = told_of_actors({"front": actors}, names)
    assert told == (
        f"Camera front sees another actor in {count} of {count + 4} demonstrations "
        f"({', '.join(names[:count])}), told by the colours of what moves: {consequence}"
    )


def test_one_hand_is_not_told():
    assert not told_of_actors({"front": np.zeros(5, dtype=int)}, ["a"] * 5)


def test_a_look_is_told_with_names():
    told = told_of_looks({"front": np.array([0, 1, 1, 0, 0])}, ["a", "b", "c", "d", "e"])
    assert told == (
        "Camera front sees another look in 2 of 5 demonstrations (b, c), from beginning to end: "
        "what is usual among them does not count against them.",
    )
    many = told_of_looks({"top": np.array([0] * 10 + [1] * 9)}, [f"video {n}" for n in range(19)])
    assert "(video 10, " in many[0]
    assert "video 17 and 1 more)" in many[0]
    assert told_of_looks({"front": np.zeros(3, int)}, ["a", "b", "c"]) == ()


def test_a_mistake_is_found_among_videos_of_its_own_hand():
    hands = [1, 1, 1, 1, *[0] * 8]
    orders = [[0, 1, 3, 4], *[range(STEPS)] * 11]
    flagged = score_moments({"front": pool(hands, orders)}).flagged
    assert flagged.tolist() == [True] + [False] * 11
