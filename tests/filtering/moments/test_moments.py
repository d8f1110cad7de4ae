import numpy as np
import pytest

from filtering.judging.moments import Timeline, judge_moments
from filtering.moments.agreement import agree
from filtering.moments.confirmed import confirmation
from filtering.moments.counterparts import (
    APART,
    Counterparts,
    Match,
    choose_references,
    compare,
    find_counterparts,
    find_match,
    recurring,
)
from filtering.moments.decision import KINDS, UNLIKE, Observed, exceedances, judge
from filtering.moments.effects.changes import states_of
from filtering.moments.effects.usual_changes import usual_change
from filtering.moments.evidence import kinds
from filtering.moments.evidence.orders import variety_of
from filtering.moments.evidence.replaced import Side, replaced
from filtering.moments.evidence.stretches import BRIEF, brief, peak, worst
from filtering.moments.evidence.usual import moved, usual_of, usual_of_others
from filtering.moments.score import score_moments
from filtering.moments.suitable import comparable
from filtering.moments.vectors import Video, moment_blocks
from filtering.moments.windows import PACES, window_distances
from teasim.common.errors import ConfigError
from tests.filtering.moments.toy_videos import LENGTH, STEPS, toy_video, usual_videos

MISSING = [0, 1, 3, 4]
SWAPPED = [0, 3, 1, 2, 4]


def unique(count):
    """Return which of some moments recur: none."""
    return np.zeros(count, dtype=np.bool_)


def judged(videos):
    return score_moments({"front": videos})


@pytest.fixture(scope="module")
def with_a_step_missing():
    return judged([*usual_videos(7), toy_video(MISSING, 50)])


def test_window_distances_are_sums_along_the_pace_that_fits_best():
    rng = np.random.default_rng(0)
    one, other = (rng.normal(size=(n, 3)).astype(np.float32) for n in (12, 15))
    distances = window_distances(one, other, reach=2)
    direct = min(
        np.sqrt(
            sum(
                np.square(one[5 + round(p * i)] - other[7 + round(q * i)]).sum()
                for i in range(-2, 3)
            )
        )
        for p, q in PACES
    )
    assert distances.shape == (12, 15)
    assert distances[5, 7] == pytest.approx(direct, rel=1e-4)
    assert np.allclose(distances.T, window_distances(other, one, reach=2), atol=1e-3)


def test_a_video_is_its_own_counterpart():
    video = moment_blocks(usual_videos(3)).vectors()
    found = compare([video[0], video[0].copy()], (0, 1))
    match = found.there[0][1]
    assert match is not None
    assert np.array_equal(match.at, np.arange(len(video[0])))


def test_a_place_belongs_to_the_moment_that_fits_it_best():
    # Two steps look alike; the second one is left out of the other video.
    distances = np.full((40, 20), 8.0, dtype=np.float32)
    distances[np.arange(20), np.arange(20)] = 1.0
    distances[np.arange(20, 40), np.arange(20)] = 2.0
    found = find_match(distances, unique(40), unique(20))
    assert np.array_equal(found.nearest, np.tile(np.arange(20), 2))
    assert np.allclose(found.near[20:], np.log(2.0), atol=1e-5)
    assert np.allclose(found.contested[:20], 0.0, atol=1e-5)
    assert np.allclose(found.contested[20:], 2 * np.log(2.0), atol=1e-5)


def test_moments_close_by_do_not_contest_a_place():
    distances = np.full((APART + 1, 1), 2.0, dtype=np.float32)
    distances[0] = 1.0
    found = find_match(distances, unique(APART + 1), unique(1))
    assert np.array_equal(found.contested, found.near)


def test_a_moment_recurs_where_it_or_its_counterpart_does():
    distances = np.where(np.eye(9, dtype=bool), 1.0, 8.0).astype(np.float32)
    own, other = unique(9), unique(9)
    own[[2, 3]], other[[3, 5]] = True, True
    match = find_match(distances, own, other)
    assert np.flatnonzero(match.recurs).tolist() == [2, 3, 5]
    assert np.flatnonzero(match.again).tolist() == [3]


def test_the_place_of_what_recurs_is_not_contested():
    distances = np.array([[1.0]] * (APART + 1) + [[2.0]], dtype=np.float32)
    own = unique(APART + 2)
    assert find_match(distances, own, unique(1)).contested[-1] == pytest.approx(2 * np.log(2.0))
    own[-1] = True
    assert find_match(distances, own, unique(1)).contested[-1] == pytest.approx(np.log(2.0))


