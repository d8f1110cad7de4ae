"""From what was done to what a segmenter reports: durations, errors, reliability."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.judging.decision.prior.tasks import Task
from filtering.judging.norm.steps import StepList
from teasim.common.arrays import Array

NOISELESS = 0.5
"""Share of the pools whose segments are right, but for SLIPS."""
TOLD = 0.5
"""Share of those whose segments are known to be told by people or the environment."""
SLIPS = 0.15
"""Share of the told pools in which whoever labelled them errs now and then."""
LEAST_SLIP, LARGEST_SLIP = 0.002, 0.01
"""Range of the mean rate of each kind of such an error per step, drawn log-uniformly."""
LEAST_RATE, LARGEST_RATE = 0.02, 0.16
"""Range of the mean rate of each kind of error per step, drawn log-uniformly: segments are either
right or visibly not."""
LARGEST_CHANCE = 0.5
"""Largest probability of one kind of error of a step."""
ANY = 0.15
"""Share of the labels that are confused with any other one, and of stray segments of any label; the
others are of about the same time."""
CLOSE = 0.4
"""Parameter of the geometric distribution of how many steps away that is."""
SHORTEST_STRAY = 0.03
"""Shortest stray segment [mean duration of a step]; they are up to as long as a step."""


@dataclass(frozen=True)
class Noise:
    """How a segmenter errs in a pool."""

    rate: float
    """Mean rate of errors per step and kind; 0 where all segments are right."""
    mix: Array
    """(5,) relative rate of steps lost, confused, confused in part, invented, and split."""
    weak: Array
    """(T,) relative rate of errors of each label."""
    alike: NDArray[np.int64]
    """(T, 2) the labels that each label is confused with."""
    shape: float
    """Shape of the gamma distribution of the quality of a demonstration."""
    swallow: float
    """Rate at which neighbours are swallowed, relative to `rate`."""
    spread: float
    """Standard deviation of the log-duration of a step."""
    loop: float
    """Probability that two neighbouring steps are done in turns."""
    trust: float
    """Mean reliability of a right segment; 0 where the pool has no reliability."""
    told: bool = False
    """Whether the segments are known not to be a segmenter's."""


@dataclass(frozen=True)
class Report:
    """What is reported of one demonstration."""

    steps: StepList
    """Its segments."""
    right: NDArray[np.bool_]
    """(q,) whether the label of each segment is right."""
    errors: int
    """Number of errors of the segmenter."""


def draw_noise(rng: np.random.Generator, n_labels: int, *, exact: bool) -> Noise:
    """Draw the noise of a pool of `n_labels` labels, foreign ones included."""
    told, rate = _draw_rate(rng)
    alone = told or rng.random() < 0.5  # without posteriors
    return Noise(
        rate=rate,
        mix=rng.dirichlet(np.full(5, 0.8)) * 5 * np.array([1.0, 0.25, 0.6, 1.6, 0.8]),
        weak=rng.gamma(1.0, 1.0, n_labels) if rng.random() < 0.7 else np.ones(n_labels),
        alike=_alike(rng, n_labels),
        shape=float(rng.choice([0.7, 1.2, 3.0])),
        swallow=float(rng.choice([0.0, 0.15, 0.4])),
        spread=float(rng.choice([0.02, 0.2, 0.35, 0.6], p=[0.1, 0.25, 0.4, 0.25])),
        loop=0.0 if exact or rng.random() > 0.2 else float(rng.uniform(0.005, 0.12)),
        trust=0.0 if alone else float(rng.uniform(0.75, 0.99)),
        told=told,
    )


def _draw_rate(rng: np.random.Generator) -> tuple[bool, float]:
    """Return whether the segments are told, and the mean rate of errors per step and kind."""
    right = rng.random() < NOISELESS
    told = bool(right and rng.random() < TOLD)
    if right and not (told and rng.random() < SLIPS):
        return told, 0.0
    range_ = (LEAST_SLIP, LARGEST_SLIP) if told else (LEAST_RATE, LARGEST_RATE)
    return told, float(np.exp(rng.uniform(*np.log(range_))))


def _alike(rng: np.random.Generator, n_labels: int) -> NDArray[np.int64]:
    """Return (T, 2): the labels that each label is confused with.

    Mostly those of steps done at about the same time: steps are numbered in an order of the task.
    """
    near = np.array([[_near(rng, label, n_labels) for _ in range(2)] for label in range(n_labels)])
    anywhere = rng.random((n_labels, 2)) < ANY
    return np.where(anywhere, rng.integers(0, n_labels, (n_labels, 2)), near)


def _near(rng: np.random.Generator, place: int, count: int) -> int:
    """Return a place near to another one of `count`."""
    away = int(rng.geometric(CLOSE)) * int(rng.choice([-1, 1]))
    return min(max(place + away, 0), count - 1)


