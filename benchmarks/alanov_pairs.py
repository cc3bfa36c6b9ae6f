"""What the discriminator of pairs of an alanov-porous training tells apart.

benchmarks/alanov_pairs.py RESULT VOLUMES

VOLUMES is the folder of the training's volumes. Prints the mean logit of D_tau for pairs of crops
of every two media, and the distance of their codes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from solidtex_export.measuring.volumes import read_volume
from solidtex_export.spaces.alanov.networks import PairDiscriminator
from solidtex_export.spaces.alanov.result import read_alanov

PAIRS = 30


def crops(path: Path, side: int) -> Tensor:
    """Crops [pair, 1, z, y, x] of a volume whose label 0 is pore, as the training has them."""
    values = np.where(read_volume(path).values.T > 0, 1, -1).astype(np.float32)
    random = np.random.default_rng(0)
    corners = [[random.integers(n - side) for n in values.shape] for _ in range(PAIRS)]
    parts = [values[z : z + side, y : y + side, x : x + side] for z, y, x in corners]
    return torch.from_numpy(np.stack(parts))[:, None]


def row(*cells: str) -> None:
    print("| " + " | ".join(cells) + " |")


@torch.no_grad()
def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    p.add_argument("result", type=Path, metavar="RESULT")
    p.add_argument("volumes", type=Path, metavar="VOLUMES")
    args = p.parse_args()
    result = read_alanov(args.result)
    state = torch.load(args.result / "checkpoint.pt", map_location="cpu", weights_only=True)
    judge = PairDiscriminator(result.recipe)
    judge.load_state_dict(state["pairs"])
    judge.eval()
    names = [record["name"] for record in result.photographs]
    files = {path.stem: path for path in args.volumes.iterdir()}
    embedded = [judge.embed(crops(files[name], result.recipe.crops.size)) for name in names]
    logits = [[judge.compare(a, b.roll(1, 0)).mean() for b in embedded] for a in embedded]
    distances = torch.cdist(result.codes, result.codes)
    for title, values in ("mean logit", logits), ("distance of codes", distances):
        print()
        row(title, *names)
        row(*["---"] * (len(names) + 1))
        for name, line in zip(names, values, strict=True):
            row(name, *(f"{value:.2f}" for value in line))


if __name__ == "__main__":
    main()
