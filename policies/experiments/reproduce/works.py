"""The work of every kind of unit: film a bank, fit a network, score it, judge drawn pools."""

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.judging.evidence import Evidence
from filtering.segmentation.config import FitConfig, MSTCNConfig
from filtering.segmentation.fit import fit_segmenter
from filtering.segmentation.metrics import (
    TOLERANCES,
    frame_accuracy,
    segmentation_scores,
    subtask_accuracy,
)
from filtering.segmentation.mstcn.checkpoint import load_segmenter
from filtering.segmentation.scoring import label_pair
from policies.experiments.generating import generate_pool
from policies.experiments.reproduce.exhibits.policies import run_policies
from policies.experiments.reproduce.exhibits.salads import judge_salads
from policies.experiments.reproduce.methods import (
    Question,
    judge_all,
    judge_thresholds,
    weigh_all,
)
from policies.experiments.reproduce.readings import describe, read_bank
from policies.experiments.units import Result, Store, Unit, Work
from teasim.common.errors import ConfigError
from teasim.common.workers import Workers
from teasim.pool import Pool


def film(unit: Unit, store: Store, workers: Workers) -> Result:
    """Film a bank of demonstrations; an unfinished one is resumed."""
    pool = generate_pool(store.folder_of(unit), unit.spec["options"], workers)
    return {"demonstrations": len(pool.episodes)}


def fit(unit: Unit, store: Store, workers: Workers) -> Result:
    """Fit MS-TCN++ to videos of a bank."""
    out, spec = store.folder_of(unit), unit.spec
    shutil.rmtree(out, ignore_errors=True)  # what a killed fit left
    network = MSTCNConfig(epochs=spec["epochs"], seed=spec["seed"])
    config = FitConfig(labelled=spec["labelled"], network=network)
    fitted = fit_segmenter(store.folder_of(unit.needs["bank"]), out, config, workers=workers)
    return {"labelled": list(fitted.labelled), "loss": fitted.loss}


def score_segments(unit: Unit, store: Store, workers: Workers) -> Result:
    """Score a network on the videos of a bank that it was not fitted to."""
    pool = Pool.open(store.folder_of(unit.needs["bank"]))
    segmenter = load_segmenter(store.folder_of(unit.needs["network"]))
    unseen = [e for e in pool.episodes if e.demo_id not in segmenter.labelled]
    found = segmenter.segment_episodes(pool, unseen, workers=workers)
    pairs = [label_pair(episode, number, found) for number, episode in enumerate(unseen)]
    known = [pair for pair in pairs if pair is not None]
    counts = [len(episode.spans()) for episode in unseen]
    scores = segmentation_scores(known)
    return {
        "frames": [[frame_accuracy([pair]), len(pair.truth)] for pair in known],
        "subtasks": {
            str(p): [
                [subtask_accuracy([pair], p), count]
                for pair, count in zip(known, counts, strict=True)
            ]
            for p in TOLERANCES
        },
        "edit": scores.edit,
        "f1": {str(overlap): value for overlap, value in scores.f1.items()},
    }


def judge_pools(
    unit: Unit, store: Store, workers: Workers, *, judge: Callable[[Question], Result]
) -> Result:
    """Draw pools from a bank and judge each, from the videos alone.

    The labels of the bank are read to draw the pools, by the baselines that are told how many
    demonstrations are incorrect, and to score.

    Args:
        unit: a segmenter or its network, kinds and numbers of demonstrations, number of pools.
        store: where the bank and the network are.
        workers: not used, because units run side by side.
        judge: returns what is said about a pool.
    """
    del workers
    spec = unit.spec
    pool = Pool.open(store.folder_of(unit.needs["bank"]))
    judged = []
    for number, places in enumerate(drawn(pool, spec["kinds"], spec["row"], spec["pools"])):
        evidence, alone = _look(unit, store, pool, places)
        kinds = np.repeat(range(len(spec["kinds"])), [count for _, count in spec["kinds"]])
        names = tuple(pool.episodes[place].demo_id for place in places)
        judged.append(judge(Question(evidence, kinds, names, alone, seed=number)))
    return {"pools": judged}


def _look(
    unit: Unit, store: Store, pool: Pool, places: Sequence[int]
) -> tuple[Evidence, DemoFilter | None]:
    """Return the evidence about the demonstrations at `places`.

    Without a network the segments are those that the default filter finds. The filter is returned
    too, where it looked at the videos.
    """
    frames = unit.spec["frames"]
    if "network" in unit.needs:
        network = store.folder_of(unit.needs["network"])
        reading = read_bank(Path(pool.root).resolve(), network.resolve(), frames)
        fitted = None
        if unit.spec["videos"]:
            fitted = DemoFilter(FilterConfig(segmenter=str(network))).fit(pool.only(places))
        return reading.evidence(places), fitted
    part = pool.only(places)
    fitted = DemoFilter().fit(part)
    return describe(part, fitted.segments_, frames).evidence(range(len(places))), fitted


def drawn(
    pool: Pool, kinds: Sequence[tuple[str, int]], row: int, pools: int
) -> Iterator[list[int]]:
    """Draw pools of some demonstrations of each kind; yield places in the bank, kind by kind.

    Raises:
        ConfigError: the bank has too few demonstrations of a kind.
    """
    of_kind: dict[str, list[int]] = {}
    for place, episode in enumerate(pool.episodes):
        if episode.record is not None:
            of_kind.setdefault(episode.record.sequence, []).append(place)
    for kind, count in kinds:
        if len(of_kind.get(kind, ())) < count:
            raise ConfigError(
                f"The bank '{pool.root}' has {len(of_kind.get(kind, ()))} demonstrations of "
                f"{kind}, not {count}."
            )
    for number in range(pools):
        rng = np.random.default_rng([row, number])
        yield [
            int(place)
            for kind, count in kinds
            for place in rng.choice(of_kind[kind], count, replace=False)
        ]


WORKS: Mapping[str, Work] = MappingProxyType(
    {
        "bank": film,
        "network": fit,
        "segmentation": score_segments,
        "detection": partial(judge_pools, judge=judge_all),
        "thresholds": partial(judge_pools, judge=judge_thresholds),
        "weights": partial(judge_pools, judge=weigh_all),
        "salads": judge_salads,
        "policies": run_policies,
    }
)
"""The work of every kind of unit."""
