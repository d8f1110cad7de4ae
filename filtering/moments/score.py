"""Judge the demonstrations of a pool by moments of their videos, without labels or sub-tasks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.moments.cells import cell_pictures
from filtering.moments.counterparts import Counterparts
from filtering.moments.decision import (
    KINDS,
    STEEPNESS,
    Observed,
    judge,
    most_telling,
    probabilities_of,
    strengths_of,
    telling,
)
from filtering.moments.effects.lacking import ineffective
from filtering.moments.effects.observed import Effects, observe
from filtering.moments.effects.unexpected import unexpected
from filtering.moments.evidence.kinds import missing_order_extra
from filtering.moments.evidence.orders import kept_orders, moves_between, variety_of
from filtering.moments.evidence.strange import Strange, strange_in
from filtering.moments.evidence.stretches import Evidence, Stretch
from filtering.moments.evidence.usual import Reference, references_of
from filtering.moments.peers.peers import Flags, Looks, Peers, both, looks_of
from filtering.moments.suitable import Comparable, check_videos, comparable
from filtering.moments.vectors import Video
from filtering.vision.frame_features import FrameSource, frame_features
from filtering.vision.frames import frame_rate
from teasim.common.workers import Workers
from teasim.pool.source import Demonstration, Source

RATE = 5.0
"""Moments looked at per second [Hz]."""
NOTABLE = 0.6
"""Exceedance from which a kind of evidence is a finding, unless there is no larger one; kinds of
less do not make a strength of 1 together with another that is not larger."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MomentFinding:
    """One kind of evidence against a demonstration, and where it is seen."""

    kind: str
    """One of `decision.KINDS`."""
    camera: str
    """Camera that shows it best."""
    own: Stretch
    """Where in the demonstration: the stretch itself, or where what is missing was expected."""
    other: Stretch
    """The same stretch in another video, where it is as usual."""
    exceedance: float
    """How far it lies above what is usual, 1 at the cut."""

    @property
    def surprise(self) -> float:
        """How improbable it is among correct demonstrations [nats]."""
        return STEEPNESS * self.exceedance


@dataclass(frozen=True)
class MomentScore:
    """What moments say about D demonstrations."""

    strengths: Array
    """(D,) strength of all evidence, 1 at the cut."""
    exceeded: Mapping[str, Array]
    """Per kind (D,) how far its evidence lies above what is usual, 1 at the cut."""
    findings: tuple[tuple[MomentFinding, ...], ...]
    """Per demonstration what speaks against it, the gravest first."""
    counterparts: Mapping[str, Counterparts]
    """Per camera that was of use."""
    structure: Mapping[str, float]
    """Per camera how much the videos have in common, see `structure.shared_structure`."""
    kept: Array
    """(D,) share of the others whose order a demonstration keeps, as most cameras see it."""
    looks: Mapping[str, Looks]
    """Per camera (D,) the same number for demonstrations that look alike."""
    actors: Mapping[str, Looks]
    """Per camera (D,) the same number where what moves has the same colours."""

    @property
    def one_order(self) -> float:
        """Share of the pairs of demonstrations that keep one order."""
        return float(self.kept.mean())

    @property
    def probabilities(self) -> Array:
        """(D,) probability of being incorrect."""
        return probabilities_of(self.strengths)

    @property
    def losses(self) -> Array:
        """(D,) -log of the probability of being correct [nats]."""
        return np.asarray(np.logaddexp(0.0, STEEPNESS * (self.strengths - 1)))

    @property
    def flagged(self) -> NDArray[np.bool_]:
        """(D,) True where the strength is above the cut."""
        return self.strengths > 1


def look(
    pool: Source, episodes: Sequence[Demonstration], cameras: Sequence[str], *, workers: Workers
) -> dict[str, list[Video]]:
    """Return per camera what it saw of each of `episodes`; cached.

    Raises:
        ConfigError: the frame rate of the pool is not known.
        PoolError: a video is missing or damaged, or there is no such camera.
    """
    fps, seen = frame_rate(pool), {}
    for camera in cameras:
        source = FrameSource((camera,), RATE)
        looks = frame_features(episodes, fps, source, workers=workers)
        cells = cell_pictures(episodes, fps, source, workers=workers)
        seen[camera] = [Video(*both) for both in zip(looks, cells, strict=True)]
    return seen


