"""Who demonstrates a task, and how alike their correct demonstrations are."""

from dataclasses import dataclass

import numpy as np

from filtering.judging.decision.prior.habits import Habit, draw_habit, draw_order, draw_present
from filtering.judging.decision.prior.tasks import Task, draw_task
from teasim.common.arrays import Array

STYLES = ("script", "orders", "close", "varied", "free")
"""How alike correct demonstrations are: one order, an order per person, and around a habit."""
STYLE_SHARES = (0.26, 0.19, 0.17, 0.22, 0.16)
"""How often pools have each of STYLES."""
CLEAN = (0.18, 0.4, 0.18, 0.12, 0.12)
"""Share of the pools of each of STYLES in which nothing is incorrect: people who vary much err more
often. This and other shares of the prior were set by hand, with the data sets of
`scripts/check_decision.py` in sight; see docs/decision.md."""
EFFECTS = 0.35
"""Share of the pools whose videos are examined for effects."""


@dataclass(frozen=True)
class People:
    """Who demonstrates a task, and how."""

    task: Task
    """What is to be done."""
    habits: tuple[Habit, ...]
    """The habits of the people."""
    shares: Array
    """Share of the demonstrations of each habit."""
    style: str
    """One of STYLES."""
    effects: bool
    """Whether the videos are examined for effects."""
    ineffective: float
    """Probability that an incorrect demonstration does all steps, one without effect."""

    @property
    def clean(self) -> float:
        """Probability that nothing is incorrect."""
        return CLEAN[STYLES.index(self.style)]

    def order(self, rng: np.random.Generator) -> list[int]:
        """Draw a correct order of nodes."""
        habit = self.habits[int(rng.choice(len(self.habits), p=self.shares))]
        return draw_order(rng, self.task, habit, draw_present(rng, self.task))


def draw_people(rng: np.random.Generator) -> People:
    """Draw a task and the people who do it."""
    style = str(rng.choice(STYLES, p=STYLE_SHARES))
    task = draw_task(rng, exact=style == "script")
    stick = [0.0, rng.uniform(0, 1), rng.uniform(0.9, 1)][rng.choice(3, p=[0.35, 0.3, 0.35])]
    closeness = {"close": rng.uniform(1.5, 4), "varied": rng.uniform(0.3, 1.5)}.get(style, 50.0)
    count, evenness = int(rng.choice([1, 2, 3], p=[0.62, 0.23, 0.15])), 8.0
    if style == "script":
        count = 1
    elif style == "orders":
        count, evenness = int(rng.choice([2, 3, 3, 4, 5])), 20.0
    elif style == "free":
        closeness = rng.uniform(0, 0.3)
    habits = tuple(draw_habit(rng, task, closeness=closeness, stick=stick) for _ in range(count))
    shares = rng.dirichlet(np.full(count, evenness))
    effects = bool(rng.random() < EFFECTS)
    ineffective = float(rng.uniform(0, 0.7)) if effects else 0.0
    return People(task, habits, shares, style, effects, ineffective)
