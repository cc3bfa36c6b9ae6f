"""Trains lattices whose coarse levels see the photograph at half or a quarter of its size too.

    coarse_first.py benchmarks/coarse_first.toml --photos photographs -o results/coarse
    solidtex-fidelity benchmarks/coarse_first.toml --photos photographs --features FILE \\
        -o results/coarse

A slice at half the size shows four times the area. Its network has no finest level. For the method
`coarse-first` it is trained first; then its weights become those of the same levels of the whole
network. For `half-head` both networks share these levels, and after every second step of the whole
one the other makes a step: its last layer is a head for colors at half resolution, which the export
drops (MSG-GAN, Karnewar and Wang 2020). `quarter-head` has its head at a quarter, and shows as
large an area by slices of half the side. The second command finds these trainings, adds the
others, and compares.
docs/experiments/ablation.md has the figures.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path
from typing import Any

from space_curves import trainer_of

from solidtex_export.commands import cli
from solidtex_export.research.fidelity.plan import photograph, read_plan
from solidtex_export.training.optimizer import GeneratorOptimizer

PROGRAM = "coarse_first.py"
METHODS = {"coarse-first": (150, 1), "half-head": (100, 1), "quarter-head": (134, 2)}
"""Steps of the coarse network, and how often its photograph is halved."""
LEVELS = 6  # of the preset `lattice`


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, train_all)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(PROGRAM, __doc__ or "", "", has_json=False)
    p.add_argument("plan", metavar="PLAN", type=Path)
    p.add_argument("--photos", metavar="FOLDER", type=Path, required=True)
    p.add_argument("-o", dest="output", metavar="FOLDER", type=Path, required=True)
    return p


def train_all(args: argparse.Namespace) -> None:
    plan = read_plan(args.plan)
    for entry in plan.exemplars:
        for method, (coarse_steps, halvings) in METHODS.items():
            result = args.output / entry.name / method / "result"
            if result.exists():
                continue
            result.parent.mkdir(parents=True, exist_ok=True)
            coarse_result = result.with_name("coarse")
            shutil.rmtree(coarse_result, ignore_errors=True)
            photo = str(photograph(entry, args.photos))
            directions = [f"--directions={entry.directions}"] if entry.directions else []
            common = [photo, "--preset=lattice", "--threads=1", *directions]
            coarse = trainer_of(
                *common,
                f"--size={2 * entry.size >> halvings}",
                f"--resolution={entry.resolution >> halvings}",
                f"--steps={coarse_steps}",
                f"--set=generator.sizes.levels={LEVELS - halvings}",
                f"-o={coarse_result}",
            )
            whole = trainer_of(
                *common,
                f"--size={entry.size}",
                f"--resolution={entry.resolution}",
                f"--steps={plan.method(method).options[-1]}",
                f"-o={result}",
            )
            train = train_in_turn if method == "coarse-first" else train_together
            train(coarse, whole)
            print(f"{entry.name}, {method}: {coarse.seconds:.0f} s and {whole.seconds:.0f} s",
                  flush=True)  # fmt: skip


def train_in_turn(coarse: Any, whole: Any) -> None:
    coarse.run(lambda: False, lambda _: None)
    continue_from(coarse.generator.state_dict(), whole)
    whole.run(lambda: False, lambda _: None)


def train_together(coarse: Any, whole: Any) -> None:
    """Stages are numbered from the coarsest level, so that those of one name are the same."""
    for name, stage in whole.generator.named_children():
        if name.startswith(("cb", "up")) and hasattr(coarse.generator, name):
            setattr(coarse.generator, name, stage)
    coarse.measure_statistics()
    whole.measure_statistics()
    renew_optimizer(coarse)

    def step_coarse(trained: Any) -> None:
        if trained.step % 2 == 0 and coarse.progress < 1:
            start = coarse.clock()
            coarse._train_step()
            coarse.seconds += coarse.clock() - start

    whole.run(lambda: False, step_coarse)


def continue_from(state: dict[str, Any], whole: Any) -> None:
    """Give the whole network the weights of the coarse one, and measure those of its finest level.

    Stages are numbered from the coarsest level, so that the names agree.
    """
    own = whole.generator.state_dict()
    shared = {k: v for k, v in state.items() if k.startswith(("cb", "up"))}
    assert all(own[k].shape == v.shape for k, v in shared.items())
    whole.generator.load_state_dict(own | shared)
    whole.measure_statistics()
    whole.generator.load_state_dict(whole.generator.state_dict() | shared)
    renew_optimizer(whole)


def renew_optimizer(training: Any) -> None:
    """Let the optimizer find the generator's new modules, and the size of their weights."""
    settings = training.config.recipe.optimizer
    training.optimizer = GeneratorOptimizer(training.generator, settings)


if __name__ == "__main__":
    sys.exit(main())
