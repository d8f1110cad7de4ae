"""Environments that are closed after the test, and skills that only wait."""

import gymnasium
import pytest


@pytest.fixture
def make():
    made = []

    def build(name: str, **kwargs):
        made.append(gymnasium.make(f"teasim:teasim/{name}-v0", **kwargs))
        return made[-1]

    yield build
    for env in made:
        env.close()


@pytest.fixture
def quick(monkeypatch):
    """Skills that only wait: for tests that try many actions and look at everything but physics."""
    monkeypatch.setattr(
        "teasim.envs.subtask_env.run_subtask",
        lambda simulation, *_: simulation.step(simulation.target),
    )
