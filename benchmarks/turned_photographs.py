#!/usr/bin/env python3
"""How far a photograph is from itself when it is turned (docs/experiments/ablation.md).

A slice at 45° shows values between a lattice's texels, and so does a photograph that is turned by
45° with cubic convolution. For the photographs of a plan that look the same when flipped and
turned: LBP distances, relative to self-distance, of the middle as it is and turned, and their
ratio; then the ratio of oblique to axis slices, where the page beside the plan has a lattice. From
the repository, with `python_export` on PYTHONPATH:

    .venv/bin/python benchmarks/turned_photographs.py docs/fidelity-default.toml \
        --photos photographs
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch
from family_choice import measurements
from torch.nn.functional import grid_sample

from solidtex_export.evaluation.comparison import Reference, Settings
from solidtex_export.evaluation.subjects import values
from solidtex_export.research.fidelity.outcome import read_outcomes
from solidtex_export.research.fidelity.plan import read_plan
from solidtex_export.research.fidelity.summary import distance, estimate

METRIC = "binary_patterns"


def middle(picture: np.ndarray, degrees: float) -> np.ndarray:
    """The middle of the picture when it is turned, as large a square as a turn by 45° fills.

    PyTorch interpolates as the engine does: cubic convolution with a = -3/4.
    """
    rows, columns = picture.shape[:2]
    side = int(min(rows, columns) / 2**0.5) - 2
    steps = torch.arange(side) - side // 2
    down, right = torch.meshgrid(steps, steps, indexing="ij")
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x, y = cos * right - sin * down, sin * right + cos * down
    # -1 and 1 are the middles of the edge pixels; no turn needs no value between pixels.
    x, y = x + columns // 2, y + rows // 2
    places = torch.stack([2 * x / (columns - 1) - 1, 2 * y / (rows - 1) - 1], dim=-1)[None].float()
    image = torch.from_numpy(picture).permute(2, 0, 1)[None].float()
    found = grid_sample(image, places, mode="bicubic", align_corners=True)
    return found[0].permute(1, 2, 0).numpy()


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("plan", type=Path, help="the plan; its outcomes stand beside it")
    options.add_argument("--photos", type=Path, required=True, help="folder of the photographs")
    given = options.parse_args()
    plan = read_plan(given.plan, given.photos)
    pairs = read_outcomes(given.plan.with_suffix(".json")).pairs
    photographs, lattices = [], []
    print(
        "| photograph | middle | turned | ratio | lattice, oblique over axes |\n" + "|---" * 5 + "|"
    )
    for entry in plan.exemplars:
        measured = measurements(entry, given.photos)
        if measured.symmetry.name != "all":
            continue
        picture = values(measured.exemplars[0])
        reference = Reference(picture, Settings(symmetry="all", metrics=(METRIC,)))
        found = [
            reference.distances([middle(picture, degrees)])[METRIC].multiple for degrees in (0, 45)
        ]
        row = [*found, found[1] / found[0]]
        photographs.append(row[-1])
        for outcome in pairs[entry.name].values():
            axes, oblique = distance(outcome, "LBP, axes"), distance(outcome, "LBP, oblique")
            if outcome.preset == "lattice" and axes and oblique:
                lattices.append(oblique / axes)
                row.append(lattices[-1])
        figures = [f"{value:.2f}" for value in row] + [""] * (4 - len(row))
        print(f"| {entry.name} | {' | '.join(figures)} |", flush=True)
    print(f"\nphotographs turned: {estimate(photographs)}; lattices at 45°: {estimate(lattices)}")


if __name__ == "__main__":
    main()
