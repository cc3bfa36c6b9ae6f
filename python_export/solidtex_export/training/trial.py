"""Which of several starts suits a photograph: short trainings decide.

Large early steps, in which each slice has its own statistics, draw long thin lines, and bands of
what is none: rust became stripes that lean alike through the whole solid, brick rows of crumbs.
Without them marble's veins are specks. Spectrum and correlation length of the photograph do not
tell which it needs: thin veins have those of fine grain. What each gives after some hundred steps
does. Product of network and tones, both from the smooth start (generators/lattice_start.py), and
what they gave after 1500 steps, by eye and by the coarse coherence of slices normal to x, y and z:

                    small steps   large steps
    marble           4.6e-4        7.6e-5   specks; veins
    grey granite     7.6e-4        2.6e-4   even grain 0.19, 0.11, 0.07; brush strokes
    rust             1.7e-4        1.1e-4   patches 0.13, 0.13, 0.04; stripes 0.53, 0.14, 0.11
    brick            1.4e-3        1.7e-3   round crumbs 0.02, 0.08, 0.03; crumbs in rows

(Rust's stripes after 2360.) Large steps are mostly ahead after so few, so they are taken only where
small ones are 4.2 times as far. All losses but the critic's count from a trial's beginning.
Wavelets do not judge, since they compare the energy that a vein has, which scattered dots have too:
with them small steps were 8.4 times as far on marble, 6.1 on grey granite, 2.6 on rust and 1.9 on
brick, so that marble is less apart.

It is not sure of a granite. The figures above are of seed 0 on one thread; with another seed small
steps were 4.6 times as far on marble (by network, tones and wavelets 2.4, 1.9 and 1.5 times) and
8.3 on grey granite (2.6, 3.2, 2.2), on two threads 4.9 and 11: they come slowly to a granite, and
more so to marble only in the long run. Kurtosis of the photograph's octaves, and how much its fine
edges agree in direction, do not tell marble from granite and brick either.

Before, the trial was between the smooth start and weights as they are built, both with large steps.
As built, which it took of grey granite (patterns 0.95, 2.48, now 1.24, 3.26), gives sharper grain
with a weave; but it took it of beige granite too, with streaks, and could not tell rust (products
6.3e-5 and 5.2e-5), which became stripes, from marble (3.8e-5 and 3.3e-5).
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
SLICES = 8  # judged together, for each direction
JUDGEMENTS = 4
TINY = 1e-30  # losses have logarithms
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
    """Product of the losses that judge, as a mean of logarithms over many slices.

    A product, since their units differ; many slices together, since one differs from the photograph
    as two parts of the photograph do; and several times, since the descriptor sees other crops and
    turns of the colours in each.
    """
    config = trainer.config
    judges = [
        name
        for name, term in zip(trainer.objective.names, config.method.losses, strict=True)
        if term.kind in config.method.trial.judges
    ]
    logarithms = []
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        for direction in list(config.directions) * JUDGEMENTS:
            with torch.no_grad():
                drawn = [trainer.slices.draw(direction, config.size, 1) for _ in range(SLICES)]
            trainer.objective.forget()
            index = config.exemplar_index(direction)
            _, values = trainer.objective.gradient(torch.cat(drawn), index, progress=0.0)
            logarithms.append(sum(math.log(max(values[name], TINY)) for name in judges))
    return math.exp(sum(logarithms) / len(logarithms))
