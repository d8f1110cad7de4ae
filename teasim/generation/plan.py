"""The plan of a pool: the steps, mistakes and participant of every demonstration."""

from dataclasses import dataclass

import numpy as np

from teasim.generation.config import GenerateConfig
from teasim.skills.demonstrators import Participant
from teasim.task.mistakes import Plan, spoil
from teasim.task.recipes import INCORRECT, LEGAL, OPTIMAL, SEQ_1, SEQ_2, SUBOPTIMAL, random_order


@dataclass(frozen=True)
class DemoPlan:
    """The plan of one demonstration."""

    index: int
    """Its index in the pool."""
    sequence: str
    """seq_1, seq_2, seq_3 or legal."""
    plan: Plan
    """Steps and mistakes."""
    participant: str = "yumi"
    """The participant who demonstrates it."""


def plan_pool(config: GenerateConfig) -> tuple[DemoPlan, ...]:
    """Plan every demonstration of a pool, in random order.

    Raises:
        ConfigError: a mistake does not fit into a recipe without an optional ingredient.
    """
    rng = np.random.default_rng([config.seed, 0])
    plans = [(OPTIMAL, _recipe(SEQ_1, config, rng)) for _ in range(config.seq1)]
    plans += [(SUBOPTIMAL, _recipe(SEQ_2, config, rng)) for _ in range(config.seq2)]
    for k in range(config.seq3):
        # One omission and two alternate, so that every pool holds both kinds.
        spec = "+".join(["skip"] * (1 + k % 2))
        plans.append((INCORRECT, spoil(_recipe(SEQ_1, config, rng), spec, rng)))
    for spec, count in config.mistakes:
        plans += [(INCORRECT, spoil(_recipe(SEQ_1, config, rng), spec, rng)) for _ in range(count)]
    team = config.team
    for _ in range(config.legal):
        who = team[len(plans) % len(team)]
        plans.append((LEGAL, _recipe(_own_order(who, rng), config, rng)))
    order = rng.permutation(len(plans))
    # The participants take turns within each kind, so that nobody makes all the mistakes.
    names = [team[which % len(team)].name for which in order]
    return tuple(
        DemoPlan(index, plans[which][0], plans[which][1], names[index])
        for index, which in enumerate(order)
    )


def _own_order(who: Participant, rng: np.random.Generator) -> tuple[str, ...]:
    """Draw a correct order: half of the time one of the participant's habits, else any."""
    own = who.orders[1:]
    if own and rng.random() < 0.5:
        return own[rng.integers(len(own))]
    return random_order(rng)


def _recipe(order: tuple[str, ...], config: GenerateConfig, rng: np.random.Generator) -> Plan:
    """Return the order without each optional sub-task with probability one half."""
    left_out = {name for name in config.optional if rng.random() < 0.5}
    return Plan(tuple(name for name in order if name not in left_out))
