"""Environments that are closed after the test."""

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
