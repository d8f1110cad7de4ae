"""Pools of people, of random looks, and whole sets of pools."""

import numpy as np
import pytest

from teasim.cli import generate as verb
from teasim.cli.main import main
from teasim.common.errors import ConfigError
from teasim.generation import DemoPlan, GenerateConfig, Generated, generate, making, plan_pool
from teasim.generation.presets import PRESETS, find_preset
from teasim.pool.integrity import check_pool
from teasim.skills.demonstrators import PARTICIPANTS
from teasim.task.mistakes import Plan, PlannedMistake
from teasim.task.recipes import SEQ_1, is_legal

SHORT = DemoPlan(
    0, "seq_3", Plan(("turn_on_oven",), (PlannedMistake("skip", "add_water", 1),)), "person_2"
)


def test_people_take_turns_and_nobody_makes_all_the_mistakes():
    plans = plan_pool(GenerateConfig(seq1=9, seq3=9, legal=9, embodiment="person"))
    for sequence in ("seq_1", "seq_3", "legal"):
        who = [demo.participant for demo in plans if demo.sequence == sequence]
        assert sorted(map(who.count, set(who))) == [3, 3, 3]
    two = plan_pool(GenerateConfig(seq1=8, embodiment="person", participants=2))
    assert {demo.participant for demo in two} == {"person_1", "person_2"}
    assert {demo.participant for demo in plan_pool(GenerateConfig(seq1=3))} == {"yumi"}


def test_people_have_orders_of_their_own_among_the_legal_ones():
    plans = plan_pool(GenerateConfig(seq1=0, legal=60, embodiment="person"))
    assert all(is_legal(demo.plan.steps) for demo in plans)
    own = [demo.plan.steps in PARTICIPANTS[demo.participant].orders[1:] for demo in plans]
    assert 15 < sum(own) < 45


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """One short film of a person, in the fixed look and in a random one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(making, "plan_pool", lambda _: (SHORT,))
        root = tmp_path_factory.mktemp("people")
        return {
            look: generate(
                root / look,
                GenerateConfig(0, 0, 1, size=64, embodiment="person", look=look),
            ).pool
            for look in ("fixed", "random")
        }


@pytest.mark.slow
def test_a_film_of_a_person_has_no_log(films):
    for pool in films.values():
        assert check_pool(pool.root) == []
        (episode,) = pool.episodes
        assert (episode.participant, episode.embodiment) == ("person_2", "person")
        assert pool.state_names is None
        assert not {"observation.state", "action"} & set(pool.info["features"])


@pytest.mark.slow
def test_a_random_look_films_the_same_demonstration(films):
    fixed, other = (films[look].episodes[0] for look in ("fixed", "random"))
    assert fixed.length == other.length
    pictures = [episode.clip("left").frames([5]) for episode in (fixed, other)]
    assert np.abs(np.subtract(*pictures, dtype=np.int16)).mean() > 3


def test_the_papers_set_is_36_films_of_three_people_and_12_of_the_robot():
    people, robot = (find_preset("paper")[name] for name in ("people", "yumi"))
    assert (len(plan_pool(people)), len(plan_pool(robot))) == (36, 12)
    assert {demo.participant for demo in plan_pool(people)} == {"person_1", "person_2", "person_3"}
    for config in (people, robot):
        orders = [demo.plan.steps for demo in plan_pool(config)]
        assert orders.count(SEQ_1) >= len(orders) / 2
        assert config.seq1 > config.seq2 > config.seq3 > 0


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_makes_its_pools_in_folders_of_their_own(name, tmp_path, monkeypatch, capsys):
    made = {}

    def fake(folder, config, **_):
        made[folder] = config
        pool = type("Pool", (), {"episodes": range(sum(config.counts.values()))})
        return Generated(pool, 1)

    monkeypatch.setattr(making, "generate", fake)
    ignored = ["--seq1", "0", "--seq2", "-1", "--participants", "9"]
    options = ["--preset", name, "--seed", "7", "--size", "64", *ignored]
    assert verb.main([str(tmp_path), *options]) == 0
    assert {path.name for path in made} == set(PRESETS[name])
    assert {(config.seed, config.size) for config in made.values()} == {(7, 64)}
    assert all(config.team and config.seq1 for config in made.values())
    count = sum(sum(config.counts.values()) for config in made.values())
    assert capsys.readouterr().out.startswith(f"{count} demonstrations in {tmp_path} (")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--preset", "poem"], "Unknown preset 'poem'; choose paper."),
        (["--embodiment", "cat"], "Unknown embodiment 'cat'; choose yumi, person."),
        (["--look", "odd"], "Unknown look 'odd'; choose fixed, random."),
        (["--participants", "4"], "The number of participants is 4; choose 1 to 3."),
        (
            ["--optional", "stir"],
            "'stir' is not optional; choose add_sugar, add_milk.",
        ),
    ],
)
def test_what_cannot_be_made_is_named(options, sentence, tmp_path, capsys):
    assert main(["generate", str(tmp_path / "pool"), *options]) == 2
    assert capsys.readouterr().err == f"teasim: {sentence}\n"
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_preset_is_an_error_of_the_configuration():
    with pytest.raises(ConfigError):
        find_preset("poem")
