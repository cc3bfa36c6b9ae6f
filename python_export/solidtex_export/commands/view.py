"""solidtex-view: writes a page that shows models in the browser."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from solidtex_export.commands import cli
from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification.model_output import OutputError, check_output
from solidtex_export.export.view.page import (
    MIME_TYPES,
    Material,
    distinct_names,
    package_folder,
    page,
)
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.photographs import read_picture
from solidtex_export.whole_file import write_whole

PROGRAM = "solidtex-view"
EXAMPLES = f"""  {PROGRAM} granite.solidtex -o granite.html
  {PROGRAM} stone-grey wood-oak --exemplar stone.jpg oak.jpg -o materials.html
docs/view.md describes the page."""


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, write, (*cli.FAILURES, ExemplarError))


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(
        PROGRAM,
        "Write one self-contained page that evaluates models in the browser,"
        " with WebGPU, WebGL 2 or WebAssembly, on a cube, a sphere, a knot, a rabbit and meshes of"
        " the viewer's own.",
        EXAMPLES,
    )
    cli.add_model_argument(p, "models", nargs="+")
    p.add_argument("--exemplar", metavar="IMAGE", type=Path, nargs="+", default=[],
                   help="photographs (.jpg, .png) to show beside the models, in order")  # fmt: skip
    p.add_argument("--wasm", metavar="FOLDER", type=Path,
                   help="folder of the npm package, whose engine draws in browsers without WebGPU"
                        " and WebGL 2, or none (default: build/wasm/package of the checkout where"
                        " that is built)")  # fmt: skip
    cli.add_output_arguments(p, "PAGE", ".html")
    return p


def write(args: argparse.Namespace) -> cli.Document:
    check_output(args.output, args.force, ".html")
    exemplars = args.exemplar
    if len(exemplars) > len(args.models):
        raise OutputError(
            f"--exemplar: found {len(exemplars)} images, expected at most {len(args.models)},"
            " one for each model"
        )
    for path in exemplars:
        if path.suffix.lower() not in MIME_TYPES:
            raise OutputError(f"{path}: found {path.suffix!r}, expected .jpg or .png")
        read_picture(path)  # a browser says nothing of a damaged one
    padded = [*exemplars, *[None] * (len(args.models) - len(exemplars))]
    materials = [
        Material(model_file.read(model), exemplar)
        for model, exemplar in zip(args.models, padded, strict=True)
    ]
    names = [material.model.document["name"] for material in materials]
    for name, shown in zip(names, distinct_names(names), strict=True):
        if shown != name:
            cli.say(f"{PROGRAM}: found another model named {name}: the page shows it as {shown}")
    package = None if args.wasm == Path("none") else package_folder(args.wasm)
    text = page(materials, package)
    write_whole(args.output, text.encode())
    models = "1 model" if len(materials) == 1 else f"{len(materials)} models"
    fallback = "with WebAssembly" if package else "without WebAssembly"
    print(f"{cli.output_name(args)}: {models}, {fallback}, {len(text.encode())} bytes")
    return cli.files(args.output)


if __name__ == "__main__":
    sys.exit(main())
