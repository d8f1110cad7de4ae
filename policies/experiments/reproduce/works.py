"""The work of every kind of unit: film a bank, fit a network, score it, judge drawn pools."""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType

import numpy as np

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
from policies.experiments.reproduce.methods import Question, judge_all
from policies.experiments.reproduce.readings import Reading, read, read_bank
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


def judge_pools(unit: Unit, store: Store, workers: Workers) -> Result:
    """Draw pools from a bank and judge each by every method, from the videos alone.

    The labels of the bank are read to draw the pools, by the baselines that are told how many
    demonstrations are incorrect, and to score.
    """
    del workers  # units run side by side
    bank, spec = store.folder_of(unit.needs["bank"]), unit.spec
    pool = Pool.open(bank)
    judged = []
    for number, places in enumerate(drawn(pool, spec["kinds"], spec["row"], spec["pools"])):
        reading, own = _reading(unit, store, pool, places)
        wrong = np.repeat(
            [kind > 0 for kind in range(len(spec["kinds"]))], [n for _, n in spec["kinds"]]
        )
        names = tuple(pool.episodes[place].demo_id for place in places)
        question = Question(reading.evidence(own), wrong, number)
        judged.append({name: asdict(said) for name, said in judge_all(question, names).items()})
    return {"pools": judged}


def _reading(
    unit: Unit, store: Store, pool: Pool, places: Sequence[int]
) -> tuple[Reading, Sequence[int]]:
    """Return a reading and the places in it of the pool that was drawn."""
    frames = unit.spec["frames"]
    if "network" in unit.needs:
        network = store.folder_of(unit.needs["network"])
        return read_bank(Path(pool.root), network, frames), places
    return read(pool.only(places), unit.spec["segmenter"], frames), range(len(places))


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
    {"bank": film, "network": fit, "segmentation": score_segments, "detection": judge_pools}
)
"""The work of every kind of unit."""
