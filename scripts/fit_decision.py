"""Fit the learned decision: draw pools of random tasks, learn, calibrate, save.

No data set is read. The same seed gives the same pools; a draw that was interrupted is resumed.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import torch
import tyro

from filtering.judging.decision.drawing import draw_lessons, read_lessons
from filtering.judging.decision.model import SHIPPED, save_model
from filtering.judging.decision.training import LearningConfig, learn
from filtering.vision.determinism import one_thread


@dataclass(frozen=True)
class FitDecision:
    """Fit the learned decision to drawn pools."""

    pools: Path
    """Folder for the drawn pools; files that are there are used again."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = SHIPPED
    """Folder for decision.safetensors and decision.json."""
    seed: int = 1
    """Seed of the pools and of the networks."""
    count: int = 60000
    """Number of pools."""
    networks: int = 4
    """Number of networks whose logits are averaged."""
    epochs: int = 6
    """Passes over the pools."""


def main() -> int:
    """Draw, learn, calibrate and save."""
    command = tyro.cli(FitDecision, description=__doc__)
    for number in draw_lessons(command.pools, command.seed, command.count):
        print(f"{number} pools drawn", flush=True)
    lessons = read_lessons(command.pools, command.seed, command.count)
    config = LearningConfig(seed=command.seed, networks=command.networks, epochs=command.epochs)
    with one_thread():
        model = learn(lessons, config, lambda line: print(line, flush=True))
    drawn = {"seed": command.seed, "pools": command.count}
    versions = {"torch": torch.__version__}
    card = {**model.card, "drawn": drawn, "versions": versions}
    save_model(replace(model, card=card), command.out)
    print(f"held back: {model.card['held back']}")
    print(f"decision: {command.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
