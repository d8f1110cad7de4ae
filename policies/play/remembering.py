"""An environment that simulates each sequence of decisions in a scene only once.

Policies that are compared act in the same scenes, mostly with the same decisions, and each decision
takes seconds of simulation. The environment is deterministic, so the result of a sequence of
decisions in a scene is cached. For a new decision the environment is reset to the state before it.
"""

from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

import gymnasium as gym

SCENES = 64
"""Scenes in the cache; the least recently used one is dropped."""

Decisions = tuple[int, ...]
"""Actions since the reset."""


@dataclass(frozen=True)
class Moment:
    """A scene after some decisions."""

    seen: tuple[Any, float, bool, bool, dict[str, Any]]
    """Result of `step`."""
    state: Any
    """Argument of `set_state` that returns the environment here."""


class Remembering(gym.Wrapper[Any, int, Any, int]):
    """Returns cached results where possible; they equal those of `env` bit for bit."""

    def __init__(self, env: gym.Env[Any, int]) -> None:
        """Wrap an environment that `can_remember`."""
        super().__init__(env)
        self._scenes: OrderedDict[int, dict[Decisions, Moment]] = OrderedDict()
        self._seed = 0
        self._decisions: Decisions = ()
        self._present: Moment | None = None
        """The moment `env` is in."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start the scene `seed`, without options.

        Raises:
            ValueError: there is no seed, or there are options; scenes are identified by the seed.
        """
        if seed is None or options:
            raise ValueError("Scenes are identified by the seed; give one, and no options.")
        self._seed, self._decisions = seed, ()
        if seed not in self._scenes:
            observation, info = self.env.reset(seed=seed)
            self._scenes[seed] = {}
            self._keep((observation, 0.0, False, False, info))
        self._scenes.move_to_end(seed)
        while len(self._scenes) > SCENES:
            self._scenes.popitem(last=False)
        seen = self._here.seen
        return seen[0], seen[4]

    def step(self, action: int) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Return the cached result of `action`, or simulate it."""
        before = self._here
        self._decisions = (*self._decisions, int(action))
        if self._decisions not in self._scenes[self._seed]:
            self._go_to(before)
            observation, reward, terminated, truncated, info = self.env.step(action)
            self._keep((observation, float(reward), terminated, truncated, info))
        return self._here.seen

    def render(self) -> Any:
        """Picture of the scene in its present state."""
        self._go_to(self._here)
        return self.env.render()

    @property
    def _here(self) -> Moment:
        return self._scenes[self._seed][self._decisions]

    def _keep(self, seen: tuple[Any, float, bool, bool, dict[str, Any]]) -> None:
        world: Any = self.env.unwrapped
        self._present = Moment(seen, world.get_state())
        self._scenes[self._seed][self._decisions] = self._present

    def _go_to(self, moment: Moment) -> None:
        if self._present is not moment:
            world: Any = self.env.unwrapped
            world.set_state(moment.state)
            self._present = moment


def can_remember(env: gym.Env[Any, int]) -> bool:
    """Whether `env` can restore a state, and no wrapper around it counts steps."""
    able = hasattr(env.unwrapped, "get_state") and hasattr(env.unwrapped, "set_state")
    return able and (env.spec is None or env.spec.max_episode_steps is None)