def _stray(rng: np.random.Generator) -> float:
    """Return the duration of a stray segment [mean duration of a step]."""
    return float(np.exp(rng.uniform(np.log(SHORTEST_STRAY), 0.0)))


Piece = tuple[int, float, bool]
"""Label, duration [frames], and whether the label is right."""


def report(
    rng: np.random.Generator, task: Task, noise: Noise, labels: list[int], usual: Array
) -> Report:
    """Return what a segmenter reports of a demonstration.

    Args:
        rng: source of randomness.
        task: what was done.
        noise: how the segmenter errs.
        labels: q true labels.
        usual: (q,) their usual durations [frames].
    """
    times = usual * np.exp(noise.spread * rng.normal(size=len(usual)))
    pieces = [(label, float(t), True) for label, t in zip(labels, times, strict=True)]
    pieces = _in_turns(rng, pieces, noise.loop)
    errors = 0
    if noise.rate > 0:
        rate = noise.rate * rng.gamma(noise.shape, 1 / noise.shape)
        pieces, swallowed = _swallowed(rng, pieces, noise, min(0.3, noise.swallow * rate))
        pieces, others = _mistaken(rng, pieces, noise, (rate, task.n_labels))
        errors = swallowed + others
    merged: list[Piece] = []
    for label, length, right in pieces:
        if merged and merged[-1][0] == label:
            merged[-1] = (label, merged[-1][1] + length, merged[-1][2] and right)
        else:
            merged.append((label, length, right))
    steps = StepList(
        tuple(int(piece[0]) for piece in merged),
        tuple(max(1, round(piece[1])) for piece in merged),
    )
    return Report(steps, np.array([piece[2] for piece in merged]), errors)


def _in_turns(rng: np.random.Generator, pieces: list[Piece], chance: float) -> list[Piece]:
    done: list[Piece] = []
    for piece in pieces:
        if done and chance and rng.random() < chance:
            halves = [(label, t / 2, right) for label, t, right in (done.pop(), piece)]
            done += halves * 2
        else:
            done.append(piece)
    return done


def _swallowed(
    rng: np.random.Generator, pieces: list[Piece], noise: Noise, chance: float
) -> tuple[list[Piece], int]:
    """Let neighbours become one segment of the label before, or of a similar one."""
    kept: list[Piece] = []
    place = errors = 0
    while place < len(pieces):
        size = int(rng.integers(2, 4))
        if chance > 0 and place + size < len(pieces) and rng.random() < chance:
            time = sum(piece[1] for piece in pieces[place : place + size])
            before = kept and rng.random() < 0.6
            label = kept[-1][0] if before else int(noise.alike[pieces[place][0], 0])
            kept.append((label, time, False))
            place, errors = place + size, errors + size
        else:
            kept.append(pieces[place])
            place += 1
    return kept, errors


def _mistaken(
    rng: np.random.Generator, pieces: list[Piece], noise: Noise, extent: tuple[float, int]
) -> tuple[list[Piece], int]:
    """Lose, confuse, invent and split segments."""
    rate, n_labels = extent
    usual = float(np.mean([piece[1] for piece in pieces]))
    found: list[Piece] = []
    errors = 0
    for place, (label, time, right) in enumerate(pieces):
        chances = np.minimum(noise.weak[label] * rate * noise.mix, LARGEST_CHANCE)
        lost, whole, part, invented, split = rng.random(5) < chances
        other = int(noise.alike[label, rng.integers(2)])
        errors += int(lost or whole or part or split) + int(invented)
        if lost and (found or len(pieces) > 2):
            if found:
                found[-1] = (found[-1][0], found[-1][1] + time * rng.random(), found[-1][2])
            continue
        cut = rng.uniform(0.2, 0.8)
        new = [(label, time, right)]
        if whole:
            new = [(other, time, False)]
        elif part:
            new = [(label, cut * time, right), (other, (1 - cut) * time, False)]
            new = new[:: int(rng.choice([1, -1]))]
        elif split:
            short = (other, _stray(rng) * usual, False)
            new = [(label, cut * time, right), short, (label, (1 - cut) * time, right)]
        if invented:
            seen = pieces[_near(rng, place, len(pieces))][0]
            stray = int(rng.integers(n_labels)) if rng.random() < ANY else seen
            new.insert(int(rng.integers(2)), (stray, _stray(rng) * usual, False))
        found += new
    return (found, errors) if found else (pieces, 0)


def reliabilities(rng: np.random.Generator, noise: Noise, right: NDArray[np.bool_]) -> Array:
    """Draw how sure the segmenter is of each segment, (q,), for segments that are right or not."""
    sure = np.where(right, noise.trust, 0.6 * noise.trust + 0.1)
    return np.asarray(rng.beta(8 * sure, 8 * (1 - sure)))