def test_who_rests_less_has_left_nothing_out():
    rests = [[30, 0, 0, 0, 30], [0, 30, 0, 0, 30], [0, 0, 30, 0, 30], [0, 0, 0, 30, 30]]
    last = [60, 0, 0, 0, 0]
    steps = [*[range(STEPS)] * 9, MISSING]
    found = [*rests, *rests, last, rests[0][1:]]
    score = judged([toy_video(steps[d], d, rests=found[d]) for d in range(10)])
    assert score.exceeded["missing"].argmax() == 9
    assert score.exceeded["missing"][8] < 0.3 * score.exceeded["missing"][9]


def test_what_a_video_shows_twice_recurs():
    rng = np.random.default_rng(3)
    step, rest, other = (rng.normal(size=(30, 8)).cumsum(axis=0) for _ in range(3))
    rest = rest.mean(axis=0) + 0.1 * rng.normal(size=(30, 8))
    assert not recurring(np.concatenate([step, other]).astype(np.float32)).any()
    found = recurring(np.concatenate([rest, step, rest, other]).astype(np.float32))
    assert found[8:22].all()
    assert found[68:82].all()
    assert not found[38:52].any()
    assert not found[98:].any()
    assert not recurring(np.zeros((5, 3), np.float32)).any()


def test_rests_have_no_place_and_do_not_hide_an_order():
    rng = np.random.default_rng(5)
    orders = [*[range(STEPS)] * 8, SWAPPED]
    rests = [rng.permutation([30, 30, 0, 0, 0]).tolist() for _ in orders]
    score = judged([toy_video(orders[d], d, rests=rests[d]) for d in range(9)])
    assert score.one_order > 0.7
    assert score.exceeded["order"][8] > 1
    assert score.exceeded["order"][:8].max() < 0.2


def test_what_three_of_ten_videos_do_is_usual():
    # The reference and the judged one are counted in, so that eight others are left.
    others = np.array([[0.0]] * 6 + [[1.0]] * 2)
    assert usual_of(others) == 1.0
    others[-1] = 0.0
    assert usual_of(others) == 0.0


def test_orders_are_free_where_no_order_is_kept_by_half():
    def moves(orders):
        far = (orders[:, None] != orders[None, :]).astype(float)
        np.fill_diagonal(far, np.nan)
        return far

    assert variety_of(moves(np.r_[np.zeros(10), np.arange(1, 9)])) == 0.0
    assert variety_of(moves(np.repeat(np.arange(6), 2))) == 1.0


def test_a_missing_step_is_found_at_its_place(with_a_step_missing):
    score = with_a_step_missing
    assert score.losses.argmax() == 7
    assert score.flagged.tolist() == [False] * 7 + [True]
    missing = next(one for one in score.findings[7] if one.kind == "missing")
    # The step is the third of five: in the other video it lies there.
    middle = (missing.other.start + missing.other.stop) / 2
    assert abs(middle - 2.5 * LENGTH) < LENGTH
    assert missing.other.video != 7


def test_a_step_out_of_order_is_found():
    score = judged([*usual_videos(7), toy_video(SWAPPED, 50)])
    assert score.losses.argmax() == 7
    assert score.flagged[7]
    assert score.exceeded["order"].argmax() == 7


def test_an_extra_step_is_found():
    score = judged([*usual_videos(7), toy_video([0, 1, 5, 2, 3, 4], 50)])
    assert score.losses.argmax() == 7
    assert score.exceeded["extra"].argmax() == 7


def test_a_step_without_effect_is_found_though_its_motion_is_as_usual():
    works = [True, True, False, True, True]
    score = judged([*usual_videos(7), toy_video(range(STEPS), 50, works=works)])
    assert score.exceeded["ineffective"].argmax() == 7
    assert score.losses.argmax() == 7


def test_a_pool_without_mistakes_is_not_accused():
    assert not judged(usual_videos(9)).flagged.any()


@pytest.mark.parametrize("tempo", [0.8, 0.9, 1.1, 1.25])
def test_a_correct_video_of_another_tempo_is_not_accused(tempo):
    score = judged([*usual_videos(7), toy_video(range(STEPS), 50, tempo=tempo)])
    assert not score.flagged.any()


@pytest.mark.parametrize("seed", [0, 100, 200])
def test_correct_videos_of_all_tempi_are_not_accused(seed):
    tempi = np.geomspace(0.8, 1.25, 9)
    videos = [toy_video(range(STEPS), seed + n, tempo=tempo) for n, tempo in enumerate(tempi)]
    assert not judged(videos).flagged.any()


