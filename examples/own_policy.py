"""A policy of your own, run and scored by `teasim evaluate`.

    cd examples
    teasim evaluate own_policy:Recipe --episodes 2

It carries out the sub-tasks in a fixed order and looks at nothing.
"""

import numpy as np

from policies.data.samples import ObservationSpec
from teasim.constants import SUBTASKS

RECIPE = (
    *("turn_on_oven", "add_tea_bag", "add_sugar", "add_milk"),
    *("turn_off_oven", "add_water", "stir"),
)
"""The optimal order of the paper, Seq_1."""


class Recipe:
    """Chooses the sub-tasks of the recipe one after the other."""

    spec = ObservationSpec(cameras=(), height=0, width=0)
    """What it sees: nothing."""
    action_names = SUBTASKS
    """What it chooses from."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        """Return the next sub-task, and how many have been chosen."""
        del observation, episode_start, deterministic
        taken = 0 if state is None else int(state[0][0])
        action = SUBTASKS.index(RECIPE[min(taken, len(RECIPE) - 1)])
        return np.array(action), (np.array([taken + 1]),)


if __name__ == "__main__":
    print(Recipe().predict({}))
