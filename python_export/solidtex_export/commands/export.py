"""solidtex-export: converts a training result to a `.solidtex` file and verifies it."""

from __future__ import annotations

import argparse
import copy
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from solidtex_export.commands import cli
from solidtex_export.export.file_format.model_file import VERSION, ModelFile
from solidtex_export.export.fold import fold_lattice
from solidtex_export.export.training_result import TrainingResult, read_result
from solidtex_export.export.verification.model_output import check_output, summary, write_verified
from solidtex_export.export.verification.networks import Network, lattice_network, sampler_network
from solidtex_export.generators.build import Generator
from solidtex_export.generators.lattice import BaseLattice, ConvBlock, LatticeGenerator
from solidtex_export.generators.pyramid import PyramidGenerator, fold_pyramid
from solidtex_export.generators.sampler import OctaveSampler
from solidtex_export.training.result import counted

PROGRAM = "solidtex-export"
SCHEME = "solidtex-1"

EXAMPLES = f"""  {PROGRAM} results/granite -o granite.solidtex
  {PROGRAM} results/granite -o models/granite.solidtex --license Apache-2.0 --force
Then: solidtex-bake granite.solidtex --preview granite.png -o granite.npy"""


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, export)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(
        PROGRAM,
        "Export a result of solidtex-train: fold it in float64, write it, compare the C++ engine"
        " with the trained network. A file that differs is not written.",
        EXAMPLES,
    )
    p.add_argument("result", metavar="RESULT", type=Path, help="result folder of solidtex-train")
    cli.add_model_arguments(p)
    return p


def export(args: argparse.Namespace) -> cli.Document:
    check_output(args.output, args.force)
    result = read_result(args.result)
    if not result.finished:
        print(f"{args.result}: {unfinished(result)}", file=sys.stderr)
    model = build_model(result, args.name or args.output.stem, args.license)
    found = write_verified(args.output, model, unfolded_network(result))
    print(f"{cli.output_name(args)}: {summary(args.output, model, found)}")
    return cli.files(args.output)


def unfinished(result: TrainingResult) -> str:
    step = result.progress.get("step", 0)
    steps, minutes = result.config.get("steps"), result.config.get("minutes")
    seconds = result.progress.get("seconds", 0)
    is_trained = step >= steps if steps else seconds >= 60 * (minutes or math.inf)
    if is_trained and result.has_phases:
        return (
            f"the training is not finished, it stopped at step {step} before the fractions of its"
            " phases were held; repeat its command to hold them"
        )
    whole = ""
    if steps:
        whole = f" of {steps}"
    elif minutes:
        whole = f"; it was to take {counted(minutes, 'minutes')}"
    return (
        f"the training is not finished, it stopped at step {step}{whole}; repeat its command to"
        " finish it"
    )


def build_model(result: TrainingResult, name: str, license: str | None) -> ModelFile:
    """The folded model with its provenance."""
    architecture, tensors = _fold(result.generator)
    document = {
        "version": VERSION,
        "name": name,
        "family": result.family,
        "channels": result.channels,
        "color_space": result.color_space,
        "noise": {"scheme": SCHEME},
        result.family: architecture,
        "exemplar": exemplar_documents(result.config),
        "training": result.config | result.progress,
        **({"license": license} if license else {}),
    }
    return ModelFile(document, tensors)


def unfolded_network(result: TrainingResult) -> Network:
    """The trained network without folding."""
    generator = copy.deepcopy(result.generator)
    if isinstance(generator, BaseLattice):
        return lattice_network(generator, SCHEME)
    return sampler_network(generator, SCHEME)


def exemplar_documents(config: dict[str, Any]) -> dict[str, str] | list[dict[str, str]]:
    """One object for one photograph, a list for several; they share licence and source."""
    shared = {key: config[key] for key in ("license", "source") if config.get(key)}
    documents = [
        {"file": exemplar["file"], "sha256": exemplar["sha256"], **shared}
        for exemplar in config["exemplars"]
    ]
    return documents[0] if len(documents) == 1 else documents


def _fold_field(generator: LatticeGenerator) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    block = generator.get_submodule("cb1_1")
    assert isinstance(block, ConvBlock)
    return fold_lattice(generator.state_dict(), block.act.negative_slope, generator.softmax)


def _fold_sampler(network: OctaveSampler) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    tensors = {k: v.float().numpy() for k, v in network.effective_tensors().items()}
    sizes = {
        "octaves": len(tensors["transforms"]),
        "hidden_layers": len(network.hidden),
        "width": len(tensors["constant"]),
        "slope": network.hidden[0].negative_slope,
    }
    return sizes, tensors


_FOLDERS: dict[type, Callable[..., tuple[dict[str, Any], dict[str, np.ndarray]]]] = {
    LatticeGenerator: _fold_field,
    PyramidGenerator: fold_pyramid,
    OctaveSampler: _fold_sampler,
}


def _fold(generator: Generator) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The architecture's object of the document, and its tensors."""
    return _FOLDERS[type(generator)](generator)


if __name__ == "__main__":
    sys.exit(main())
