"""A policy of your own, run and scored by `teasim evaluate`.

    cd examples
    teasim evaluate own_policy:Recipe --episodes 2

It carries out the sub-tasks in a fixed order and looks at nothing.
"""

from teasim.constants import SUBTASKS

RECIPE = (
    *("turn_on_oven", "add_tea_bag", "add_sugar", "add_milk"),
    *("turn_off_oven", "add_water", "stir"),
)
"""The optimal order of the paper, Seq_1."""


class Recipe:
    """Chooses the sub-tasks of the recipe one after the other."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        """Return the next sub-task, and how many have been chosen."""
        del observation, episode_start, deterministic
        taken = 0 if state is None else state
        return SUBTASKS.index(RECIPE[taken % len(RECIPE)]), taken + 1


if __name__ == "__main__":
    print(Recipe().predict({}))
