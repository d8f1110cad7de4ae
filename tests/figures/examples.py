"""Small data for every kind of figure: the least that it takes, and data like those of a pool."""

import numpy as np

from teasim.common.figures import (
    AccuracyFigure,
    Bar,
    ConfusionFigure,
    CurvesFigure,
    Drawing,
    PrecedenceFigure,
    ReliabilityFigure,
    TimelinesFigure,
    WeightsFigure,
)
from teasim.common.figures.accuracy import Point

STEPS = ("turn_on", "add_tea", "add_sugar", "add_milk", "turn_off", "add_water", "stir")

LEAST: dict[str, Drawing] = {
    "weights": WeightsFigure((0.5,), (False,), ("",), 0.0),
    "timelines": TimelinesFigure(("video 0",), ((Bar("stir", 0, 1),),), ((),), ()),
    "confusion": ConfusionFigure(("stir",), ((0,),)),
    "curves": CurvesFigure({"loss": (1.0,)}),
    "accuracy": AccuracyFigure({"all": (Point(0, 0.5, 0.1, 0.9),)}),
    "precedence": PrecedenceFigure(("stir",), ((0.0,),)),
    "reliability": ReliabilityFigure((0.5,), (True,)),
}


def usual() -> dict[str, Drawing]:
    """Data of the size of a small pool."""
    rng = np.random.default_rng(0)
    kinds = ("seq_1",) * 8 + ("seq_2",) * 4 + ("seq_3",) * 5
    weights = tuple(np.concatenate([rng.uniform(0.85, 1, 9), rng.uniform(0, 0.4, 8)]).tolist())
    true = [tuple(Bar(s, 2.0 * k, 2.0 * k + 2) for k, s in enumerate(STEPS)) for _ in range(6)]
    found = [
        tuple(Bar(f"step {k + 1}", b.start + 0.3 * (k > 0), b.stop + 0.3) for k, b in enumerate(r))
        for r in true
    ]
    counts = (90 * np.eye(7) + rng.integers(0, 9, (7, 7))).astype(int)
    before = np.triu(np.full((7, 7), 0.97), 1)
    before[2, 3], before[3, 2], before[1, 2:4], before[2:4, 1] = 0.5, 0.5, 0.5, 0.5
    p = rng.uniform(0, 1, 80)
    series = {
        name: tuple(Point(k, a - b * k, a - b * k - 0.06, a - b * k + 0.05) for k in (0, 2, 4, 6))
        for name, a, b in (("all", 0.95, 0.08), ("discard", 0.96, 0.01), ("labels", 0.97, 0.005))
    }
    return {
        "weights": WeightsFigure(weights, tuple(w < 0.5 for w in weights), kinds, 0.5),
        "timelines": TimelinesFigure(
            tuple(f"video {n}" for n in range(6)), tuple(found), tuple(true), ()
        ),
        "confusion": ConfusionFigure(STEPS, tuple(map(tuple, counts.tolist()))),
        "curves": CurvesFigure({"bc": tuple((2 / np.arange(1, 60)).tolist())}),
        "accuracy": AccuracyFigure(series),
        "precedence": PrecedenceFigure(STEPS, tuple(map(tuple, before.tolist()))),
        "reliability": ReliabilityFigure(
            tuple(p.tolist()), tuple((rng.uniform(0, 1, 80) < p).tolist())
        ),
    }
