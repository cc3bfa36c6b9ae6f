"""Shows what a descriptor can tell: an image of free pixels whose statistics match a photograph's.

Gatys et al. 2015, "Texture synthesis using convolutional neural networks", with Adam. What such an
image lacks, no generator learns from this descriptor.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch

from solidtex_export.commands import cli
from solidtex_export.evaluation.report import png
from solidtex_export.export.verification.model_output import check_output
from solidtex_export.images.exemplar import load_exemplar
from solidtex_export.losses.descriptor.weights import DISTILLED, load_weights
from solidtex_export.losses.descriptors import DescriptorSource, PretrainedWeights
from solidtex_export.networks import load_network
from solidtex_export.spaces.colors import color_axes
from solidtex_export.whole_file import write_whole

PROGRAM = "free_pixels.py"
RATE, CONTRAST = 0.05, 0.5  # Adam's, and the deviation of the first pixels
EXAMPLES = f"""  {PROGRAM} pebbles.jpg -o free.png
  {PROGRAM} pebbles.jpg --features squeezenet.safetensors -o free.png"""


def main(arguments: list[str] | None = None) -> int:
    p = cli.parser(PROGRAM, __doc__ or "", EXAMPLES, has_json=False)
    p.add_argument("photo", type=Path)
    p.add_argument("--descriptor", metavar="FILE", type=Path, default=DISTILLED,
                   help="weights of solidtex-pretrain-descriptor (the distilled ones)")  # fmt: skip
    p.add_argument("--features", metavar="FILE", type=Path,
                   help="weights of SqueezeNet or VGG-19 instead")  # fmt: skip
    p.add_argument("--size", type=int, default=192, help="pixels of a side (192)")
    p.add_argument("--steps", type=int, default=300, help="(300)")
    p.add_argument("--seed", type=int, default=0, help="(0)")
    cli.add_output_arguments(p, "IMAGE", ".png")
    return cli.run(p, arguments, write)


def write(args: argparse.Namespace) -> None:
    """Write the image."""
    check_output(args.output, args.force, ".png")
    torch.manual_seed(args.seed)
    photo = load_exemplar(args.photo, args.size, 1).image
    mean, basis = color_axes(photo)
    real = torch.linalg.solve(basis, (photo - mean[:, None, None]).flatten(1)).view_as(photo)[None]
    weights = PretrainedWeights(
        load_network(args.features) if args.features else None, load_weights(args.descriptor)
    )
    descriptor = DescriptorSource(mean, basis, weights).make("features")
    free = (CONTRAST * torch.randn(1, 3, args.size, args.size)).requires_grad_()
    optimizer = torch.optim.Adam([free], RATE)
    for step in range(args.steps):
        with torch.autocast("cpu", torch.bfloat16):
            loss = descriptor.distance(free, descriptor.measure(real))
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        if step % 50 == 0:
            cli.say(f"step {step}, distance {loss.item():.4g}")
    colors = torch.einsum("ij,jrc->rci", basis, free.detach()[0]) + mean
    write_whole(args.output, png(colors.clamp(0, 1).numpy()))
    print(f"{args.output}: distance {loss.item():.4g} after {args.steps} steps")


if __name__ == "__main__":
    raise SystemExit(main())
