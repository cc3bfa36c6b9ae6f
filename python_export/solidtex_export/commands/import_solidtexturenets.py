"""solidtex-import-solidtexturenets: converts a published checkpoint to a `.solidtex` file.

The public implementation of Gutierrez et al. 2020 saves `params.pytorch`, a state dict with the
keys of `lattice.py`. Its last convolution gives B, G, R times 255 minus a mean color.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from solidtex_export.commands import cli
from solidtex_export.export.file_format.model_file import VERSION, ModelFile
from solidtex_export.export.fold import fold_lattice
from solidtex_export.export.lattice_state import (
    COLOR_BUFFERS,
    LatticeSizes,
    StateError,
    check_lattice_state,
)
from solidtex_export.export.verification.model_output import check_output, summary, write_verified
from solidtex_export.export.verification.networks import lattice_network
from solidtex_export.state_file import read_state

PROGRAM = "solidtex-import-solidtexturenets"
SCHEME = "solidtexturenets"
NEGATIVE_SLOPE = 0.01
MEAN_BGR = (0.40760392, 0.45795686, 0.48501961)  # of the network's training images
CHANNELS = 3
BOUND = 2e-4  # colors of published networks are larger inside, by 255, than ours

EXAMPLES = f"""  {PROGRAM} params.pytorch -o marble.solidtex
  {PROGRAM} params.pytorch -o marble.solidtex --license CC-BY-4.0 --source "J. Doe, marble"
Then: solidtex-info marble.solidtex"""


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, convert)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(
        PROGRAM,
        "Convert a checkpoint of the public SolidTextureNets implementation (Gutierrez et al. 2020)"
        " and verify that the C++ engine evaluates it as the network does.",
        EXAMPLES,
    )
    p.add_argument("checkpoint", metavar="PARAMS", type=Path, help="params.pytorch, a state dict")
    cli.add_model_arguments(p)
    p.add_argument("--exemplar-license", help="licence of the photograph it was trained on")
    p.add_argument("--source", help="where the photograph comes from")
    return p


def convert(args: argparse.Namespace) -> cli.Document:
    check_output(args.output, args.force)
    state = read_state(args.checkpoint, "a params.pytorch", StateError)
    try:
        sizes = check_published(state)
    except StateError as error:
        raise StateError(f"{args.checkpoint}: {error}") from error
    state = with_colors(state)
    generator = sizes.generator(NEGATIVE_SLOPE).double()
    generator.load_state_dict(state, strict=False)  # num_batches_tracked may be missing
    graph, tensors = fold_lattice(state, NEGATIVE_SLOPE)
    model = ModelFile(document(args, graph), tensors)
    network = lattice_network(generator, SCHEME)
    found = write_verified(args.output, model, network, BOUND)
    print(f"{cli.output_name(args)}: {summary(args.output, model, found)}")
    return cli.files(args.output)


def check_published(state: Mapping[str, Tensor]) -> LatticeSizes:
    """Check for a complete lattice generator whose output is B, G, R."""
    for key in COLOR_BUFFERS:
        if key in state:
            raise StateError(f"{key}: found a checkpoint of solidtex-train; use solidtex-export")
    sizes = check_lattice_state(state)
    if sizes.out_channels != CHANNELS:
        found = tuple(state["last_conv.weight"].shape)
        raise StateError(f"last_conv.weight: found shape {found}, expected {CHANNELS} outputs")
    return sizes


def with_colors(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Add the color affine of the network's output: R, G, B = means + reversed(y) / 255."""
    return dict(state) | {
        "color_mean": torch.tensor(MEAN_BGR[::-1], dtype=torch.float64),
        "color_basis": torch.eye(CHANNELS, dtype=torch.float64).flip(0) / 255,
    }


def document(args: argparse.Namespace, graph: dict[str, Any]) -> dict[str, Any]:
    exemplar = {"license": args.exemplar_license, "source": args.source}
    exemplar = {key: value for key, value in exemplar.items() if value}
    return {
        "version": VERSION,
        "name": args.name or args.output.stem,
        "family": "field",
        "channels": ["albedo.r", "albedo.g", "albedo.b"],
        "color_space": "srgb",
        "noise": {"scheme": SCHEME},
        "field": graph,
        "training": {"imported_from": "SolidTextureNets", "file": args.checkpoint.name},
        **({"exemplar": exemplar} if exemplar else {}),
        **({"license": args.license} if args.license else {}),
    }


if __name__ == "__main__":
    sys.exit(main())
