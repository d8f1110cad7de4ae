"""Measure the transitions of TeaMakingEvents-v0 in physics, and compare what is drawn with physics.

`fit` carries out sub-tasks in TeaMakingSubtasks-v0, those that were measured least in the present
situation first, and writes the transitions. `check` plays random actions in other scenes in physics
and draws the same decisions.
"""

import argparse
import sys
from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from teasim.constants import SUBTASKS
from teasim.envs.registration import SUBTASK_ENV, register_envs
from teasim.envs.transitions import (
    SHIPPED,
    START,
    Change,
    Moment,
    Situation,
    Transitions,
    change_between,
    load_transitions,
    placed,
    situation,
    situations,
)
from teasim.world.liquids import CONTENTS
from teasim.world.simulation import STATION_STATE_NAMES
from teasim.world.station import draw_layout

FIRST_FIT, FIRST_CHECK = 500_000, 600_000
"""Seeds of the first scenes; evaluations count from 1000."""
LENGTH = 10
"""Actions per scene."""
CHANCE = 0.3
"""Share of actions that are drawn uniformly, so that many sequences come before a situation."""
COMPLETE = 1 - 1e-6
"""From here on tea and mixture cannot be measured: what is missing is lost in rounding."""


class Physics:
    """The physical environment, as moments."""

    def __init__(self) -> None:
        register_envs()
        self._env: Any = gym.make(SUBTASK_ENV, max_actions=10**6).unwrapped

    def reset(self, seed: int) -> Moment:
        """Start the scene `seed`."""
        return self._moment(*self._env.reset(seed=seed))

    def step(self, subtask: str) -> tuple[Moment, str]:
        """Carry out `subtask`; the text says why it was refused, if it was."""
        observation, _, _, _, info = self._env.step(SUBTASKS.index(subtask))
        return self._moment(observation, info), info["refused"]

    def _moment(self, observation: dict[str, np.ndarray], info: dict[str, Any]) -> Moment:
        liquids = self._env.get_state().simulation.liquids
        things = observation["environment_state"][: len(STATION_STATE_NAMES)].astype(np.float64)
        for name in ("tea", "mixed"):  # float32 would round what is missing
            things[STATION_STATE_NAMES.index(f"cup_{name}")] = liquids[name]
        spilled = np.array([liquids["spilled"][content] for content in CONTENTS])
        time = float(info["time"])
        return Moment(observation["agent_pos"], things, spilled, info["subtasks_done"], time)


def measure(scenes: int, most: int) -> Transitions:
    """Measure up to `most` transitions of every situation."""
    physics, changes = Physics(), defaultdict[Situation, list[Change]](list)

    def keep(before: Moment, after: Moment, subtask: str, refused: str = "") -> None:
        found = changes[situation(subtask, before.done)]
        if len(found) < most and before.things[-2:].max() < COMPLETE:
            found.append(change_between(before, after, subtask, refused))

    for seed in range(FIRST_FIT, FIRST_FIT + scenes):
        random = np.random.default_rng(seed)
        layout = draw_layout(np.random.default_rng(seed), randomize=True)
        before = physics.reset(seed)
        keep(placed(layout), before, START)
        for _ in range(LENGTH):
            counts = [len(changes[situation(name, before.done)]) for name in SUBTASKS]
            least = int(np.argmin(np.array(counts) + random.random(len(counts))))
            number = int(random.integers(len(counts))) if random.random() < CHANCE else least
            after, refused = physics.step(SUBTASKS[number])
            check_events(before, after, SUBTASKS[number])
            keep(before, after, SUBTASKS[number], refused)
            before = after
    return Transitions({here: found for here, found in changes.items() if found})


def check_events(before: Moment, after: Moment, subtask: str) -> None:
    """Stop if anything but `subtask` was completed: a transition could not say so."""
    new = after.done[len(before.done) :]
    if new not in ((), (subtask,)):
        raise SystemExit(f"{subtask} completed {new}; transitions know no such result.")


def compare(transitions: Transitions, scenes: int) -> None:
    """Print how well drawn transitions agree with those of other scenes in physics."""
    physics, random = Physics(), np.random.default_rng(0)
    events, spills, seconds = Counter[bool](), Counter[bool](), []
    pairs: list[tuple[np.ndarray, np.ndarray]] = []
    for seed in range(FIRST_CHECK, FIRST_CHECK + scenes):
        real = physics.reset(seed)
        layout = draw_layout(np.random.default_rng(seed), randomize=True)
        drawn = transitions.after(placed(layout), START, random)
        for subtask in random.choice(SUBTASKS, LENGTH):
            real, drawn = physics.step(subtask)[0], transitions.after(drawn, subtask, random)
            events[real.done == drawn.done] += 1
            spills[bool((real.spilled > 5).any()) == bool((drawn.spilled > 5).any())] += 1
            seconds.append((real.time, drawn.time))
            pairs.append((real.things, drawn.things))
    total = events.total()
    print(f"{total} actions in {scenes} scenes, the same in physics and drawn")
    print(f"  equal sub-tasks done:   {events[True]} of {total}")
    print(f"  equal spills:           {spills[True]} of {total}")
    real_time, drawn_time = np.array(seconds).T
    print(
        f"  time: largest gap {np.abs(real_time - drawn_time).max():.1f} s, "
        f"of {real_time.max():.0f} s at most"
    )
    real_things, drawn_things = (np.array(part) for part in zip(*pairs, strict=True))
    gaps = np.abs(real_things - drawn_things)
    print("  state of the objects: median and 99th percentile of the gap, and spread in physics")
    for column in range(gaps.shape[1]):
        middle, high = np.quantile(gaps[:, column], [0.5, 0.99])
        spread = real_things[:, column].std()
        print(f"    {STATION_STATE_NAMES[column]:18} {middle:9.4f} {high:9.4f} {spread:9.4f}")


def main() -> int:
    """Fit or check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["fit", "check"])
    parser.add_argument("--scenes", type=int, default=180, help="scenes that are simulated")
    parser.add_argument("--most", type=int, default=24, help="transitions kept per situation")
    parser.add_argument("--file", type=Path, default=SHIPPED, help="file of the transitions")
    arguments = parser.parse_args()
    if arguments.what == "check":
        compare(load_transitions(arguments.file), arguments.scenes)
        return 0
    transitions = measure(arguments.scenes, arguments.most)
    transitions.save(arguments.file)
    counts = {here: len(found) for here, found in transitions.changes.items()}
    missing = situations() - set(counts)
    print(
        f"{sum(counts.values())} transitions in {len(counts)} situations, "
        f"at least {min(counts.values())} in each; not measured: {sorted(missing) or 'none'}"
    )
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
