"""The command line of solidtex-train."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import torch

from solidtex_export.analysis.choice import LATTICE, SAMPLER
from solidtex_export.commands import cli
from solidtex_export.commands.default_start import NO_SPACE, SHORT_MINUTES, SPACE, default_start
from solidtex_export.images.channels import check_map_name
from solidtex_export.images.estimates import METHODS, write_estimates
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.spaces.start import learned_start, space_start
from solidtex_export.training.presets import PresetError, load_recipe, shipped
from solidtex_export.training.resolve import DEFAULT_SIZE, Request, smallest_size, uses_learned
from solidtex_export.training.start import StartSource

DEFAULT_MINUTES = 15.0

EXAMPLES = """  solidtex-train granite.jpg -o results/granite
  solidtex-train plank.png --directions xy -o results/plank
  solidtex-train granite.jpg --preset lattice -o results/granite
  solidtex-train wall.jpg --crop 0,200,1500,1500 --resolution 256 --minutes 30 -o results/wall
  solidtex-train granite.jpg --space stones.solidtex-space --minutes 1 -o results/granite
  solidtex-train front.png side.png top.png -o results/cube
  solidtex-train granite.jpg --preset gutierrez --features vgg19.pth -o results/granite
  solidtex-train granite.jpg --descriptor results/descriptor/weights.safetensors -o results/granite
  solidtex-train photo.jpg --estimate height,roughness -o results/plaster
  solidtex-train labels.tif --phases --phase-names pore,grain -o results/sandstone
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
    p.add_argument("photos", metavar="PHOTO", nargs="+", type=Path, help="one to three images")
    p.add_argument("-o", dest="result", metavar="RESULT", required=True, type=Path,
                   help="result folder, new or of the same training")  # fmt: skip
    p.add_argument("--map", dest="maps", metavar="NAME=FILE", action="append", default=[],
                   type=named_file,
                   help="further channel of the photograph with the same number of pixels:"
                   " roughness, height ...; one per photograph, in order")  # fmt: skip
    p.add_argument("--estimate", metavar="NAME,...", type=estimated_names, default=[],
                   help=f"estimate maps from the photograph: {' or '.join(METHODS)}, or both;"
                   " guesses without a unit, whose files are in RESULT-estimates")  # fmt: skip
    cli.add_reading_arguments(p)
    p.add_argument("--color-space", choices=("srgb", "linear"), default="srgb",
                   help="encoding of the learned and stored colors; EXR and float TIFF are read as"
                   " linear, others as sRGB (default: srgb, whose differences are closer to"
                   " perception)")  # fmt: skip
    p.add_argument("--phases", action="store_true",
                   help="the images are labels of phases (0 and 1, 0 and 255, 0 to k): learn the"
                   " probability of each phase, with sharp borders and the fractions of the images"
                   )  # fmt: skip
    p.add_argument("--phase-names", metavar="NAMES", default="",
                   help="names of the phases in the order of their labels, such as pore,grain"
                   " (default: the labels)")  # fmt: skip
    p.add_argument("--preset", "--method", metavar="NAME",
                   help=f"one of {', '.join(shipped())}, or a TOML file (default: {LATTICE}"
                   f" or {SAMPLER}, chosen by the photograph; {LATTICE} with --set)")  # fmt: skip
    p.add_argument("--set", dest="settings", metavar="KEY=VALUE", action="append", default=[],
                   help="change one key of the preset, for example optimizer.learning_rate=0.01 or"
                   " losses.wavelets.weight=2")  # fmt: skip
    start = p.add_mutually_exclusive_group()
    start.add_argument("--space", type=Path, metavar="SPACE",
                       help="start from the photograph's code in a texture space: a shipped"
                       " name, a .solidtex-space file, or a result of solidtex-train-space;"
                       f" none: random weights (default: {SPACE}, if --minutes is at most"
                       f" {SHORT_MINUTES:g} and all else is left to solidtex, otherwise none)"
                       )  # fmt: skip
    start.add_argument("--start", type=Path, metavar="START",
                       help="start from learned weights: a .solidtex-start file, or a result"
                       " of solidtex-train-space --preset start-lattice")  # fmt: skip
    p.add_argument("--features", "--vgg", type=Path, metavar="FILE",
                   help="weights of VGG-19, torchvision's or those of Gatys et al., or of"
                   ' SqueezeNet v1.0, for presets with descriptor = "features" (default: the'
                   " built-in descriptor instead)")  # fmt: skip
    p.add_argument("--descriptor", type=Path, metavar="FILE",
                   help="weights.safetensors of solidtex-pretrain-descriptor, for presets that"
                   ' use descriptor = "learned", or "features" without --features (default: the'
                   " shipped weights)")  # fmt: skip
    p.add_argument("--size", type=int, metavar="N",
                   help="side of the slices compared with the photograph, in texels"
                   f" (default: the preset's or {DEFAULT_SIZE}, or the side of a smaller"
                   " photograph)")  # fmt: skip
    p.add_argument("--resolution", type=int, metavar="N",
                   help="reduce photographs whose shorter side is longer than N pixels; one pixel"
                   " is then one texel (default: 2 times --size, or the space's)")  # fmt: skip
    p.add_argument("--crop", type=rectangle, metavar="X,Y,W,H",
                   help="use only this rectangle of each photograph, in pixels")  # fmt: skip
    p.add_argument("--directions", choices=("xyz", "xy", "xz", "yz", "x", "y", "z"),
                   help="normals of the slices that are compared with a photograph"
                   " (default: xyz, with two photographs xy)")  # fmt: skip
    p.add_argument("--symmetry", choices=("all", "flips", "none"),
                   help="orientations in which a photograph looks equally right (default: measured"
                   " for a lattice; otherwise all for one photograph in three directions, flips"
                   " for others)")  # fmt: skip
    p.add_argument("--minutes", type=float, metavar="M",
                   help="training time (default: 15)")  # fmt: skip
    p.add_argument("--clock", choices=("wall", "processor"), default="wall",
                   help="processor: --minutes of processor time, summed over the threads, for"
                   " comparisons on a busy machine (default: wall)")  # fmt: skip
    p.add_argument("--steps", type=int, metavar="N", help="train N steps instead of --minutes")
    p.add_argument("--seed", type=int, default=0, metavar="S", help="random seed (default: 0)")
    p.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto",
                   help="auto: CUDA if there is a device (default: auto)")  # fmt: skip
    p.add_argument("--compile", action="store_true",
                   help="compile the generator with torch.compile; starts more slowly")  # fmt: skip
    p.add_argument("--threads", type=int, metavar="T", help="CPU threads (default: torch's)")
    p.add_argument("--license", default="", metavar="TEXT",
                   help="license of the photographs, stored with the model")  # fmt: skip
    p.add_argument("--source", default="", metavar="TEXT",
                   help="source of the photographs, stored with the model")  # fmt: skip
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


