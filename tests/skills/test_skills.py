"""Laws of every skill in the registry, each carried out once per layout."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from teasim.common.errors import ConfigError, SkillError
from teasim.constants import ARMS, SUBTASKS
from teasim.rollout import run_subtask
from teasim.skills.demonstrators import sample_style, varied
from teasim.skills.library import SKILLS, perform
from teasim.skills.style import Style
from teasim.world.bodies.embodiments import EMBODIMENTS, Embodiment
from teasim.world.bodies.yumi import READY
from teasim.world.liquids import VESSELS
from teasim.world.monitor import PENETRATION_LIMIT, TCP_SPEED_LIMIT, Monitor
from teasim.world.simulation import Simulation
from teasim.world.station import FREE_BODIES, body_name, nominal_layout, sample_layout

LAYOUTS = (0, 1)
HOME = np.concatenate([READY[arm] for arm in ARMS])


def station(seed: int, embodiment: str) -> Simulation:
    simulation = Simulation(embodiment)
    simulation.reset(sample_layout(np.random.default_rng(seed)))
    return simulation


def home(body: Embodiment) -> np.ndarray:
    return np.concatenate([body.ready[arm] for arm in ARMS])


def prepare(simulation: Simulation, subtask: str) -> None:
    """Bring about by hand what the sub-task has to find."""
    if subtask == "turn_off_oven":
        simulation.data.joint("knob").qpos = np.pi / 2
    if subtask == "stir":
        simulation.liquids.cup.update(water=100.0, milk=50.0)
    simulation.step(simulation.target)


@dataclass(frozen=True)
class Outcome:
    """What came of one skill."""

    simulation: Simulation
    happened: tuple[str, ...]
    monitor: Monitor
    targets: np.ndarray  # (n, 2 joints + 2)
    before: dict[str, np.ndarray]  # poses of the free bodies (7,)
    total: dict[str, float]  # of each content, whatever it was in, at every update: (min, max)


CASES = [(e, s, k) for e in EMBODIMENTS for s in SKILLS for k in LAYOUTS]


@pytest.fixture(scope="module", params=CASES, ids=str)
def outcome(request):
    embodiment, subtask, seed = request.param
    simulation = station(seed, embodiment)
    prepare(simulation, subtask)
    earlier = len(simulation.events)
    monitor, totals = Monitor(simulation), []
    simulation.observers.append(lambda: totals.append(contents(simulation)))
    before = poses(simulation)
    targets = []
    for target in perform(subtask, simulation, Style()):
        targets.append(target)
        simulation.step(target)
    happened = simulation.subtasks_done[earlier:]
    spread = np.ptp(totals, axis=0)
    total = dict(zip(VESSELS, spread, strict=True))
    return subtask, Outcome(simulation, happened, monitor, np.array(targets), before, total)


def contents(simulation: Simulation) -> list[float]:
    liquids = simulation.liquids
    return [
        liquids.amounts[name] + liquids.cup[vessel.content] + liquids.spilled[vessel.content]
        for name, vessel in VESSELS.items()
    ]


def poses(simulation: Simulation) -> dict[str, np.ndarray]:
    return {name: simulation.data.joint(body_name(name)).qpos.copy() for name in FREE_BODIES}


def test_exactly_its_sub_task_happens(outcome):
    subtask, result = outcome
    assert result.happened == (subtask,)


def test_both_arms_end_at_ready_with_empty_hands(outcome):
    _, result = outcome
    state = result.simulation.joint_state()
    ready = home(result.simulation.embodiment)
    assert state[:-2] == pytest.approx(ready, abs=1e-2)
    assert result.targets[-1, :-2] == pytest.approx(ready)
    assert not [pair for pair in contacts_now(result) if "fingers" in str(pair)]


def contacts_now(result: Outcome) -> dict:
    monitor = Monitor(result.simulation)
    result.simulation.step(result.simulation.target)
    return monitor.touches


def test_only_its_arm_moves_and_stays_within_the_planning_limits(outcome):
    subtask, result = outcome
    side, body = ARMS.index(SKILLS[subtask].arm), result.simulation.embodiment
    arms = result.targets[:, :-2].reshape(-1, 2, body.width)
    assert np.ptp(arms[:, 1 - side], axis=0) == pytest.approx(np.zeros(body.width))
    assert (arms[:, side] >= body.limits[:, 0] - 1e-9).all()
    assert (arms[:, side] <= body.limits[:, 1] + 1e-9).all()


def test_a_real_body_could_move_like_that(outcome):
    _, result = outcome
    assert result.monitor.joint_speed <= 1
    assert result.monitor.tcp_speed <= TCP_SPEED_LIMIT
    worst = np.abs(np.diff(result.targets[:, :-2], axis=0)).max()
    assert worst < 0.7  # no jump of an elbow between two control steps [rad]


def test_nothing_is_bumped_into_or_pressed_through(outcome):
    _, result = outcome
    assert result.monitor.forbidden == ()
    assert result.monitor.penetration < PENETRATION_LIMIT


def test_everything_ends_upright_where_it_stood(outcome):
    subtask, result = outcome
    taken_away = {"add_tea_bag": {"tea_bag"}}.get(subtask, set())
    after = poses(result.simulation)
    for name in set(FREE_BODIES) - taken_away:
        moved = np.linalg.norm(after[name][:3] - result.before[name][:3])
        assert moved < 0.015, name
        assert upright(after[name]) > np.cos(np.radians(15 if name == "spoon" else 3)), name


def upright(pose: np.ndarray) -> float:
    """Cosine of the lean of a pose (7,)."""
    return float(1 - 2 * (pose[4] ** 2 + pose[5] ** 2))


def test_nothing_is_spilled_or_lost(outcome):
    _, result = outcome
    assert sum(result.simulation.liquids.spilled.values()) == 0
    assert max(result.total.values()) < 1e-6


def test_what_is_poured_is_all_in_the_cup(outcome):
    subtask, result = outcome
    for name, vessel in VESSELS.items():
        if subtask == f"add_{vessel.content}":
            assert result.simulation.liquids.cup[vessel.content] > 0.98 * vessel.filling
            assert result.simulation.liquids.amounts[name] < 0.02 * vessel.filling


def test_the_registry_has_the_seven():
    assert tuple(sorted(SKILLS)) == tuple(sorted(SUBTASKS))


def test_an_unknown_sub_task_is_named():
    with pytest.raises(ConfigError, match="Unknown sub-task 'sing'; choose turn_on_oven"):
        next(perform("sing", Simulation(), Style()))


def lay_down(simulation: Simulation, name: str) -> None:
    """Put a thing on its side, far from everything."""
    joint = simulation.data.joint(body_name(name))
    joint.qpos = [0.15, 0.0, 0.05, np.cos(np.pi / 4), np.sin(np.pi / 4), 0, 0]
    joint.qvel[:] = 0


@pytest.mark.parametrize(
    ("subtask", "thing", "sentence"),
    [
        ("add_water", "kettle", "The kettle does not stand upright; reset the station."),
        ("add_milk", "milk_jug", "The milk_jug does not stand upright; reset the station."),
        ("add_sugar", "sugar_pot", "The sugar_pot does not stand upright; reset the station."),
        ("stir", "spoon", "The spoon does not stand in its holder; reset the station."),
        ("add_tea_bag", "tea_bag", "The tea bag does not stand in its holder; reset the station."),
    ],
)
def test_what_lies_is_refused_before_the_arm_moves(subtask, thing, sentence):
    simulation = Simulation()
    simulation.reset(nominal_layout())
    lay_down(simulation, thing)
    simulation.step(simulation.target)
    with pytest.raises(SkillError) as error:
        run_subtask(simulation, subtask, Style())
    assert str(error.value) == sentence
    assert simulation.target[:14] == pytest.approx(HOME)


def test_a_cup_out_of_reach_is_refused():
    simulation = Simulation()
    simulation.reset(nominal_layout())
    simulation.data.joint("cup/cup").qpos[0] = 0.72
    simulation.step(simulation.target)
    with pytest.raises(SkillError, match="move the object nearer to its nominal place"):
        run_subtask(simulation, "add_milk", Style())
    assert simulation.target[:14] == pytest.approx(HOME)


def test_styles_differ_by_seed_and_within_honest_bounds():
    styles = [sample_style(np.random.default_rng(seed)) for seed in range(20)]
    assert styles[0] == sample_style(np.random.default_rng(0))
    assert len(set(styles)) == len(styles)
    for name in ("tempo", "lift", "bow", "pause", "stir_turns"):
        values = [getattr(style, name) for style in styles]
        assert 0 < np.ptp(values) < 1.5, name


def test_in_one_sub_task_only_tempo_pause_and_second_thoughts_vary():
    style = Style()
    for seed in range(20):
        other = varied(style, np.random.default_rng(seed))
        assert other != style
        again = replace(other, tempo=style.tempo, pause=style.pause)
        assert replace(again, hesitation=style.hesitation, regrasp=style.regrasp) == style