def test_eight_of_eighteen_that_leave_steps_out_are_found():
    # Seven leave step 2 out, more than pass for variety until the four that also leave 1 out go.
    wrong = [[0, 1, 3, 4]] * 3 + [[0, 3, 4]] * 4 + [[0, 1, 2, 4]]
    videos = [toy_video(order, 50 + number) for number, order in enumerate(wrong)]
    flagged = judged([*usual_videos(10), *videos]).flagged
    assert flagged.tolist() == [False] * 10 + [True] * 8


def test_a_missing_step_stands_out_among_other_tempi():
    tempi = (0.9, 1.0, 1.1) * 3
    videos = [toy_video(range(STEPS), seed, tempo=tempo) for seed, tempo in enumerate(tempi)]
    score = judged([*videos, toy_video(MISSING, 50)])
    assert score.losses.argmax() == len(videos)
    assert score.flagged[-1]


def test_the_same_videos_give_the_same_bits(with_a_step_missing):
    again = judged([*usual_videos(7), toy_video(MISSING, 50)])
    assert np.array_equal(again.losses, with_a_step_missing.losses)


def test_demonstrations_in_another_order_get_their_own_losses(with_a_step_missing):
    videos = [toy_video(MISSING, 50), *usual_videos(7)]
    assert np.allclose(
        judged(videos).losses, np.roll(with_a_step_missing.losses, 1), rtol=1e-2, atol=1e-2
    )


def test_a_camera_that_sees_nothing_changes_nothing(with_a_step_missing):
    videos = [*usual_videos(7), toy_video(MISSING, 50)]
    blind = [Video(np.zeros_like(v.looks), np.full_like(v.cells, 90)) for v in videos]
    both = score_moments({"front": videos, "blind": blind})
    assert np.array_equal(both.losses, with_a_step_missing.losses)


def test_a_verdict_says_where_it_is_seen():
    videos = [*usual_videos(7), toy_video(MISSING, 50)]
    timeline = Timeline([2 * len(v) for v in videos], [f"video {n}" for n in range(8)], 10.0)
    found, _ = judge_moments(comparable({"front": videos}), timeline)
    assert found.grouping.flagged.tolist() == [False] * 7 + [True]
    assert found.reasons is not None
    assert "video" in found.reasons[7]
    assert found.weights[7] < 0.5 < found.weights[:7].min()


def test_large_pools_are_compared_with_central_videos_alone():
    rng = np.random.default_rng(0)
    vectors = [rng.normal(size=(12, 2)).astype(np.float32) for _ in range(40)]
    references = choose_references(vectors)
    assert len(references) == 30 - 6  # the most central three fifths of 40
    assert len(compare(vectors, references).there[0]) == 40


def observed(values, variety=0.0, kept=None):
    kept = np.ones(len(values)) if kept is None else np.asarray(kept)
    return Observed(dict.fromkeys(KINDS, np.asarray(values)), variety, kept)


def test_an_evidence_is_measured_against_its_pool():
    values = np.array([0.1, 0.2, 0.15, 0.12, 0.9])
    everybody = np.ones(5, dtype=bool)
    for kind in KINDS:
        found = exceedances(kind, observed(values), everybody)
        assert found.argmax() == 4
        assert np.allclose(found, exceedances(kind, observed(values - 3), everybody))
        free = exceedances(kind, observed(values, variety=0.3), everybody)
        assert 0 < free[4] < found[4]


@pytest.mark.parametrize("kind", KINDS)
def test_where_videos_are_found_badly_in_each_other_missing_and_extra_moments_count_less(kind):
    values = np.array([0.1, 0.2, 0.15, 0.12, 0.9])
    trusted = np.array([True, True, True, True, False])
    pool = observed(values)
    found = exceedances(kind, pool, trusted)
    for level in (0.3, UNLIKE):  # as far as it is usual
        seen = pool._replace(values={**pool.values, "extra": values - values[2] + level})
        assert np.allclose(exceedances(kind, seen, trusted), found)
    unlike = pool._replace(values={**pool.values, "extra": values + 2 * UNLIKE})
    less = exceedances(kind, unlike, trusted)[4]
    assert less < found[4] if kind in ("missing", "extra") else less == found[4]
    distrusted = pool._replace(values={**pool.values, "extra": np.where(trusted, values, 50.0)})
    if kind != "extra":
        assert np.array_equal(exceedances(kind, distrusted, trusted), found)