def score_moments(cameras: Mapping[str, Sequence[Video]]) -> MomentScore:
    """Judge demonstrations by what each of one or more cameras saw of them.

    Args:
        cameras: per camera the videos of the D demonstrations.

    Raises:
        ConfigError: there are fewer than three videos, they are too short, no camera sees anything
            happen, or the videos do not show one task.
    """
    check_videos(cameras)
    return score_comparable(comparable(cameras))


def score_comparable(seen: Comparable) -> MomentScore:
    """Judge demonstrations by what the cameras of use saw of them.

    Raises:
        ConfigError: there are fewer than three videos, or they are too short.
    """
    check_videos(seen.videos)
    # The matrices are small: more BLAS threads only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        effects = {camera: observe(one, seen.videos[camera]) for camera, one in seen.found.items()}
        return _judged(seen.found, effects, seen.structure)


def gather(
    found: Counterparts,
    references: Sequence[Reference],
    strange: Sequence[Strange],
    effects: Effects,
    peers: Peers,
) -> dict[str, Evidence]:
    """Return the evidence of every kind that one camera gives, measured by the peers.

    Args:
        found: the counterparts.
        references: what is usual among the peers.
        strange: how strange the moments of each demonstration are.
        effects: what usually changes, and who acts.
        peers: who says what is usual, whoever acts.
    """
    same_actor = peers.told_apart(effects.actors)
    alike = references_of(found, same_actor) if effects.actors.any() else references
    kinds = (
        *missing_order_extra(alike, references, strange),
        ineffective(found, effects.views, same_actor),
        unexpected(effects.unexpected),
    )
    return dict(zip(KINDS, kinds, strict=True))


def _judged(
    found: Mapping[str, Counterparts],
    effects: Mapping[str, Effects],
    structure: Mapping[str, float],
) -> MomentScore:
    """Put cameras and kinds together."""
    cameras = list(found)
    looks = {camera: looks_of(one) for camera, one in found.items()}
    strange = {c: strange_in(one, both(looks[c], effects[c].actors)) for c, one in found.items()}
    evidence: dict[str, dict[str, Evidence]] = {}
    kept: list[Array] = []  # of every round; the first one trusts everybody

    def values(trusted: Flags) -> list[Observed]:
        moves, shares = list[Array](), list[Array]()
        for camera in cameras:
            peers = Peers(trusted, looks[camera])
            references = references_of(found[camera], peers)
            evidence[camera] = gather(
                found[camera], references, strange[camera], effects[camera], peers
            )
            moves.append(moves_between(references))
            shares.append(kept_orders(references, moves[-1], len(trusted)))
        kept.append(np.median(shares, axis=0))
        # Orders are free or not whoever looks; a camera that misses some steps sees less of it.
        variety = max(variety_of(far) for far in moves)
        return [
            Observed({kind: evidence[camera][kind].values for kind in KINDS}, variety, kept[-1])
            for camera in cameras
        ]

    count = len(next(iter(found.values())).lengths)
    _, each = judge(values, count)
    exceeded = most_telling(each)
    chosen = {kind: telling([one[kind] for one in each]) for kind in KINDS}

    def finding(kind: str, d: int) -> MomentFinding:
        camera = cameras[chosen[kind][d]]
        one = evidence[camera][kind]
        return MomentFinding(kind, camera, one.own[d], one.other[d], float(exceeded[kind][d]))

    return MomentScore(
        strengths_of(exceeded),
        exceeded,
        tuple(_in_order([finding(kind, d) for kind in KINDS]) for d in range(count)),
        found,
        structure,
        kept=kept[0],
        looks=looks,
        actors={camera: one.actors for camera, one in effects.items()},
    )


def _in_order(said: Sequence[MomentFinding]) -> tuple[MomentFinding, ...]:
    """Return the notable findings, at least one, the most important one first.

    A step that is missing has no effect either, so `ineffective` comes after a notable `missing`.
    """
    notable = {finding.kind for finding in said if finding.exceedance >= NOTABLE}
    implied = {"ineffective"} if "missing" in notable else set()
    ordered = sorted(said, key=lambda finding: (finding.kind in implied, -finding.exceedance))
    return tuple(f for f in ordered if f.kind in notable) or tuple(ordered[:1])
