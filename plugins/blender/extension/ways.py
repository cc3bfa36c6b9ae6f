"""The ways to show a solid texture in Blender. Each yields the programs that must run first."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import re
import subprocess
import tempfile
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import mathutils
import numpy as np

from . import solidtex_atlas, solidtex_osl, solidtex_vdb
from .programs import Job, ProgramError, find, preferences
from .settings import PLUGIN, Settings

COLOR = "albedo"
SHADER_INPUTS = {"roughness": "Roughness", "metallic": "Metallic"}
MAPS = {"basecolor": solidtex_atlas.COLOR, "normal": solidtex_atlas.NORMAL, **SHADER_INPUTS}
FIRST_WITH_VOLUMES = (5, 0)
# What solidtex-bake accepts.
MIN_SCALE, MAX_SCALE = 1e-9, 1e9  # texels per unit
MAX_REACH = 2**30  # texels from the origin
MAX_EDGE = 2**20  # voxels along an edge of a volume
UV_TOLERANCE = 1e-4
NEEDS_ROOM = re.compile(r"needs .+? are (?:available|free there|allowed)")

Jobs = Generator[Job, None, None]


@dataclass(frozen=True)
class Order:
    """What to make. A name stands for the object, because Undo replaces objects of Blender."""

    name: str
    model: Path
    channels: list[str]
    is_encoded: bool
    seed: int
    texels: float
    texels_per_unit: float
    rotation: tuple[float, float, float]
    resolution: int
    subdivide: int
    folder: Path

    @property
    def target(self) -> bpy.types.Object:
        target = bpy.data.objects.get(self.name)
        if target is None or target.type != "MESH":
            raise ProgramError(f"The object {self.name} is gone, so it gets no material")
        return target

    @property
    def shader_channels(self) -> tuple[str, ...]:
        return tuple(name for name in SHADER_INPUTS if name in self.channels)


def make(target: bpy.types.Object, settings: Settings) -> Jobs:
    """Give an object the material of the settings."""
    _check_mesh(target)
    scale = texels_per_unit(target, settings)
    _check_reach(target, scale)
    model = Path(settings.model)
    channels, is_encoded = _found_in(model)
    if COLOR not in channels:
        raise ProgramError(f"{model.name}: found the channels {channels}, expected {COLOR}")
    way = settings.way
    if way == "AUTO":
        way = "IMAGES" if _plugin_error(model) else "OSL"
    record = {
        "model": str(model), "seed": settings.seed, "texels": settings.texels,
        "rotation": tuple(settings.rotation), "way": way,
    }  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="solidtex-") as folder:
        order = Order(
            target.name, model, channels, is_encoded, settings.seed,
            settings.texels, scale, tuple(settings.rotation), settings.resolution,
            settings.subdivide, Path(folder),
        )  # fmt: skip
        yield from _WAYS[way](order)
    material = order.target.data.materials[0]
    name = f"{model.stem} {order.name}"
    replaced = bpy.data.materials.get(name)
    if replaced and replaced.users == 0:
        bpy.data.materials.remove(replaced)
    material.name = name
    material["solidtex"] = record


def texels_per_unit(target: bpy.types.Object, settings: Settings) -> float:
    width = solidtex_osl.EXTENT / solidtex_osl.fitting_scale(target)
    scale = settings.texels / width
    if not MIN_SCALE <= scale <= MAX_SCALE:
        size, number = ("larger", "fewer") if scale > 1 else ("smaller", "more")
        raise ProgramError(
            f"{target.name}: found a mesh {width:.3g} units wide, which is {scale:.3g} texels per "
            f"unit, expected {MIN_SCALE:g} to {MAX_SCALE:g}. Make the mesh {size} in Edit Mode, "
            f"apply the object's scale (Object > Apply > Scale), or choose {number} Texels"
        )
    return scale


def volume_box(
    target: bpy.types.Object, scale: float, rotation: tuple[float, float, float]
) -> tuple[list[int], list[int]]:
    """The first voxel and the size of the volume that an object needs."""
    corners = solidtex_osl.turned_corners(target, rotation)
    low = [math.floor(scale * min(c[axis] for c in corners)) - 2 for axis in range(3)]
    high = [math.ceil(scale * max(c[axis] for c in corners)) + 2 for axis in range(3)]
    return low, [end - first for first, end in zip(low, high, strict=True)]


def _found_in(model: Path) -> tuple[list[str], bool]:
    """Channels of a model, the three of a color as one, and whether its colors are sRGB-encoded."""
    command = [str(find("solidtex-info")), str(model), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ProgramError(done.stderr.strip())
    found = json.loads(done.stdout)
    channels = dict.fromkeys(name.partition(".")[0] for name in found["channels"])
    return list(channels), found["color_space"] == "srgb"


def _check_mesh(target: bpy.types.Object) -> None:
    mesh = target.data
    if not mesh.polygons:
        raise ProgramError(
            f"{target.name}: found a mesh without faces, expected one with faces. Make faces in "
            "Edit Mode (F), or choose another object"
        )
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    count = int((~np.isfinite(positions)).reshape(-1, 3).any(axis=1).sum())
    if count:
        raise ProgramError(
            f"{target.name}: found {count} of {len(mesh.vertices)} vertices at coordinates that "
            "are no numbers (nan or inf), expected finite ones. Delete these vertices, or run "
            f"bpy.data.meshes[{mesh.name!r}].validate() in the Python console, which moves them to "
            "the origin"
        )


def _check_reach(target: bpy.types.Object, scale: float) -> None:
    reach = scale * max(abs(number) for corner in target.bound_box for number in corner)
    if reach > MAX_REACH:
        raise ProgramError(
            f"{target.name}: found vertices {reach:.3g} texels from the object's origin, expected "
            f"at most {MAX_REACH:.3g}. Use Object > Set Origin > Origin to Geometry, or choose "
            "fewer Texels"
        )


def _plugin_error(model: Path) -> str:
    """Why the OpenImageIO of this Blender does not open a model; empty if it does."""
    try:
        solidtex_osl.find_modules_of_blender()
        import OpenImageIO  # Blender's own
    except ImportError as error:
        return str(error)
    picture = OpenImageIO.ImageInput.open(f"{model}?size=1")
    error = OpenImageIO.geterror()
    if picture is None:
        return error or "no reason"
    picture.close()
    return ""


def _check_plugin(model: Path) -> None:
    error = _plugin_error(model)
    if not error:
        return
    folder = preferences().plugin
    if not folder:
        found = "nothing"
    elif not Path(bpy.path.abspath(folder), PLUGIN).is_file():
        found = f"{folder} without {PLUGIN}"
    else:
        found = f"{folder}, with which OpenImageIO does not open {model.name} ({error})"
    raise ProgramError(
        f"OpenImageIO plugin, in Edit > Preferences > Add-ons > Solidtex: found {found}, expected "
        f"the folder of a {PLUGIN} built for Blender {bpy.app.version_string}. Set it, or choose "
        "another way than At every hit"
    )


def _at_every_hit(order: Order) -> Jobs:
    yield from ()
    _check_plugin(order.model)
    solidtex_osl.apply(
        order.target, order.model, order.texels_per_unit, seed=order.seed, rotation=order.rotation
    )


def _images(order: Order) -> Jobs:
    if not order.target.data.uv_layers:
        solidtex_atlas.unwrap(order.target)
    uv_map = _checked_uv_map(order.target)
    maps = [COLOR, *order.shader_channels, *(["normal"] if "height" in order.channels else [])]
    out = order.folder / "maps"
    yield _bake(order, _exported(order, with_uvs=True), out,
                "--maps", ",".join(maps), "--size", order.resolution)  # fmt: skip
    pictures = {MAPS[path.stem.rpartition("_")[2].lower()]: path for path in out.iterdir()}
    solidtex_atlas.apply(order.target, pictures, uv_map)
    for image in bpy.data.images:
        if Path(image.filepath).parent == out:
            image.pack()
            image.filepath = ""


def _checked_uv_map(target: bpy.types.Object) -> str:
    """Name of the UV map that is baked: the active one, which Blender exports."""
    layer = target.data.uv_layers.active
    values = np.empty(2 * len(layer.uv), np.float32)
    layer.uv.foreach_get("vector", values)
    places = values.reshape(-1, 2)
    is_inside = (np.abs(places - 0.5) <= 0.5 + UV_TOLERANCE).all(axis=1)  # false for nan
    if not is_inside.all():
        u, v = places[~is_inside][0]
        raise ProgramError(
            f"{target.name}: UV map {layer.name}: found the texture coordinates ({u:.4g}, {v:.4g}),"
            " expected all from 0 to 1. Add a UV map (Object Data > UV Maps) and unwrap it without "
            "overlaps (UV > Smart UV Project), or choose the way Vertex colors"
        )
    return layer.name


def _vertices(order: Order) -> Jobs:
    out = order.folder / "colors.ply"
    # Texture coordinates would cut vertices in two.
    yield _bake(order, _exported(order, with_uvs=False), out,
                "--to", "vertex-color", "--color-type", "float")  # fmt: skip
    with _selection_kept():
        bpy.ops.wm.ply_import(
            filepath=str(out), forward_axis="Y", up_axis="Z", import_colors="LINEAR"
        )
        colored = bpy.context.view_layer.objects.active.data
        try:
            _copy_attributes(colored, order.target.data, order.shader_channels)
        finally:
            bpy.data.meshes.remove(colored)
    order.target.data.materials.clear()
    order.target.data.materials.append(solidtex_vdb.attribute_material(order.shader_channels))


def _volume(order: Order) -> Jobs:
    if bpy.app.version < FIRST_WITH_VOLUMES:
        raise ProgramError(f"Blender {bpy.app.version_string}: volumes need Blender 5.0 or later")
    if not bpy.data.filepath:
        raise ProgramError("Save the .blend file first: the volume becomes a file beside it")
    low, size = volume_box(order.target, order.texels_per_unit, order.rotation)
    voxels = " x ".join(map(str, size))
    fewer = f"Choose fewer Texels, now {order.texels:g}"
    if max(size) > MAX_EDGE:
        raise ProgramError(
            f"{order.name}: found a volume of {voxels} voxels, expected at most {MAX_EDGE} along "
            f"an edge. {fewer}"
        )
    box = ["--size", ",".join(map(str, size)), f"--origin={','.join(map(str, low))}"]
    out = _volume_file(order, box)
    if not out.exists():
        try:
            yield Job([find("solidtex-bake"), order.model, *box, "--seed", order.seed,
                       "--color-space", "model", "-o", out])  # fmt: skip
        except ProgramError as error:
            if found := NEEDS_ROOM.search(str(error)):
                message = f"{order.name}: a volume of {voxels} voxels {found[0]}. {fewer}"
                raise ProgramError(message) from error
            raise
    target = order.target
    for modifier in [m for m in target.modifiers if m.name.startswith(solidtex_vdb.NAME)]:
        target.modifiers.remove(modifier)
    solidtex_vdb.apply(
        target, out, order.texels_per_unit, subdivide=order.subdivide,
        channels=order.shader_channels, srgb=order.is_encoded, rotation=order.rotation,
    )  # fmt: skip


def _volume_file(order: Order, box: list[str]) -> Path:
    """A file beside the .blend file, named by all that its values depend on.

    Nothing is replaced: other .blend files, Undo and the saved .blend file keep their volumes.
    Blender also keeps showing the former values of a path that is written again.
    """
    state = order.model.stat()
    values = (str(order.model.resolve()), state.st_mtime_ns, state.st_size, order.seed, *box)
    stamp = hashlib.sha256(json.dumps(values).encode()).hexdigest()[:8]
    blend = Path(bpy.data.filepath)
    name = f"{blend.stem}-{bpy.path.clean_name(order.name)}-{order.model.stem}-{stamp}.vdb"
    return blend.parent / name


_WAYS = {"OSL": _at_every_hit, "IMAGES": _images, "VERTICES": _vertices, "VOLUME": _volume}


def _bake(order: Order, mesh: Path, out: Path, *options: object) -> Job:
    return Job([find("solidtex-bake"), order.model, "--mesh", mesh, "--seed", order.seed,
                "--texels-per-unit", f"{order.texels_per_unit:.9g}",
                *options, "-o", out])  # fmt: skip


def _exported(order: Order, with_uvs: bool) -> Path:
    """The mesh as it is stored, without modifiers, turned as it stands within the material."""
    path = order.folder / f"{bpy.path.clean_name(order.name)}.ply"
    turned = bpy.data.objects.new("solidtex", order.target.data)
    turned.matrix_world = mathutils.Euler(order.rotation).to_matrix().to_4x4()
    bpy.context.scene.collection.objects.link(turned)
    try:
        with _selection_kept():
            turned.select_set(True)
            bpy.ops.wm.ply_export(
                filepath=str(path), export_selected_objects=True, apply_modifiers=False,
                export_uv=with_uvs, export_colors="NONE", forward_axis="Y", up_axis="Z",
            )  # fmt: skip
    finally:
        bpy.data.objects.remove(turned)
    return path


@contextlib.contextmanager
def _selection_kept() -> Iterator[None]:
    """Run with nothing selected, and select what was selected before."""
    layer = bpy.context.view_layer
    selected, active = list(layer.objects.selected), layer.objects.active
    for item in selected:
        item.select_set(False)
    try:
        yield
    finally:
        layer.update()  # without objects that were removed
        for item in layer.objects:
            item.select_set(item in selected)
        layer.objects.active = active


def _copy_attributes(source: bpy.types.Mesh, to: bpy.types.Mesh, others: tuple[str, ...]) -> None:
    count = len(to.vertices)
    if len(source.vertices) != count:
        raise ProgramError(f"Baked {len(source.vertices)} vertices, expected {count}")
    colors = source.color_attributes[0]
    for name, kind, key, width, values in (
        (COLOR, "FLOAT_COLOR", "color", 4, colors.data),
        *((name, "FLOAT", "value", 1, source.attributes[name].data) for name in others),
    ):
        numbers = [0.0] * (count * width)
        values.foreach_get(key, numbers)
        if name == COLOR:
            numbers = [max(number, 0.0) for number in numbers]  # there is no negative light
        if name in to.attributes:
            to.attributes.remove(to.attributes[name])
        to.attributes.new(name, kind, "POINT").data.foreach_set(key, numbers)
