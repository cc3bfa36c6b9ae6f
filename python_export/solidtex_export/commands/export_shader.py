"""solidtex-export-shader: converts a `.solidtex` model to a function in a shading language."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from solidtex_export.commands import cli
from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.places import check_seed
from solidtex_export.export.shader.emitter import PRECISIONS, STORAGES, Storage
from solidtex_export.export.shader.lattice import lattice_program
from solidtex_export.export.shader.shader import BY_SUFFIX, Shader, function_name, shader
from solidtex_export.export.verification.model_output import OutputError, check_output
from solidtex_export.generators.regions import Box, alignment
from solidtex_export.whole_file import replacing, write_whole

PROGRAM = "solidtex-export-shader"
BRICK, MAX_BRICK = 32, 256
PASSES_VERSION = 1
LANGUAGES = ", ".join(f"{suffix} {emitter.language}" for suffix, emitter in BY_SUFFIX.items())

EXAMPLES = f"""  {PROGRAM} granite.solidtex -o granite.wgsl
  {PROGRAM} wood.solidtex -o wood.glsl --weights texture --precision half
docs/shader-export.md shows how programs call the function."""


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, export)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(
        PROGRAM,
        "Export a model for GPUs, for use without the library. A sampler becomes a function in a"
        " shading language, a lattice becomes compute passes in WGSL that fill a brick of voxels."
        " Weights that are not constants in the source are written beside it.",
        EXAMPLES,
    )
    cli.add_model_argument(p)
    p.add_argument("-o", dest="output", metavar="SHADER", type=Path, required=True,
                   help="the file to write, or for example -.glsl for standard output, with"
                   f" --weights constant; its suffix is that of a language: {LANGUAGES}"
                   )  # fmt: skip
    p.set_defaults(piped_suffix=".wgsl")
    p.add_argument("--force", action="store_true", help="replace existing files")
    p.add_argument("--weights", choices=STORAGES,
                   help="where the shader finds its weights: constants in the source, a storage"
                   " buffer (.weights.bin), or a texture (.weights.bin and .weights.exr); default:"
                   " texture for GLSL, else the first that the language has of buffer, texture and"
                   " constant")  # fmt: skip
    p.add_argument("--precision", choices=PRECISIONS, default="float",
                   help="stored weights; arithmetic is in float32 (default float)")  # fmt: skip
    p.add_argument("--size", type=int, metavar="N",
                   help="lattice family: voxels along each axis of the brick, a multiple of the"
                   f" model's coarsest voxel (default {BRICK})")  # fmt: skip
    p.add_argument("--seed", type=int, default=0, help="random seed of the solid (default 0)")
    return p


def export(args: argparse.Namespace) -> cli.Document:
    suffix = args.output.suffix
    if suffix not in BY_SUFFIX:
        raise OutputError(
            f"{args.output}: found the suffix {suffix!r}, expected one of {', '.join(BY_SUFFIX)}"
        )
    check_output(args.output, args.force, suffix)
    try:
        check_seed(args.seed)
    except ValueError as error:
        raise OutputError(f"--{error}") from error
    model = model_file.read(args.model)
    if model.document["family"] == "field":
        return _export_lattice(args, model)
    if args.size is not None:
        raise OutputError(
            f"--size: found {args.size} with {args.model}, a sampler, expected a model of the"
            " lattice family"
        )
    storage = _storage(args)
    why = f"--weights {storage}, which are files of their own, expected a file name"
    companions = _beside(args, _companions(storage), f"{why} (or --weights constant)")
    name = function_name(args.output)
    made = shader(model, suffix, name, storage, args.precision, args.seed)
    with _all_or_none(args.output, *companions):
        for path in companions:
            _write_data(path, made)
        write_whole(args.output, made.text.encode())
    print(f"{cli.output_name(args)}: function {name}, {len(made.text)} bytes of source")
    return cli.files(args.output, *companions)


def _export_lattice(args: argparse.Namespace, model: ModelFile) -> cli.Document:
    if args.output.suffix != ".wgsl" or args.weights not in (None, "buffer"):
        given = f" and --weights {args.weights}" if args.weights else ""
        raise OutputError(
            f"{args.output}: found a model of the lattice family with {args.output.suffix}{given},"
            " expected .wgsl and weights in a buffer: a lattice is exported as compute passes in"
            " WGSL"
        )
    if args.precision != "float":
        raise OutputError(f"--precision: found {args.precision}, expected float for a lattice")
    nodes = model.document["field"]["nodes"]
    size = BRICK if args.size is None else args.size
    if size % alignment(nodes) or not 0 < size <= MAX_BRICK:
        raise OutputError(
            f"--size: found {size}, expected a multiple of {alignment(nodes)}, the coarsest voxel,"
            f" up to {MAX_BRICK}"
        )
    why = "a lattice, whose weights and passes are files of their own, expected a file name"
    weights, listed = _beside(args, [".weights.bin", ".passes.json"], why)
    program = lattice_program(model, args.seed)
    passes = program.passes(Box((0, 0, 0), (size, size, size)))
    document = {
        "version": PASSES_VERSION,
        "name": model.document["name"],
        "channels": model.document["channels"],
        "color_space": model.document["color_space"],
        "size": size,
        "output": program.output,
        "passes": [p.document() for p in passes],
    }
    with _all_or_none(weights, listed, args.output):
        write_whole(weights, program.weights.tobytes())
        write_whole(listed, (json.dumps(document, indent=1) + "\n").encode())
        write_whole(args.output, program.source.encode())
    print(f"{args.output}: {len(passes)} compute passes for {size}^3 voxels, {weights}, {listed}")
    return cli.files(args.output, weights, listed)


@contextmanager
def _all_or_none(*paths: Path) -> Iterator[None]:
    """Where one file cannot be written, new ones are removed; older ones stay."""
    new = [path for path in paths if not path.exists()]
    try:
        yield
    except BaseException:
        for path in new:
            path.unlink(missing_ok=True)
        raise


def _beside(args: argparse.Namespace, suffixes: list[str], why: str) -> list[Path]:
    """Files beside the shader; there are none on standard output."""
    if suffixes and args.is_piped:
        raise OutputError(f"-o: found - with {why}")
    paths = [args.output.with_suffix(suffix) for suffix in suffixes]
    for path in paths:
        check_output(path, args.force, path.suffix)
    return paths


def _storage(args: argparse.Namespace) -> Storage:
    emitter = BY_SUFFIX[args.output.suffix]
    for option, given, allowed in (
        ("weights", args.weights, emitter.storages),
        ("precision", args.precision, emitter.precisions),
    ):
        if given is not None and given not in allowed:
            raise OutputError(
                f"--{option}: found {given} for {emitter.language}, expected"
                f" {' or '.join(allowed)}"
            )  # fmt: skip
    return args.weights or emitter.storages[0]


def _companions(storage: Storage) -> list[str]:
    return {
        "constant": [],
        "buffer": [".weights.bin"],
        "texture": [".weights.bin", ".weights.exr"],
    }[storage]


def _write_data(path: Path, made: Shader) -> None:
    data = made.data
    assert data is not None
    if path.suffix == ".exr":
        _write_exr(path, data)
        return
    write_whole(path, data.tobytes())
    if data.ndim == 2:
        print(f"{path}: storage buffer, {data.nbytes} bytes")
    else:
        kind = "RGBA16F" if data.dtype == np.float16 else "RGBA32F"
        size = f"{data.shape[1]} x {data.shape[0]}"
        print(f"{path}: texture of {size} texels, {kind}, {data.nbytes} bytes")


def _write_exr(path: Path, texels: np.ndarray) -> None:
    rows, columns, channels = texels.shape
    kind = oiio.HALF if texels.dtype == np.float16 else oiio.FLOAT
    spec = oiio.ImageSpec(columns, rows, channels, kind)
    spec.attribute("compression", "zip")
    with replacing(path) as temporary:
        out = oiio.ImageOutput.create(str(temporary))
        if not (out and out.open(str(temporary), spec) and out.write_image(texels) and out.close()):
            raise OutputError(f"{path}: cannot be written: {oiio.geterror()}")
        # OpenEXR keeps quiet about a write that fails while its file is closed.
        written = oiio.ImageBuf(str(temporary)).get_pixels(kind)
        if written is None or not np.array_equal(written, texels):
            raise OutputError(f"{path}: cannot be written: it reads back damaged")


if __name__ == "__main__":
    sys.exit(main())
