"""A reader, a learner and a mistake each take one file and one line in a registry.

Each test writes that file, adds that one entry, and uses the result through public commands.
"""

import importlib.util
import json
import sys
from pathlib import Path
from types import MappingProxyType, ModuleType

import numpy as np
import pytest

from policies.checkpoint import load_policy
from policies.learners import registry as learners
from policies.learners.registry import LEARNERS
from teasim.cli.main import main
from teasim.common.errors import PoolError
from teasim.generation import GenerateConfig, plan_pool
from teasim.pool.readers import registry as readers
from teasim.pool.readers.registry import open_source
from teasim.task import mistakes
from tests.toy_pool import SEQ_1, SEQ_2, make_toy_pool

READER = '''
"""Text files with one demonstration per line: its name, then its sub-tasks, a frame each."""

from dataclasses import dataclass
from pathlib import Path

from teasim.common.errors import PoolError
from teasim.pool.readers.reader import Reader
from teasim.pool.types import Span


@dataclass(frozen=True)
class Line:
    index: int
    demo_id: str
    steps: tuple[str, ...]
    task: str = ""
    record: None = None

    @property
    def name(self):
        return self.demo_id

    @property
    def length(self):
        return len(self.steps)

    def spans(self):
        return tuple(Span(step, k, k + 1) for k, step in enumerate(self.steps))

    def predicted_spans(self):
        return ()

    def posteriors(self):
        return None

    def clip(self, camera):
        raise PoolError(f"There are no images of '{self.demo_id}'.")


@dataclass(frozen=True)
class Lines:
    root: Path
    episodes: tuple[Line, ...]
    fps: float | None = None
    cameras: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    has_predictions: bool = False

    @property
    def subtasks(self):
        return tuple(dict.fromkeys(step for line in self.episodes for step in line.steps))

    def problems(self):
        return []

    def content_hash(self):
        return str(hash(self.root.read_text()))

    def entries(self, indexes):
        return [self.episodes[index].demo_id for index in indexes]

    def usage(self, indexes, *, keep):
        return []


def open_lines(path, options):
    rows = [line.split() for line in path.read_text().splitlines()]
    return Lines(path, tuple(Line(k, row[0], tuple(row[1:])) for k, row in enumerate(rows)))


READER = Reader("step list", lambda path: path.suffix == ".steps", open_lines)
'''

LEARNER = '''
"""Behaviour cloning that stops after two steps."""

from dataclasses import dataclass

from policies.learners.bc import BC, BCConfig


@dataclass(frozen=True)
class HastyConfig:
    seed: int = 0


class Hasty:
    def __init__(self, config=None):
        self.config = config or HastyConfig()

    def fit(self, samples, weights):
        learned = BC(BCConfig(steps=2, seed=self.config.seed)).fit(samples, weights)
        self.policy_, self.history_ = learned.policy_, learned.history_
        return self
'''

MISTAKE = '''
"""The last step is done first."""

from teasim.task.mistakes import Plan, PlannedMistake


def last_first(plan, rng, subtask=None):
    *others, last = plan.steps
    return Plan((last, *others), (*plan.mistakes, PlannedMistake("last_first", last, 0)))
'''


def module(folder: Path, source: str) -> ModuleType:
    """The module that a file with this source makes."""
    path = folder / "extension.py"
    path.write_text(source)
    spec = importlib.util.spec_from_file_location("extension", path)
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "extension", made)  # dataclasses look there
        spec.loader.exec_module(made)
    return made


def test_a_reader(tmp_path, monkeypatch, capsys):
    path = tmp_path / "salads.steps"
    path.write_text("first cut mix\nsecond mix\n")
    with pytest.raises(PoolError, match="no format that can be read"):
        open_source(path)
    reader = module(tmp_path, READER).READER
    monkeypatch.setattr(readers, "READERS", (*readers.READERS, reader))
    source = open_source(path)
    assert [demo.name for demo in source.episodes] == ["first", "second"]
    assert main(["inspect", str(path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["format"], told["subtasks"]) == ("step list", ["cut", "mix"])
    spans = [span["subtask"] for span in told["demonstrations"][0]["segments"]]
    assert spans == ["cut", "mix"]


def test_a_learner(tmp_path, monkeypatch):
    made = module(tmp_path, LEARNER)
    kind = learners.LearnerKind(made.Hasty, made.HastyConfig, ("subtask",))
    monkeypatch.setitem(LEARNERS, "hasty", kind)
    pool = make_toy_pool(tmp_path / "pool", [SEQ_1, SEQ_2], size=16, frames_per_subtask=4)
    run = tmp_path / "policy"
    line = ["train", str(pool.root), "-o", str(run), "--learner", "hasty", "--observe", "state"]
    assert main(line) == 0
    policy = load_policy(run)
    names = [len(policy.spec.state_names), len(policy.spec.environment_names)]
    seen = dict(zip(("agent_pos", "environment_state"), map(np.zeros, names), strict=True))
    choice, _ = policy.predict(seen, deterministic=True)
    assert 0 <= int(choice) < len(policy.action_names)


def test_a_mistake(tmp_path, monkeypatch):
    made = module(tmp_path, MISTAKE).last_first
    known = MappingProxyType({**mistakes.MISTAKES, "last_first": made})
    monkeypatch.setattr(mistakes, "MISTAKES", known)
    (demo,) = plan_pool(GenerateConfig(seq1=0, mistakes=(("last_first", 1),)))
    assert demo.plan.steps == ("stir", *SEQ_1[:-1])
    assert [mistake.name for mistake in demo.plan.mistakes] == ["last_first"]