def estimated_names(text: str) -> list[str]:
    names = text.split(",")
    if not set(names) <= set(METHODS) or len(set(names)) < len(names):
        raise argparse.ArgumentTypeError(
            f"found {text}, expected {' or '.join(METHODS)}, or both with a comma"
        )
    return names


def maps_of_photographs(
    p: argparse.ArgumentParser, args: argparse.Namespace
) -> tuple[dict[str, Path], ...]:
    """Maps of each photograph, by name."""
    files: dict[str, list[Path]] = {}
    for name, file in args.maps:
        files.setdefault(name, []).append(file)
    for name, found in files.items():
        if len(found) != len(args.photos):
            p.error(
                f"--map: found {len(found)} files for {name}, expected {len(args.photos)}, one for"
                " each photograph"
            )
    return tuple({name: f[i] for name, f in files.items()} for i in range(len(args.photos)))


def with_estimates(
    p: argparse.ArgumentParser, args: argparse.Namespace, given: tuple[dict[str, Path], ...]
) -> tuple[dict[str, Path], ...]:
    """The given maps of each photograph, and those of --estimate beside the result."""
    if not args.estimate:
        return given
    for name in args.estimate:
        if name in given[0]:
            p.error(f"--estimate: found {name}, expected none that --map gives")
    folder = args.result.parent / f"{args.result.name}-estimates"
    reading = cli.reading_of(args)
    return tuple(
        maps | write_estimates(photo, args.estimate, folder, reading)
        for photo, maps in zip(args.photos, given, strict=True)
    )


