"""The ways to show a solid texture in Blender. Each yields the programs that must run first."""

from __future__ import annotations

import contextlib
import json
import math
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import mathutils

from . import solidtex_atlas, solidtex_osl, solidtex_vdb
from .programs import Job, ProgramError, find
from .settings import Settings

COLOR = "albedo"
SHADER_INPUTS = {"roughness": "Roughness", "metallic": "Metallic"}
MAPS = {"basecolor": solidtex_atlas.COLOR, "normal": solidtex_atlas.NORMAL, **SHADER_INPUTS}
FIRST_WITH_VOLUMES = (5, 0)


@dataclass(frozen=True)
class Order:
    """What to make. A name stands for the object, because Undo replaces objects of Blender."""

    name: str
    model: Path
    channels: list[str]
    is_encoded: bool
    seed: int
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


def make(target: bpy.types.Object, settings: Settings) -> Iterator[Job]:
    """Give an object the material of the settings."""
    model = Path(settings.model)
    channels, is_encoded = _found_in(model)
    if COLOR not in channels:
        raise ProgramError(f"{model.name}: found the channels {channels}, expected {COLOR}")
    way = settings.way
    if way == "AUTO":
        way = "OSL" if _opens(model) else "IMAGES"
    record = {
        "model": str(model), "seed": settings.seed, "texels": settings.texels,
        "rotation": tuple(settings.rotation), "way": way,
    }  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="solidtex-") as folder:
        order = Order(
            target.name, model, channels, is_encoded, settings.seed,
            texels_per_unit(target, settings), tuple(settings.rotation), settings.resolution,
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
    return solidtex_osl.fitting_scale(target) * settings.texels / solidtex_osl.EXTENT


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


def _opens(model: Path) -> bool:
    """Whether the OpenImageIO of this Blender opens models."""
    try:
        solidtex_osl.find_modules_of_blender()
        import OpenImageIO  # Blender's own
    except ImportError:
        return False
    picture = OpenImageIO.ImageInput.open(f"{model}?size=1")
    OpenImageIO.geterror()
    if picture is None:
        return False
    picture.close()
    return True


def _at_every_hit(order: Order) -> Iterator[Job]:
    yield from ()
    solidtex_osl.apply(
        order.target, order.model, order.texels_per_unit, seed=order.seed, rotation=order.rotation
    )


def _images(order: Order) -> Iterator[Job]:
    if not order.target.data.uv_layers:
        solidtex_atlas.unwrap(order.target)
    maps = [COLOR, *order.shader_channels, *(["normal"] if "height" in order.channels else [])]
    out = order.folder / "maps"
    yield _bake(order, _exported(order, with_uvs=True), out,
                "--maps", ",".join(maps), "--size", order.resolution)  # fmt: skip
    pictures = {MAPS[path.stem.rpartition("_")[2].lower()]: path for path in out.iterdir()}
    solidtex_atlas.apply(order.target, pictures)
    for image in bpy.data.images:
        if Path(image.filepath).parent == out:
            image.pack()
            image.filepath = ""


def _vertices(order: Order) -> Iterator[Job]:
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


def _volume(order: Order) -> Iterator[Job]:
    if bpy.app.version < FIRST_WITH_VOLUMES:
        raise ProgramError(f"Blender {bpy.app.version_string}: volumes need Blender 5.0 or later")
    if not bpy.data.filepath:
        raise ProgramError("Save the .blend file first: the volume becomes a file beside it")
    name = f"{bpy.path.clean_name(order.name)}-{order.model.stem}.vdb"
    out = Path(bpy.path.abspath("//")) / name
    low, size = volume_box(order.target, order.texels_per_unit, order.rotation)
    yield Job([find("solidtex-bake"), order.model, "--size", ",".join(map(str, size)),
               f"--origin={','.join(map(str, low))}", "--seed", order.seed,
               "--color-space", "model", "--force", "-o", out])  # fmt: skip
    target = order.target
    for modifier in [m for m in target.modifiers if m.name.startswith(solidtex_vdb.NAME)]:
        target.modifiers.remove(modifier)
    solidtex_vdb.apply(
        target, out, order.texels_per_unit, subdivide=order.subdivide,
        channels=order.shader_channels, srgb=order.is_encoded, rotation=order.rotation,
    )  # fmt: skip


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
