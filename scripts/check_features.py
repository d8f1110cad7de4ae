"""What each part of the learned features brings, on rendered pools.

Segments of TRAIN teach a bottleneck, a ranking of its channels and two simple classifiers; segments
of TEST are named by these from raw, reduced and ranked features, with and without the background.
Then channels are erased: the best ranked ones must be missed more than random ones. In pools drawn
from BANK equation 3 looks for incorrect demonstrations by each kind of features. The labels of the
pools are read for learning, for drawing and for counting only.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import imageio.v3 as imageio
import numpy as np
from sklearn.linear_model import LogisticRegression
from sklearn.neighbors import NearestCentroid
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from filtering.config import FilterConfig
from filtering.features.bottleneck import Bottleneck
from filtering.features.config import GeneratorConfig
from filtering.features.erasure import rank_channels
from filtering.features.extraction import foreground, segment_maps
from filtering.features.generator import FeatureGenerator
from filtering.features.pictures import overlay
from filtering.features.reduction import reduce_features
from filtering.judging.evidence import Evidence
from filtering.judging.judges import by_equation_3
from filtering.vision.background import BACKGROUNDS
from filtering.vision.frames import segment_indices
from teasim.common.statistics import auroc
from teasim.pool import Episode, Pool

DRAWS = 30
"""Random sets of channels that are erased."""
RESAMPLED = 2000
"""Bootstrap samples of segments."""


@dataclass(frozen=True)
class Clips:
    """Labelled segments."""

    maps: list[np.ndarray]
    """Feature maps of each, (n, C, h, w)."""
    labels: np.ndarray
    """Sub-task of each, (S,)."""


def main() -> int:
    """Run the check; exit code 1 when random channels are missed as much as the best ranked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--train", type=Path, required=True, help="pool that is learned from")
    parser.add_argument("--test", type=Path, required=True, help="pool whose segments are named")
    parser.add_argument("--demos", type=int, nargs=2, default=(6, 6), help="how many of each")
    parser.add_argument("--frames", type=int, default=16, help="frames per segment")
    parser.add_argument("--camera", default="left", help="camera looked at")
    parser.add_argument("--backgrounds", nargs="+", default=["none", "median"])
    parser.add_argument("--cache", type=Path, required=True, help="where feature maps are kept")
    parser.add_argument("--pictures", type=Path, help="PNG of what the best channels look at")
    parser.add_argument("--foregrounds", type=Path, help="PNG of what each background leaves")
    parser.add_argument("--bank", type=Path, help="pool of Seq_1 and Seq_3 to draw pools from")
    parser.add_argument("--pools", type=int, default=30, help="pools that are drawn")
    arguments = parser.parse_args()
    pools = Pool.open(arguments.train), Pool.open(arguments.test)
    if arguments.foregrounds:
        draw_foregrounds(arguments, pools[1].episodes[0])
    missed = []
    print(f"{'background':12}{'features':12}{'nearest centroid':>18}{'linear':>8}   accuracy %")
    for background in arguments.backgrounds:
        train, test = (
            _clips(pool, pool.episodes[:count], background, arguments)
            for pool, count in zip(pools, arguments.demos, strict=True)
        )
        bottleneck = Bottleneck().fit(train.maps, train.labels.tolist())
        seen = bottleneck.transform(train.maps)
        generator = FeatureGenerator(GeneratorConfig()).fit(seen, train.labels.tolist())
        reduced = seen, bottleneck.transform(test.maps)
        ablation(background, generator, (train, test), reduced)
        missed.append(erasure(generator, reduced[1], test.labels))
        if arguments.bank:
            detection(Pool.open(arguments.bank), background, bottleneck, generator, arguments)
        if arguments.pictures and background == arguments.backgrounds[0]:
            draw(arguments, pools[1], bottleneck, generator)
    return int(min(missed) <= 0)


def ablation(
    background: str,
    generator: FeatureGenerator,
    clips: tuple[Clips, Clips],
    reduced: tuple[Sequence[np.ndarray], Sequence[np.ndarray]],
) -> None:
    """Print how well simple classifiers name segments from three kinds of features.

    `clips` are learned from and named; `reduced` is what the bottleneck makes of each.
    """
    train, test = clips
    known_kinds, new_kinds = (
        kinds(some.maps, seen, generator) for some, seen in zip(clips, reduced, strict=True)
    )
    for kind, known in known_kinds.items():
        new, shares = new_kinds[kind], []
        for classifier in (NearestCentroid(), LogisticRegression(max_iter=1000)):
            fitted = make_pipeline(StandardScaler(), classifier).fit(known, train.labels)
            shares.append(100 * fitted.score(new, test.labels))
        print(f"{background:12}{kind:12}{shares[0]:18.1f}{shares[1]:8.1f}", flush=True)
    named = float((generator.predict(reduced[1]) == test.labels).mean())
    print(f"{background:12}{'graph':12}{'':18}{100 * named:8.1f}   (relations of intervals)")


def kinds(
    maps: Sequence[np.ndarray], seen: Sequence[np.ndarray], generator: FeatureGenerator
) -> dict[str, np.ndarray]:
    """Return the features of segments by kind, (S, F) each; `seen` is the bottleneck's."""
    return {
        "raw": _strongest([m.max(axis=(2, 3)) for m in maps]),
        "bottleneck": _strongest(seen),
        "ranked": generator.transform(seen)[:, generator.kept_],
    }