def request_of(p: argparse.ArgumentParser, args: argparse.Namespace) -> Request:
    """Convert the options to a request; refuses invalid combinations."""
    check_numbers(p, args)
    check_phases(p, args)
    start = start_of(p, args)
    default = start.directions if start else "xy" if len(args.photos) == 2 else "xyz"
    directions = args.directions or default
    if len(args.photos) not in (1, len(directions)):
        p.error(
            f"--directions: found {len(directions)} ({directions}) for {len(args.photos)}"
            " photographs, expected one direction for each"
        )
    request = Request(
        photos=tuple(args.photos),
        directions=directions,
        maps=with_estimates(p, args, maps_of_photographs(p, args)),
        estimated=tuple(args.estimate),
        preset=args.preset,
        overrides=tuple(args.settings),
        size=args.size,
        resolution=args.resolution,
        crop=args.crop,
        symmetry=args.symmetry,
        seed=args.seed,
        minutes=DEFAULT_MINUTES if args.minutes is args.steps is None else args.minutes,
        clock=args.clock,
        steps=args.steps,
        color_space=args.color_space,
        reading=cli.reading_of(args),
        license=args.license,
        source=args.source,
        features=args.features,
        descriptor=args.descriptor,
        start=start,
        phases=args.phases,
        phase_names=tuple(args.phase_names.split(",")) if args.phase_names else (),
    )
    if args.space is args.start is None:
        request = replace(request, start=default_start(request, args.result))
    try:
        check_preset(p, request)
    except PresetError as error:
        p.error(str(error))
    return request


def start_of(p: argparse.ArgumentParser, args: argparse.Namespace) -> StartSource | None:
    """Open the texture space or the learned start."""
    if args.start is None and (args.space is None or args.space == NO_SPACE):
        return None
    option = "--space" if args.space else "--start"
    if len(args.photos) != 1:
        p.error(f"{option}: found {len(args.photos)} photographs, expected one")
    if args.maps:
        p.error(f"{option}: found --map {args.maps[0][0]}, expected none: it has colors only")
    if args.estimate:
        p.error(f"{option}: found --estimate, expected none: it has colors only")
    if args.color_space != "srgb":
        p.error(f"{option}: found --color-space {args.color_space}, expected srgb")
    return space_start(args.space) if args.space else learned_start(args.start)


def check_preset(p: argparse.ArgumentParser, request: Request) -> None:
    recipe = load_recipe(request.name, list(request.overrides))
    if request.features is not None and not recipe.uses("features"):
        p.error(
            f"--features: found a file for preset {request.name}, expected one with"
            ' descriptor = "features"'
        )
    if request.descriptor is not None and not uses_learned(recipe, request.features):
        p.error(
            f"--descriptor: found a file for preset {request.name}, expected one with"
            ' descriptor = "learned", or "features" without --features'
        )
    needed = smallest_size(request)
    if request.size is not None and request.size < needed:
        p.error(
            f"--size: found {request.size}, expected at least {needed}, the smallest slice for the"
            f" losses of preset {request.name}"
        )
    least = request.size or needed
    if request.resolution is not None and request.resolution < least:
        p.error(f"--resolution: found {request.resolution}, expected at least --size = {least}")


def check_phases(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    if args.phase_names and not args.phases:
        p.error("--phase-names: found without --phases, expected both")
    others = {
        "--map": args.maps,
        "--estimate": args.estimate,
        "--range": args.ranges,
        "--layer": args.layer,
        "--color-space": args.color_space != "srgb",
        "--space": args.space,
        "--start": args.start,
        "--features": args.features,
    }
    for option, value in others.items():
        if args.phases and value:
            p.error(f"--phases: found together with {option}, expected only one of them")


def check_numbers(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    if len(args.photos) > 3:
        p.error(f"PHOTO: found {len(args.photos)}, expected 1 to 3")
    if args.minutes is not None and args.steps is not None:
        p.error("--steps: found together with --minutes, expected one of them")
    if args.minutes is not None and not 0 < args.minutes < 1e6:
        p.error(f"--minutes: found {args.minutes}, expected more than 0")
    for option in ("steps", "threads"):
        value = getattr(args, option)
        if value is not None and value < 1:
            p.error(f"--{option}: found {value}, expected at least 1")
    if not 0 <= args.seed < 2**64:
        p.error(f"--seed: found {args.seed}, expected 0 to 2**64 - 1")
    if args.device == "cuda" and not torch.cuda.is_available():
        p.error("--device: found no CUDA device, expected one (or use --device cpu)")
