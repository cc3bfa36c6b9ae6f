"""Trains lattices whose coarse levels have seen the photograph at half its size before.

    coarse_first.py benchmarks/coarse_first.toml --photos photographs -o results/coarse
    solidtex-fidelity benchmarks/coarse_first.toml --photos photographs --features FILE \\
        -o results/coarse

A slice of half the size shows four times the area. Its network, without the finest level, is
trained first; then its weights become those of the same levels of the whole network. The second
command finds the trainings of the method `coarse-first`, adds the others, and compares.
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

PROGRAM = "coarse_first.py"
METHOD = "coarse-first"
COARSE_STEPS = 150
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
        result = args.output / entry.name / METHOD / "result"
        if result.exists():
            continue
        result.parent.mkdir(parents=True, exist_ok=True)
        coarse_result = result.with_name("coarse")
        shutil.rmtree(coarse_result, ignore_errors=True)
        photo = str(photograph(entry, args.photos))
        common = [photo, "--preset=lattice", f"--size={entry.size}", "--threads=1"]
        coarse = trainer_of(
            *common,
            f"--resolution={entry.resolution // 2}",
            f"--steps={COARSE_STEPS}",
            f"--set=generator.sizes.levels={LEVELS - 1}",
            f"-o={coarse_result}",
        )
        coarse.run(lambda: False, lambda _: None)
        whole = trainer_of(
            *common,
            f"--resolution={entry.resolution}",
            f"--steps={plan.method(METHOD).options[-1]}",
            f"-o={result}",
        )
        continue_from(coarse.generator.state_dict(), whole)
        whole.run(lambda: False, lambda _: None)
        print(f"{entry.name}: {coarse.seconds:.0f} s and {whole.seconds:.0f} s", flush=True)


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
    whole.optimizer.renew()


if __name__ == "__main__":
    sys.exit(main())