def detection(
    pool: Pool,
    background: str,
    bottleneck: Bottleneck,
    generator: FeatureGenerator,
    arguments: argparse.Namespace,
) -> None:
    """Print how well equation 3 finds 4 Seq_3 among 10 Seq_1 by each kind of features."""
    sequences = [episode.record.sequence if episode.record else "" for episode in pool.episodes]
    every = (_episode_maps(pool, episode, background, arguments) for episode in pool.episodes)
    described = [kinds(maps, bottleneck.transform(maps), generator) for maps in every]
    wrong = np.arange(14) >= 10
    rule = FilterConfig(score="equation3")
    for kind in described[0]:
        areas, found, accused = [], 0, 0
        for number in range(arguments.pools):
            rng = np.random.default_rng(number)
            drawn = [
                int(index)
                for sequence, count in (("seq_1", 10), ("seq_3", 4))
                for index in rng.choice(
                    np.flatnonzero(np.array(sequences) == sequence), count, replace=False
                )
            ]
            spans = tuple(pool.episodes[index].spans() for index in drawn)
            states = reduce_features([described[index][kind] for index in drawn])
            judgement = by_equation_3(Evidence(pool.subtasks, spans, states), rule)
            areas.append(auroc(judgement.losses, wrong))
            found += int(judgement.grouping.flagged[wrong].sum())
            accused += int(judgement.grouping.flagged[~wrong].sum())
        print(
            f"{background:12}{kind:12}equation 3, {arguments.pools} pools of 10 Seq_1 + 4 Seq_3: "
            f"AUROC {np.mean(areas):.3f}, found {found} of {4 * arguments.pools}, "
            f"accused per pool {accused / arguments.pools:.2f}",
            flush=True,
        )


def erasure(
    generator: FeatureGenerator, activations: Sequence[np.ndarray], labels: np.ndarray
) -> float:
    """Print how much more the best ranked channels are missed; return the lower end of 95 %."""
    rng = np.random.default_rng(0)
    clips = generator.intervals(activations)
    channels = len(generator.thresholds_)
    erased = len(generator.kept_) // 2
    best = rank_channels(generator.importance_)[:erased]
    whole = _margins(generator, clips, labels)
    top = whole - _margins(generator, [c.without(best.tolist()) for c in clips], labels)
    random = np.mean(
        [
            whole - _margins(generator, [c.without(drawn.tolist()) for c in clips], labels)
            for drawn in (rng.permutation(channels)[:erased] for _ in range(DRAWS))
        ],
        axis=0,
    )
    excess = top - random
    samples = rng.integers(len(excess), size=(RESAMPLED, len(excess)))
    low, high = np.quantile(excess[samples].mean(axis=1), (0.025, 0.975))
    print(
        f"  without the best {erased} of {channels} channels the true sub-task loses "
        f"{top.mean():.2f}, without {erased} random ones {random.mean():.2f} "
        f"(difference {excess.mean():.2f}, 95 % {low:.2f} to {high:.2f}; centred logits)",
        flush=True,
    )
    return float(low)


def draw(
    arguments: argparse.Namespace, pool: Pool, bottleneck: Bottleneck, generator: FeatureGenerator
) -> None:
    """Write a row of pictures per sub-task: where its three most important channels look."""
    episode, rows = pool.episodes[0], []
    background = arguments.backgrounds[0]
    indices = segment_indices(episode.spans(), arguments.frames)
    found = _episode_maps(pool, episode, background, arguments)
    clip = episode.clip(arguments.camera)
    for span, chosen, maps in zip(episode.spans(), indices, found, strict=True):
        frames = foreground(clip, chosen, "none")
        importance = generator.importance_[pool.subtasks.index(span.subtask)]
        best = np.argsort(-importance, kind="stable")[:3]
        rows.append(np.hstack([overlay(bottleneck, frames, maps, int(c)) for c in best]))
        print(f"  row {len(rows)}: {span.subtask}, channels {best.tolist()}")
    imageio.imwrite(arguments.pictures, np.vstack(rows))


def draw_foregrounds(arguments: argparse.Namespace, episode: Episode) -> None:
    """Write a row per background: the middle of every other segment without it."""
    spans = episode.spans()[::2]
    chosen = np.array([(span.start + span.stop) // 2 for span in spans])
    clip = episode.clip(arguments.camera)
    rows = [np.hstack(foreground(clip, chosen, name)) for name in BACKGROUNDS]
    imageio.imwrite(arguments.foregrounds, np.vstack(rows))


def _margins(generator: FeatureGenerator, clips: Sequence, labels: np.ndarray) -> np.ndarray:
    logits = generator.decide(clips)
    centred = logits - logits.mean(axis=1, keepdims=True)
    return centred[np.arange(len(labels)), labels]


def _strongest(activations: Sequence[np.ndarray]) -> np.ndarray:
    return np.stack([segment.max(axis=0) for segment in activations]).astype(np.float64)


def _clips(
    pool: Pool, episodes: Sequence[Episode], background: str, arguments: argparse.Namespace
) -> Clips:
    maps = [m for e in episodes for m in _episode_maps(pool, e, background, arguments)]
    labels = [pool.subtasks.index(span.subtask) for e in episodes for span in e.spans()]
    return Clips(maps, np.array(labels))


def _episode_maps(
    pool: Pool, episode: Episode, background: str, arguments: argparse.Namespace
) -> list[np.ndarray]:
    """Return the feature maps of each segment, from the cache when they are there."""
    name = f"{pool.root.name}-{episode.index}-{arguments.camera}-{arguments.frames}-{background}"
    path = arguments.cache / f"{name}.npz"
    if not path.exists():
        clip = episode.clip(arguments.camera)
        maps = segment_maps(clip, episode.spans(), arguments.frames, background)
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(path, *maps)
    with np.load(path) as stored:
        return [stored[key] for key in stored.files]


if __name__ == "__main__":
    sys.exit(main())
