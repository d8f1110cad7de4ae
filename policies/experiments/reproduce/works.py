"""The work of every kind of unit: film a bank, fit a network, score it, judge drawn pools."""

import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
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
    Answer,
    Question,
    judge_all,
    judge_thresholds,
    weigh_all,
)
from policies.experiments.reproduce.readings import Reading, read, read_bank
from policies.experiments.units import Result, Store, Unit, Work
from teasim.common.errors import ConfigError
from teasim.common.workers import Workers
from teasim.pool import Pool
from teasim.pool.source import Source
from teasim.pool.views.part import Part


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
        reading, own = _reading(unit, store, pool, places)
        kinds = np.repeat(range(len(spec["kinds"])), [count for _, count in spec["kinds"]])
        names = tuple(pool.episodes[place].demo_id for place in places)
        ours = judge_videos(_part(pool, places), _segmenter(unit, store)) if spec["ours"] else None
        judged.append(judge(Question(reading.evidence(own), kinds, names, number, ours)))
    return {"pools": judged}


def judge_videos(pool: Source, segmenter: str) -> Answer:
    """Judge a pool as `teasim filter` does, with a segmenter of its own."""
    found = DemoFilter(FilterConfig(segmenter=segmenter)).fit(pool)
    return Answer(found.flagged_, found.losses_, found.probabilities_)


def _segmenter(unit: Unit, store: Store) -> str:
    """Return the segmenter of a unit: the folder of its network, or the name of one."""
    needs = unit.needs
    return str(store.folder_of(needs["network"]) if "network" in needs else unit.spec["segmenter"])


def _reading(
    unit: Unit, store: Store, pool: Pool, places: Sequence[int]
) -> tuple[Reading, Sequence[int]]:
    """Return a reading and the places in it of the pool that was drawn."""
    frames = unit.spec["frames"]
    if "network" in unit.needs:
        network = store.folder_of(unit.needs["network"])
        return read_bank(Path(pool.root).resolve(), network.resolve(), frames), places
    return read(_part(pool, places), unit.spec["segmenter"], frames), range(len(places))


def _part(pool: Pool, places: Sequence[int]) -> Part:
    """Return a pool of some demonstrations of a bank, which is sound: it was made here."""
    return Part(pool, [pool.episodes[place] for place in places])


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
