"""What the discriminator of pairs of a training with an Alanov preset tells apart.

benchmarks/alanov_pairs.py RESULT MATERIALS

MATERIALS is the folder of the training's volumes or photographs. Prints the mean logit of D_tau for
pairs of crops of every two materials, and the distance of their codes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch
from permeability import row

from solidtex_export.spaces.alanov.materials import load_textures, random_crop
from solidtex_export.spaces.alanov.networks import PairDiscriminator
from solidtex_export.spaces.alanov.result import read_alanov

PAIRS = 30


@torch.no_grad()
def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    p.add_argument("result", type=Path, metavar="RESULT")
    p.add_argument("materials", type=Path, metavar="MATERIALS")
    args = p.parse_args()
    result = read_alanov(args.result)
    state = torch.load(args.result / "checkpoint.pt", map_location="cpu", weights_only=True)
    judge = PairDiscriminator(result.recipe)
    judge.load_state_dict(state["pairs"])
    judge.eval()
    torch.manual_seed(0)
    names, embedded = [], []
    for texture in load_textures([args.materials], None, result.resolution, result.recipe):
        crops = [random_crop(texture.values, result.recipe.crops.size) for _ in range(PAIRS)]
        names.append(texture.name)
        embedded.append(judge.embed(torch.stack(crops).float()))
    logits = [[judge.compare(a, b.roll(1, 0)).mean() for b in embedded] for a in embedded]
    codes = result.codes[[result.index_of(name) for name in names]]
    distances = torch.cdist(codes, codes)
    for title, values in ("mean logit", logits), ("distance of codes", distances):
        print()
        row(title, *names)
        row(*["---"] * (len(names) + 1))
        for name, line in zip(names, values, strict=True):
            row(name, *(f"{value:.2f}" for value in line))


if __name__ == "__main__":
    main()
