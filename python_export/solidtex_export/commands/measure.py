"""solidtex-measure: geometry, transport and representative volumes of a solid or a volume."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from solidtex_export.commands import cli
from solidtex_export.export.verification.model_output import OutputError, check_output
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.measuring.models import is_model, read_model
from solidtex_export.measuring.volumes import Volume, read_volume
from solidtex_export.measuring.voxels import METERS, VolumeError, VoxelSize, parse_voxel_size
from solidtex_export.whole_file import write_whole

PROGRAM = "solidtex-measure"
TRANSPORT = ("diffusivity", "permeability")

EXAMPLES = f"""  {PROGRAM} rock.tif --voxel-size 2.25um -o report.html
  {PROGRAM} rock.npy --voxel-size 5.345um --axes x -o report.json
  {PROGRAM} rock.solidtex --size 200 --voxel-size 2.25um --exemplar section.png -o report.html
  {PROGRAM} results/rocks --material berea --size 200 --voxel-size 5.345um -o report.html
  {PROGRAM} gray.tif --voxel-size 2.25um --threshold 112 --phase 0 -o report.html

Conventions, units and accuracy: docs/porous-media.md."""


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(
        PROGRAM,
        "Measure a volume: fractions, specific surface, Euler characteristic, mean breadth,"
        " two-point correlation, chords, pore sizes, connectivity, diffusivity, permeability and"
        " representative volumes.",
        EXAMPLES,
    )
    p.add_argument("volume", metavar="VOLUME", type=Path,
                   help="TIFF stack, .npy [x, y, z], .nrrd, .nhdr, .vti, .zarr, a .solidtex file or"
                   " a shipped model's name; with --material a texture space or the result of an"
                   " Alanov preset")  # fmt: skip
    p.add_argument("--material", metavar="NAME",
                   help="the training photograph of a texture space, or the material of a result,"
                   " whose solid is measured")  # fmt: skip
    p.add_argument("--voxel-size", metavar="LENGTH", type=str,
                   help=f"edge of a voxel with its unit ({', '.join(METERS)}), such as 2.25um;"
                   " voxels are cubes (default: the file's)")  # fmt: skip
    p.add_argument("-o", dest="outputs", metavar="REPORT", type=Path, action="append",
                   default=[], help="the .html or .json file to write; may be repeated; needed"
                   " without --json"
                   )  # fmt: skip
    p.add_argument("--force", action="store_true", help="replace files that exist")
    p.add_argument("--threshold", metavar="T", type=float,
                   help="split gray values: label 0 is below T, label 1 the rest (default: up to"
                   " 8 integers are labels, other values are split by Otsu's method)")  # fmt: skip
    p.add_argument("--phase", metavar="LABEL", type=int,
                   help="the phase that conducts, the pores (default: the lowest label)"
                   )  # fmt: skip
    p.add_argument("--boundary", choices=("open", "periodic"), default="open",
                   help="open: flow from face to face, the other faces sealed; periodic: the volume"
                   " repeats (default: open)")  # fmt: skip
    p.add_argument("--refine", type=int, choices=(1, 2, 3), default=1, metavar="N",
                   help="split voxels into N^3 for permeability: the flow between cubes with sharp"
                   " edges, below that between smooth walls (default: 1)")  # fmt: skip
    p.add_argument("--axes", metavar="AXES", default="xyz",
                   help="axes of transport, such as x or xz (default: xyz)")  # fmt: skip
    p.add_argument("--without", metavar="PART", action="append", default=[],
                   choices=(*TRANSPORT, "pore-sizes"),
                   help="leave out diffusivity, permeability or pore-sizes; may be repeated"
                   )  # fmt: skip
    p.add_argument("--representative", choices=("geometry", "transport", "none"),
                   default="geometry",
                   help="figures of smaller cubes: geometry, or transport along the first axis too"
                   " (default: geometry)")  # fmt: skip
    p.add_argument("--exemplar", metavar="PICTURE", type=Path,
                   help="picture of the material whose figures stand beside: with a model that was"
                   " trained on it, cropped and reduced as for the training, else with pixels as"
                   " large as the voxels")  # fmt: skip
    p.add_argument("--across", choices=("x", "y", "z"),
                   help="the axis that --exemplar is a section across (default: as in the training"
                   " of the model, else z)")  # fmt: skip
    p.add_argument("--size", type=int, default=128, metavar="N",
                   help="edge of a model's cube in voxels (default: 128)")  # fmt: skip
    p.add_argument("--seed", type=int, default=0, metavar="S", help="random seed of a model")
    p.add_argument("--periodic", action="store_true",
                   help="let opposite faces of a model's cube meet; implies --boundary periodic"
                   )  # fmt: skip
    return p


def check(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    if not args.axes or set(args.axes) - set("xyz") or len(set(args.axes)) < len(args.axes):
        p.error(f"--axes: found {args.axes!r}, expected letters of xyz, each once")
    if args.size < 2:
        p.error(f"--size: found {args.size}, expected at least 2")
    if args.across and not args.exemplar:
        p.error("--across: found no --exemplar, expected the picture that is a section")
    if args.periodic:
        args.boundary = "periodic"
    if not args.outputs and not args.json:
        p.error("-o: found none, expected a report, or --json")
    for path in args.outputs:
        if path.suffix not in (".html", ".json"):
            p.error(f"-o: found {path}, expected a name that ends in .html or .json")


def run(args: argparse.Namespace) -> cli.Document:
    with cli.optional_packages(PROGRAM, "measure"):
        import jinja2  # noqa: F401
        import matplotlib  # noqa: F401
        import nrrd  # noqa: F401
        import tifffile  # noqa: F401
    from solidtex_export.commands.measure_material import model_of

    for path in args.outputs:
        check_output(path, args.force, path.suffix)
    with model_of(args.volume, args.material) as source:
        return _measure(args, source)


def _measure(args: argparse.Namespace, source: Path) -> cli.Document:
    """Measure `source`: the volume, or the model of its material."""
    from solidtex_export.commands.measure_exemplar import read_exemplar
    from solidtex_export.measuring.measure import Settings, measure_volume
    from solidtex_export.measuring.phases import find_phases
    from solidtex_export.measuring.section import measure_section

    given = parse_voxel_size(args.voxel_size) if args.voxel_size else None
    volume = _read(args, source)
    voxel_size = given or _own_voxel_size(args.volume, volume)
    phases = find_phases(volume.values, args.threshold, args.volume.name, volume.phases)
    settings = Settings(
        voxel_size,
        args.phase,
        args.boundary,
        args.axes,
        tuple(part for part in TRANSPORT if part not in args.without),
        "pore-sizes" not in args.without,
        args.refine,
        args.representative,
    )
    notes = _notes(volume, voxel_size, given is not None, phases.notes)
    document: dict[str, Any] = {"file": args.volume.name, "model": volume.model, "notes": notes}
    if args.exemplar:  # first: one that does not fit is refused before hours of flow
        section, note = read_exemplar(args.exemplar, source, voxel_size, args.across)
        notes.append(note)
    for text in notes:
        print(text, file=sys.stderr)
    if args.exemplar:
        document["exemplar"] = measure_section(section, args.threshold, settings, phases)
        print(document["exemplar"]["note"], file=sys.stderr)
    document |= measure_volume(phases, settings, lambda text: print(text, file=sys.stderr))
    print(summary(document))
    middle = [np.take(phases.labels, n // 2, axis) for axis, n in enumerate(phases.labels.shape)]
    for path in args.outputs:
        write_whole(path, _text(path, document, middle).encode())
        print(path)
    return document | cli.files(*args.outputs)


def _read(args: argparse.Namespace, source: Path) -> Volume:
    if is_model(source):
        return read_model(source, args.size, args.seed, args.size if args.periodic else 0)
    if args.periodic:
        raise VolumeError(
            f"--periodic: found the volume {source}, expected a model; --boundary periodic repeats"
            " volumes"
        )
    return read_volume(source)


def _own_voxel_size(path: Path, volume: Volume) -> VoxelSize:
    if volume.voxel is None:
        raise VolumeError(
            f"{path}: found no voxel size in the file, expected --voxel-size LENGTH, such as"
            " 2.25um: without it surface and permeability have no units"
        )
    return volume.voxel.cubic(str(path))


def _notes(volume: Volume, size: VoxelSize, is_given: bool, more: list[str]) -> list[str]:
    notes = [*volume.notes, *more]
    if is_given and volume.voxel and str(volume.voxel) != str(size):
        notes.append(f"voxel size: {size} as given, the file says {volume.voxel}")
    elif not is_given:
        notes.append(f"voxel size: {size}, as the file says")
        if volume.voxel and volume.voxel.is_z_assumed:
            notes.append("voxel size: the file says nothing of z: taken as x")
    return notes


def _text(path: Path, document: dict[str, Any], middle: list[Any]) -> str:
    if path.suffix == ".json":
        return json.dumps(document, indent=1) + "\n"
    from solidtex_export.measuring.report import render

    return render(document, middle)


def summary(document: dict[str, Any]) -> str:
    """Fractions, those of the picture, and one line an axis."""
    titles = document["phase_titles"]
    phase = f"phase {titles[str(document['phase'])]}"
    lines = [
        f"phases  {_fractions(document['phases'], titles)}",
        "   ± is the deviation expected among volumes of this size (integral range)",
    ]
    if "exemplar" in document:
        lines += _beside_picture(document, phase)
    for name, axis in document["axes"].items():
        parts = [f"{axis['conducting_fraction']:.1%} of {phase} conducts"]
        if axis.get("formation_factor"):
            parts.append(f"formation factor {axis['formation_factor']:.4g}")
            parts.append(f"tortuosity {axis['tortuosity']:.4g}")
        if "permeability_mD" in axis:
            parts.append(f"permeability {axis['permeability_mD']:.4g} mD")
        lines.append(f"{name}  " + ", ".join(parts))
        lines += [f"   {text}" for text in [axis["reason"], *axis["warnings"]] if text]
    return "\n".join(lines)


def _fractions(phases: dict[str, Any], titles: dict[str, str]) -> str:
    return ", ".join(
        f"{titles[label]}: {figures['fraction']:.2%} ± {figures['fraction_deviation']:.2%}"
        for label, figures in phases.items()
    )


def _beside_picture(document: dict[str, Any], phase: str) -> list[str]:
    """The picture's fractions; further figures of the solid beside the picture's."""
    from solidtex_export.measuring.report import compared

    picture = document["exemplar"]
    lines = [f"picture  {_fractions(picture['phases'], document['phase_titles'])}"]
    for name, *figures in compared(document):
        ours, theirs = ("none" if value is None else f"{value:.4g}" for value in figures)
        lines.append(f"   {name} of {phase}: {ours}, picture {theirs}")
    return lines


def main(arguments: list[str] | None = None) -> int:
    p = make_parser()

    def work(args: argparse.Namespace) -> cli.Document:
        check(p, args)
        return run(args)

    return cli.run(p, arguments, work, (*cli.FAILURES, VolumeError, OutputError, ExemplarError))


if __name__ == "__main__":
    sys.exit(main())
