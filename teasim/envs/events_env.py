"""`teasim/TeaMakingEvents-v0`: whole sub-tasks whose results are drawn instead of simulated."""

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from teasim.common.errors import ConfigError
from teasim.constants import STATE_NAMES, SUBTASKS
from teasim.envs.decisions import (
    DecisionWeights,
    check_max_actions,
    decision_terms,
    subtask_of,
)
from teasim.envs.observations import observation_space
from teasim.envs.reports import VIOLATION_METADATA, report
from teasim.envs.transitions import START, Moment, apply_change, load_transitions, placed
from teasim.task.recipes import oven_is_on
from teasim.task.scoring import Verdict, judge
from teasim.world.liquids import CONTENTS
from teasim.world.simulation import Simulation
from teasim.world.station import draw_layout


@dataclass(frozen=True)
class EventsState:
    """The state of a `TeaMakingEventsEnv` between two steps; it can be pickled."""

    env: str
    """Name of the environment's class."""
    moment: Moment
    """The station."""
    random: Mapping[str, Any]
    """State of the generator of what is drawn."""
    actions: int
    """Actions since the reset."""


class TeaMakingEventsEnv(gymnasium.Env[dict[str, Any], Any]):
    """`TeaMakingSubtasksEnv` without physics, for learners that need very many decisions.

    Actions, observations, `info`, reward and the layout that a seed gives are those of
    `TeaMakingSubtasksEnv` with `obs_type="state"`. What a sub-task changes is drawn from
    transitions that were measured there (`teasim.envs.transitions`), some thousand times faster.
    What depends on where things stand, such as a thing out of reach, happens as often as in
    physics, but not in the same layouts. So a policy that was trained here is scored there.
    """

    metadata = {"render_modes": [], **VIOLATION_METADATA}  # noqa: RUF012 (as Gymnasium declares it)

    def __init__(
        self,
        *,
        obs_type: str = "state",
        max_actions: int = 14,
        reward_weights: Mapping[str, float] | None = None,
        randomize: bool = True,
    ) -> None:
        """Read the measured transitions.

        Args:
            obs_type: state; there are no pictures.
            max_actions: The episode is truncated after this number of actions.
            reward_weights: Weights of terms of the reward that replace those of `DecisionWeights`.
            randomize: Move and turn the things on the table at every reset.

        Raises:
            ConfigError: an argument is unknown or out of range.
        """
        if obs_type != "state":
            raise ConfigError(
                f"TeaMakingEvents-v0 has no obs_type '{obs_type}'; choose state, or the "
                "environment teasim/TeaMakingSubtasks-v0."
            )
        self._weights = DecisionWeights.of(reward_weights)
        self._max_actions = check_max_actions(max_actions)
        self._randomize = randomize
        self._transitions = load_transitions()
        self._still = Simulation()  # is never stepped: tells what the hands see
        self.observation_space = observation_space(obs_type, STATE_NAMES, (), (0, 0))
        self.action_space = spaces.Discrete(len(SUBTASKS))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start a new episode; `options` as in `StationEnv.reset`."""
        super().reset(seed=seed)
        randomize = (options or {}).get("randomize", self._randomize)
        layout = placed(draw_layout(self.np_random, randomize=randomize))
        start = self._transitions.after(layout, START, self.np_random)
        self._go_to(start)
        self._actions = 0
        return self._observation(), self._info()

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Draw what sub-task number `action` changes.

        Raises:
            ConfigError: there is no sub-task of that number; nothing has changed then.
        """
        subtask, before, verdict = subtask_of(action), self._moment, self._verdict
        change = self._transitions.draw(before, subtask, self.np_random)
        self._go_to(apply_change(before, subtask, change))
        self._actions += 1
        terms = decision_terms(subtask, before.done, self._moment.done, (verdict, self._verdict))
        info = self._info() | {"refused": str(change.refused), "reward_terms": terms}
        success = self._verdict.success
        truncated = not success and self._actions >= self._max_actions
        return self._observation(), self._weights.total(terms), success, truncated, info

    def get_state(self) -> EventsState:
        """Return everything that the environment's future depends on, but the actions to come."""
        random = copy.deepcopy(self.np_random.bit_generator.state)
        return EventsState(type(self).__name__, self._moment, random, self._actions)

    def set_state(self, state: EventsState) -> None:
        """Return to `state`, from which the same actions give the same bits as before.

        Raises:
            ConfigError: the state was taken from another environment; nothing has changed then.
        """
        if state.env != type(self).__name__:
            raise ConfigError(f"The state is of {state.env}; this is {type(self).__name__}.")
        self._go_to(state.moment)
        self.np_random.bit_generator.state = copy.deepcopy(dict(state.random))
        self._actions = state.actions

    def _go_to(self, moment: Moment) -> None:
        self._moment = moment
        spilled = dict(zip(CONTENTS, moment.spilled.tolist(), strict=True))
        self._verdict: Verdict = judge(
            moment.done, oven_on=oven_is_on(moment.done), spilled=spilled
        )

    def _observation(self) -> dict[str, np.ndarray]:
        things = self._moment.things.astype(np.float32)
        seen = self._still.seen_by_hands(self._moment.joints, things)
        return {
            "agent_pos": self._moment.joints.astype(np.float32),
            "environment_state": np.concatenate([things, seen]),
        }

    def _info(self) -> dict[str, Any]:
        return report(self._moment.done, self._verdict, self._moment.time)
