"""Which of several starts suits a photograph: short trainings decide.

A lattice whose coarse levels speak first (generators/lattice_start.py) draws long veins and ragged
crystals, but makes bands of fine grain; one that is as built turns veins into strokes. Spectrum
and correlation length of the photograph do not tell which it needs: thin veins have those of fine
grain. What each gives after some hundred steps does. Product of the losses, smooth and as built,
and what both gave after 1500 steps, by eye and by patterns along the axes and at 45 degrees:

                    smooth   as built
    grey granite    4.1e-4    4.9e-6   brush strokes 1.01, 2.80; even grain 0.95, 2.48
    brick           2.3e-3    1.3e-4   crumbs in rows; scattered crumbs
    beige granite   1.5e-5    8.0e-7   leans a little 1.33, 2.94; streaked 1.57, 3.75
    rust            6.3e-5    5.2e-5   not compared
    marble          3.8e-5    3.3e-5   veins; strokes (after 500 steps)

Of beige granite it takes the worse, which the network and the wavelets alone would too (1.9e-3 and
6.8e-4; brick 4.2e-3 and 1.7e-3, grey granite 9.6e-3 and 1.7e-3, marble 2.2e-3 and 1.7e-3).
Veins take longer to learn than grain, so the smooth start is taken unless it is 1.6 times as far.
All losses but the critic's count from a trial's beginning: with wavelets and tones from 40 % on, as
in the training, the starts were alike (grey granite 1.4e-5 and 1.1e-5).
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch

from solidtex_export.training.config import Config
from solidtex_export.training.method import CRITIC_LOSSES, Loss
from solidtex_export.training.trainer import Trainer

SIZE = 96  # side of a trial's slices, at most
SLICES = 8  # judged, for each direction
LONG_ENOUGH = 4  # a training with as many times the steps of a trial has one

Record = dict[str, Any]


class Interrupted(Exception):
    """Ctrl-C in a trial, of which nothing is kept."""


def wanted(config: Config) -> bool:
    """Whether the method has starts to choose from, and the training is long enough for it."""
    trial = config.method.trial
    if trial.steps == 0 or len(trial.starts) < 2:
        return False
    if config.steps is not None:
        return config.steps >= LONG_ENOUGH * trial.steps
    return config.minutes is not None and config.minutes >= trial.minutes


def choose_start(
    config: Config,
    make: Callable[[Config, Path], Trainer],
    train: Callable[[Trainer, str], None],
) -> Record:
    """The record for `config.trial`: starts, their distances, the chosen one, and the seconds.

    `make` gives the trainer of a configuration with that folder, `train` runs it under a title.
    """
    distances, seconds = [], 0.0
    starts = config.method.trial.starts
    for number, start in enumerate(starts, 1):
        short = replace(
            config,
            steps=config.method.trial.steps,
            minutes=None,
            size=min(config.size, SIZE),
            method=replace(config.method, start=start, losses=judging(config.method.losses)),
        )
        with tempfile.TemporaryDirectory(prefix="solidtex-trial-") as folder:
            trainer = make(short, Path(folder) / "result")
            train(trainer, f"start {number} of {len(starts)}: ")
        if not trainer.finished:
            raise Interrupted
        distances.append(distance(trainer))
        seconds += trainer.seconds
    seconds, *distances = trainer.ranks.agree(seconds, *distances)
    enough = config.method.trial.tolerance * min(distances)
    best = next(s for s, d in zip(starts, distances, strict=True) if d <= enough)
    return {
        "start": asdict(best),
        "distances": [float(f"{d:.3g}") for d in distances],
        "seconds": round(seconds) if config.minutes is not None else 0,
    }


def judging(losses: tuple[Loss, ...]) -> tuple[Loss, ...]:
    """All but a critic's count from the beginning on: in a trial there is no time for later."""
    return tuple(t if t.kind in CRITIC_LOSSES else replace(t, start=0.0) for t in losses)


def distance(trainer: Trainer) -> float:
    """Product of the losses that need no critic, of many slices taken together.

    A product, since their units differ; many slices, since one differs from the photograph as two
    parts of the photograph do.
    """
    config = trainer.config
    total = 0.0
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        for direction in config.directions:
            with torch.no_grad():
                drawn = [trainer.slices.draw(direction, config.size, 1) for _ in range(SLICES)]
            trainer.objective.forget()
            index = config.exemplar_index(direction)
            _, values = trainer.objective.gradient(torch.cat(drawn), index, progress=0.0)
            total += sum(math.log(v) for v in values.values() if not math.isnan(v) and v > 0)
    return math.exp(total / len(config.directions))