def test_an_evidence_is_measured_against_the_trusted_alone():
    values = np.array([0.1, 0.2, 0.15, 0.12, 0.9])
    trusted = np.array([True, True, True, True, False])
    far = np.where(trusted, values, 50.0)
    expected = exceedances("missing", observed(values), trusted)
    assert np.array_equal(exceedances("missing", observed(far), trusted)[:4], expected[:4])


def test_a_small_move_is_out_of_order_if_hardly_anybody_else_keeps_that_order():
    everybody = np.ones(5, dtype=bool)
    small = observed([0.01, 0.02, 0.01, 0.02, 0.12], kept=[1.0, 0.75, 1.0, 0.75, 0.25])
    assert (exceedances("order", small, everybody) > 1).tolist() == [False] * 4 + [True]
    assert not (exceedances("missing", small, everybody) > 1).any()
    free = small._replace(kept=np.array([0.25, 0.5, 0.25, 0.5, 0.0]))
    assert not (exceedances("order", free, everybody) > 1).any()
    none = observed([0.01, 0.02, 0.01, 0.02, 0.03], kept=small.kept)
    assert not (exceedances("order", none, everybody) > 1).any()


def test_who_is_flagged_is_trusted_no_longer():
    told = []

    def evidence(trusted):
        told.append(trusted.tolist())
        values = np.array([0.1, 0.1, 0.1, 0.1, 0.1, 0.4, 2.0])
        # Without the worst one the last but one stands out, as of two that hide each other.
        values[5] += 2.0 * (not trusted[6])
        return [observed(values)]

    trusted, _ = judge(evidence, 7)
    assert told[0] == [True] * 7
    assert trusted.tolist() == [True] * 5 + [False] * 2


def test_half_of_a_pool_is_always_trusted():
    def evidence(trusted):
        return [observed(np.arange(6.0) * 10 * (trusted.sum() - 1))]

    trusted, _ = judge(evidence, 6)
    assert trusted.sum() >= 3


def test_a_moved_step_passes_what_lies_between():
    sure = np.ones(30, dtype=bool)
    usual, late = np.arange(30), np.r_[0:10, 20:30, 10:20]
    at = np.argsort(late)  # moments 10-20 come after moments 20-30
    assert not moved(usual, sure).any()
    assert not moved(usual * 2, sure).any()  # another tempo
    far = moved(at, sure)
    assert not far[:10].any()
    assert far[10:].min() > 0.15
    assert not moved(at, ~sure).any()


def test_passed_moments_are_a_share_of_the_sure_ones_but_of_half_a_video_at_least():
    at = np.argsort(np.r_[0:10, 20:30, 10:20])
    for sure, of in ((np.arange(30) >= 10, 20), (np.arange(30) % 3 == 0, 15)):
        most = sure[10:20].sum()  # every late moment is passed by this many
        assert moved(at, sure).max() == pytest.approx(most / of)


def test_sub_tasks_are_compared_where_moments_have_a_place():
    at, zero = np.arange(20), np.zeros(20, np.float32)
    labels = np.repeat([0, 1], 10)
    other = np.where((at >= 5) & (at < 10), 1, labels)

    def agreement(recurs):
        match = Match(zero, at, zero, at, recurs, recurs)
        both = ((None, match), (match, None))
        return confirmation(Counterparts((20, 20), (0, 1), both, both), [labels, other])

    assert agreement(other != labels) == 1
    assert agreement(unique(20)) < 0.6
    assert agreement(~unique(20)) == 0


@pytest.mark.parametrize(
    ("gap", "filled", "expected"), [(0, 0.0, 0.0), (20, 1.0, 1.0), (20, 0.0, 0)]
)
def test_a_stretch_is_replaced_where_its_time_is_filled(gap, filled, expected):
    curve = np.zeros(60)
    curve[20:40] = 1.0
    at = np.r_[np.arange(20), np.full(20, 20), 20 + gap + np.arange(20)]
    other = np.zeros(40 + gap)
    other[20 : 20 + gap] = filled
    assert replaced(Side(curve, at), other, 20, 40) == expected


def test_the_worst_twelfth_counts():
    curve = np.zeros(48)
    curve[20:24] = 1.0
    assert worst(curve) == 1.0
    start, stop = peak(curve)
    assert start <= 20
    assert stop >= 24


