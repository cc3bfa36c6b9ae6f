"""The command line of solidtex-train."""

from __future__ import annotations

import argparse
from pathlib import Path

import torch

from solidtex_export.analysis.choice import LATTICE, SAMPLER
from solidtex_export.commands import cli
from solidtex_export.images.channels import check_map_name
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.losses.descriptor.weights import SHIPPED
from solidtex_export.training.preset import Method
from solidtex_export.training.preset_file import MethodError, load_method, shipped

DEFAULT_MINUTES = 15.0
DEFAULT_SIZE = 128  # texels
SMALLEST_SIZE = 32  # texels

EXAMPLES = """  solidtex-train granite.jpg -o results/granite
  solidtex-train plank.png --directions xy -o results/plank
  solidtex-train granite.jpg --method lattice -o results/granite
  solidtex-train wall.jpg --crop 0,200,1500,1500 --resolution 256 --minutes 30 -o results/wall
  solidtex-train front.png side.png top.png -o results/cube
  solidtex-train granite.jpg --method gutierrez --vgg vgg19.pth --set slicing.passes=1 -o results/g
  solidtex-train granite.jpg --descriptor results/descriptor/weights.safetensors -o results/granite
  solidtex-train albedo.png --map roughness=rough.png --map height=height.tif -o results/rust

The same command again resumes an interrupted training. Ctrl-C saves before it stops.
One photograph serves all directions; two or three are compared with one direction each, in order.
A slice normal to x shows y to the right and z upwards, normal to y: x and z, normal to z: x and y.
So for wood use --directions xy and a photograph with vertical grain: the grain runs along z.
Then: solidtex-export RESULT -o MODEL.solidtex"""


def parser() -> argparse.ArgumentParser:
    p = cli.parser(
        "solidtex-train", "Learn a solid texture from one, two or three photographs.", EXAMPLES
    )
    p.add_argument("photos", metavar="PHOTO", nargs="+", type=Path, help="one to three pictures")
    p.add_argument("-o", dest="result", metavar="RESULT", required=True, type=Path,
                   help="result folder, new or of the same training")  # fmt: skip
    p.add_argument("--map", dest="maps", metavar="NAME=FILE", action="append", default=[],
                   type=named_file,
                   help="a further channel of the photograph, of as many pixels: roughness, height"
                   " ...; with several photographs once for each, in order")  # fmt: skip
    cli.add_reading_arguments(p)
    p.add_argument("--color-space", choices=("srgb", "linear"), default="srgb",
                   help="encoding of the colours that are learned and stored; files are converted,"
                   " EXR and float TIFF from linear, others from sRGB (default: srgb, whose"
                   " differences are closer to the eye's)")  # fmt: skip
    p.add_argument("--method", metavar="NAME",
                   help=f"one of {', '.join(shipped())}, or a TOML file of yours like"
                   f" theirs (default: {LATTICE} for what has outlines and where keys are --set,"
                   f" {SAMPLER} for one photograph of grains or fibres)")  # fmt: skip
    p.add_argument("--set", dest="settings", metavar="KEY=VALUE", action="append", default=[],
                   help="change one key of the method, for example optimiser.learning_rate=0.01 or"
                   " losses.0.weight=2")  # fmt: skip
    p.add_argument("--vgg", type=Path, metavar="FILE",
                   help="weights of VGG-19, torchvision's or those of Gatys et al., for methods"
                   " that use it; without them our own descriptor takes its place")  # fmt: skip
    p.add_argument("--descriptor", type=Path, metavar="FILE",
                   help="weights.safetensors of solidtex-pretrain-descriptor, for methods that"
                   ' say descriptor = "learned", or "vgg" without --vgg (default: the shipped'
                   " weights)")  # fmt: skip
    p.add_argument("--size", type=int, metavar="N",
                   help="side of the slices compared with the photograph, in texels"
                   f" (default: {DEFAULT_SIZE}, of smaller photographs all)")  # fmt: skip
    p.add_argument("--resolution", type=int, metavar="N",
                   help="reduce photographs whose shorter side is longer than N pixels; one pixel"
                   " is then one texel (default: 2 times --size)")  # fmt: skip
    p.add_argument("--crop", type=rectangle, metavar="X,Y,W,H",
                   help="use only this rectangle of each photograph, in its pixels")  # fmt: skip
    p.add_argument("--directions", choices=("xyz", "xy", "xz", "yz", "x", "y", "z"),
                   help="normals of the slices that must look like a photograph"
                   " (default: xyz, with two photographs xy)")  # fmt: skip
    p.add_argument("--symmetry", choices=("all", "flips", "none"),
                   help="orientations in which a photograph looks just as right (default: all for"
                   " one photograph in three directions, else flips; fewer for a lattice where"
                   " the photograph differs from itself flipped or turned)")  # fmt: skip
    p.add_argument("--minutes", type=float, metavar="M",
                   help="how long to train (default: 15)")  # fmt: skip
    p.add_argument("--steps", type=int, metavar="N", help="train N steps instead of --minutes")
    p.add_argument("--seed", type=int, default=0, metavar="S", help="(default: 0)")
    p.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto",
                   help="auto takes CUDA where there is one (default: auto)")  # fmt: skip
    p.add_argument("--compile", action="store_true",
                   help="compile the generator with torch.compile: slower to start")  # fmt: skip
    p.add_argument("--threads", type=int, metavar="T", help="CPU threads (default: torch's)")
    p.add_argument("--license", default="", metavar="TEXT",
                   help="licence of the photographs, stored with the model")  # fmt: skip
    p.add_argument("--source", default="", metavar="TEXT",
                   help="where the photographs come from, stored with the model")  # fmt: skip
    return p