@pytest.mark.parametrize("length", [48, 480])
def test_a_strange_second_counts_alike_in_short_and_long_videos(length):
    curve = np.zeros(length)
    curve[20 : 20 + BRIEF] = 1.0
    assert brief(curve) == 1.0
    curve[20] = 0.0
    assert brief(curve) == pytest.approx(1 - 1 / BRIEF)
    assert brief(np.array([1.0, 3.0])) == 2.0


@pytest.mark.parametrize(
    ("kind", "order"), [("missing", MISSING), ("extra", [0, 1, 5, 2, 3, 4]), ("order", SWAPPED)]
)
def test_missing_and_extra_steps_are_summed_up_by_their_strangest_second(kind, order, monkeypatch):
    """Where nothing is strange for a second, they are not found; a wrong order still is."""
    videos = [*usual_videos(7), toy_video(order, 50)]
    assert judged(videos).exceeded[kind][7] > 1
    monkeypatch.setattr(kinds, "brief", lambda _: 0.0)
    assert (judged(videos).exceeded[kind][7] > 1) == (kind == "order")


def test_what_a_share_of_the_others_reaches_is_usual():
    values = np.repeat(np.array([0.0, 5.0]), [7, 4])[None]
    everybody, few = np.ones(11, dtype=bool), np.arange(11) < 8
    assert usual_of_others(values, everybody).tolist() == [[5.0] * 11]
    assert usual_of_others(values[:, :10], everybody[:10]).tolist() == [[5.0] * 7 + [5.0] * 3]
    assert usual_of_others(values, few).tolist() == [[0.0] * 11]
    assert usual_of_others(values, ~everybody).tolist() == [[0.0] * 11]


def test_none_but_one_is_not_usual_for_that_one():
    values = np.array([[0.0, 0.0, 3.0]])
    assert usual_of_others(values, np.ones(3, dtype=bool)).tolist() == [[3.0, 3.0, 0.0]]


def test_what_changes_nowhere_is_no_usual_change():
    nothing = np.zeros((5, 6, 8, 3), dtype=np.float32)
    change = nothing + 80
    assert usual_change(0, nothing, nothing) is None
    assert usual_change(0, change, change) is not None


def test_what_changes_back_is_no_usual_change():
    nothing = np.zeros((5, 6, 8, 3), dtype=np.float32)
    assert usual_change(0, nothing + 80, nothing) is None


def test_states_do_not_depend_on_the_light():
    video = usual_videos(1)[0]
    dark = Video(video.looks, (video.cells * 0.5).astype(np.uint8))
    difference = np.abs(states_of(video).astype(float) - states_of(dark).astype(float))
    assert difference.mean() < 3


def test_borders_of_agreed_stretches_lie_where_orders_differ():
    orders = [[0, 1, 2, 3, 4], [0, 2, 1, 3, 4], [0, 1, 2, 3, 4], [0, 2, 1, 3, 4]] * 2
    videos = [toy_video(order, seed) for seed, order in enumerate(orders)]
    agreed = agree(find_counterparts(moment_blocks(videos).vectors()))
    assert agreed.borders
    assert all(0 < share <= 1 for share in agreed.borders)
    near = [min(abs(s.start - k * LENGTH) for s in agreed.stretches[1:]) for k in (1, 3)]
    assert min(near) <= LENGTH // 2


def test_fewer_than_three_videos_are_refused():
    with pytest.raises(ConfigError, match=r"^2 videos were given; moments need 3 or more"):
        judged(usual_videos(2))


def test_a_video_too_short_is_refused():
    short = Video(np.zeros((4, 3), np.float32), np.zeros((4, 6, 8, 3), np.uint8))
    with pytest.raises(ConfigError, match=r"^Video 2 has 4 moments; moments need 10 or more"):
        judged([*usual_videos(2), short])


def test_cameras_that_see_nothing_are_refused():
    blind = [Video(v.looks, np.full_like(v.cells, 90)) for v in usual_videos(3)]
    with pytest.raises(ConfigError, match=r"^Nothing happens in the pictures of front;"):
        judged(blind)


def test_videos_of_different_tasks_are_refused():
    rng = np.random.default_rng(0)
    videos = [
        Video(
            np.cumsum(rng.normal(size=(80, 24)), axis=0).astype(np.float32),
            rng.integers(0, 255, (80, 18, 24, 3)).astype(np.uint8),
        )
        for _ in range(5)
    ]
    with pytest.raises(ConfigError, match=r"^These videos do not show one task:"):
        judged(videos)