def rectangle(text: str) -> tuple[int, ...]:
    values = tuple(int(v) for v in text.split(","))
    if len(values) != 4 or min(values[2:]) < 1:
        raise argparse.ArgumentTypeError(f"found {text}, expected X,Y,W,H, for example 0,0,256,256")
    return values


def named_file(text: str) -> tuple[str, Path]:
    name, equals, file = text.partition("=")
    if not equals or not file:
        raise argparse.ArgumentTypeError(
            f"found {text}, expected NAME=FILE, for example roughness=rough.png"
        )
    try:
        check_map_name(name)
    except ExemplarError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return name, Path(file)


def maps_of_photographs(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    """args.maps becomes a list with the maps of each photograph, by name."""
    files: dict[str, list[Path]] = {}
    for name, file in args.maps:
        files.setdefault(name, []).append(file)
    for name, found in files.items():
        if len(found) != len(args.photos):
            p.error(
                f"--map: found {len(found)} files for {name}, expected {len(args.photos)}, one for"
                " each photograph"
            )
    args.maps = [{name: f[i] for name, f in files.items()} for i in range(len(args.photos))]


def method_of(p: argparse.ArgumentParser, args: argparse.Namespace) -> Method:
    """The method, with what --set changes in it."""
    try:
        method = load_method(args.method, args.settings)
    except MethodError as error:
        p.error(str(error))
    if args.vgg is not None and not method.uses("vgg"):
        p.error(f"--vgg: found a file for method {args.method}, expected one that uses VGG-19")
    learned = method.uses("learned") or (method.uses("vgg") and args.vgg is None)
    if args.descriptor is not None and not learned:
        p.error(
            f"--descriptor: found a file for method {args.method}, expected one with"
            ' descriptor = "learned", or "vgg" without --vgg'
        )
    if args.descriptor is None and learned:
        args.descriptor = SHIPPED
    return method


def smallest_size(method: Method) -> int:
    """Side of the smallest slice that every loss of the method can judge, in texels."""
    return max(SMALLEST_SIZE, method.smallest_judged)


def check(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    """Fill in what depends on other options, and refuse what cannot work."""
    if len(args.photos) > 3:
        p.error(f"PHOTO: found {len(args.photos)}, expected 1 to 3")
    maps_of_photographs(p, args)
    if args.directions is None:
        args.directions = "xy" if len(args.photos) == 2 else "xyz"
    if len(args.photos) not in (1, len(args.directions)):
        p.error(
            f"--directions: found {len(args.directions)} ({args.directions}) for"
            f" {len(args.photos)} photographs, expected one direction for each"
        )
    unsaid = args.method is None and not args.settings
    args.choose = unsaid and len(args.photos) == 1 and args.directions in ("xyz", "xy")
    args.method = args.method or LATTICE
    args.settings = method_of(p, args)
    needed = smallest_size(args.settings)
    if args.size is not None and args.size < needed:
        p.error(f"--size: found {args.size}, expected at least {needed}")
    least = args.size or needed
    if args.resolution is not None and args.resolution < least:
        p.error(f"--resolution: found {args.resolution}, expected at least --size = {least}")
    if args.minutes is not None and args.steps is not None:
        p.error("--steps: found together with --minutes, expected one of them")
    if args.minutes is not None and not 0 < args.minutes < 1e6:
        p.error(f"--minutes: found {args.minutes}, expected more than 0")
    if args.steps is not None and args.steps < 1:
        p.error(f"--steps: found {args.steps}, expected at least 1")
    if args.threads is not None and args.threads < 1:
        p.error(f"--threads: found {args.threads}, expected at least 1")
    if args.minutes is None and args.steps is None:
        args.minutes = DEFAULT_MINUTES
    if args.device == "cuda" and not torch.cuda.is_available():
        p.error("--device: found no CUDA device, expected one (or use --device cpu)")
