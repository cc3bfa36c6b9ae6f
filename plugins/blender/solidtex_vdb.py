"""A baked solid texture in Blender 5: the grids of a .vdb as attributes of a mesh, and a material.

As a module in Blender:

    import solidtex_vdb
    solidtex_vdb.apply(bpy.context.object, "granite.vdb", texels_per_unit=100)

As a program, which adds them to a mesh of a .blend file:

    blender -b scene.blend -P solidtex_vdb.py -- granite.vdb Ball --texels-per-unit 100

The geometry nodes look every vertex up: Import VDB, Get Named Grid, Sample Grid, Store Named
Attribute. Nothing is copied into the .blend file; what the .vdb does not cover is black.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import bpy

COLOR = "albedo"
NAME = "solidtex"
# Texels along the longest side of an object whose scale is not said, as in solidtex-bake.
EXTENT = 512


def apply(
    target: bpy.types.Object,
    vdb: str | Path,
    texels_per_unit: float | None = None,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    subdivide: int = 0,
    channels: tuple[str, ...] = (),
    srgb: bool = True,
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> bpy.types.Material:
    """Give a mesh the solid texture of a .vdb of solidtex-bake, and a material that shows it.

    texels_per_unit, origin: a point p of the object is looked up at origin + texels_per_unit * p,
        in texels; the .vdb must cover that (solidtex-bake --origin and --size). Without
        texels_per_unit the longest side of the object has 512 texels.
    subdivide: how often faces are cut into four first, because only vertices are looked up.
    channels: grids beside the albedo that become attributes; "roughness" and "metallic" go into
        the material too.
    srgb: whether the albedo is encoded, as solidtex-info says; it is decoded to light.
    rotation: XYZ Euler angles in radians, by which p is turned before it is looked up.
    """
    if bpy.app.version < (5, 0):
        raise RuntimeError(f"Blender {bpy.app.version_string}, expected 5.0 or later: Sample Grid")
    if not Path(vdb).is_file():
        raise FileNotFoundError(f"{vdb}: found no such file, expected a .vdb of solidtex-bake")
    if texels_per_unit is None:
        texels_per_unit = fitting_scale(target)
    place = (texels_per_unit, origin, rotation)
    group = _node_group(Path(vdb), place, subdivide, channels, srgb)
    modifier = target.modifiers.new(NAME, "NODES")
    modifier.node_group = group
    material = attribute_material(channels)
    target.data.materials.clear()
    target.data.materials.append(material)
    return material


def fitting_scale(target: bpy.types.Object) -> float:
    """Texels per unit with which the longest side of the object has EXTENT texels."""
    sides = [max(c[axis] for c in target.bound_box) - min(c[axis] for c in target.bound_box)
             for axis in range(3)]  # fmt: skip
    if max(sides) <= 0:
        raise ValueError(f"{target.name}: found all vertices at one point, expected a surface")
    return EXTENT / max(sides)


def _node_group(
    vdb: Path,
    place: tuple[float, tuple[float, float, float], tuple[float, float, float]],
    subdivide: int,
    channels: tuple[str, ...],
    srgb: bool,
) -> bpy.types.NodeTree:
    tree = bpy.data.node_groups.new(NAME, "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    geometry = tree.nodes.new("NodeGroupInput").outputs[0]
    if subdivide:
        node = tree.nodes.new("GeometryNodeSubdivideMesh")
        node.inputs["Level"].default_value = subdivide
        tree.links.new(geometry, node.inputs["Mesh"])
        geometry = node.outputs["Mesh"]
    volume = tree.nodes.new("GeometryNodeImportVDB")
    volume.inputs["Path"].default_value = str(vdb.resolve())
    at = _texel(tree, *place)
    for name in (COLOR, *channels):
        kind = "VECTOR" if name == COLOR else "FLOAT"
        value = _sampled(tree, volume.outputs[0], name, kind, at)
        if name == COLOR and srgb:
            value = _decoded(tree, value)
        store = tree.nodes.new("GeometryNodeStoreNamedAttribute")
        store.data_type = "FLOAT_VECTOR" if kind == "VECTOR" else "FLOAT"
        store.inputs["Name"].default_value = name
        tree.links.new(geometry, store.inputs["Geometry"])
        tree.links.new(value, store.inputs["Value"])
        geometry = store.outputs["Geometry"]
    tree.links.new(geometry, tree.nodes.new("NodeGroupOutput").inputs[0])
    return tree


Socket = bpy.types.NodeSocket


def _texel(
    tree: bpy.types.NodeTree,
    texels_per_unit: float,
    origin: tuple[float, float, float],
    rotation: tuple[float, float, float],
) -> Socket:
    """Where in the volume a vertex is."""
    turn = tree.nodes.new("ShaderNodeVectorRotate")
    turn.rotation_type = "EULER_XYZ"
    turn.inputs["Rotation"].default_value = rotation
    place = tree.nodes.new("ShaderNodeVectorMath")
    place.operation = "MULTIPLY_ADD"
    tree.links.new(tree.nodes.new("GeometryNodeInputPosition").outputs[0], turn.inputs["Vector"])
    tree.links.new(turn.outputs["Vector"], place.inputs[0])
    place.inputs[1].default_value = (texels_per_unit,) * 3
    place.inputs[2].default_value = origin
    return place.outputs[0]


def _sampled(tree: bpy.types.NodeTree, volume: Socket, name: str, kind: str, at: Socket) -> Socket:
    grid = tree.nodes.new("GeometryNodeGetNamedGrid")
    grid.data_type = kind
    grid.inputs["Name"].default_value = name
    sample = tree.nodes.new("GeometryNodeSampleGrid")
    sample.data_type = kind
    tree.links.new(volume, grid.inputs["Volume"])
    tree.links.new(grid.outputs["Grid"], sample.inputs["Grid"])
    tree.links.new(at, sample.inputs["Position"])
    return sample.outputs["Value"]


def _decoded(tree: bpy.types.NodeTree, color: Socket) -> Socket:
    """Decode three sRGB channels; negative light becomes 0."""
    parts = tree.nodes.new("ShaderNodeSeparateXYZ")
    joined = tree.nodes.new("ShaderNodeCombineXYZ")
    tree.links.new(color, parts.inputs[0])
    for encoded, result in zip(parts.outputs, joined.inputs, strict=True):
        part = _math(tree, "MAXIMUM", encoded, 0.0)
        raised = _math(tree, "MULTIPLY_ADD", part, 1 / 1.055, 0.055 / 1.055)
        bright = _math(tree, "POWER", raised, 2.4)
        dark = _math(tree, "MULTIPLY", part, 1 / 12.92)
        is_bright = _math(tree, "GREATER_THAN", part, 0.04045)
        mix = tree.nodes.new("ShaderNodeMix")
        for socket, name in ((is_bright, "Factor"), (dark, "A"), (bright, "B")):
            tree.links.new(socket, mix.inputs[name])
        tree.links.new(mix.outputs["Result"], result)
    return joined.outputs[0]


def _math(tree: bpy.types.NodeTree, operation: str, first: Socket, *others: float) -> Socket:
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    tree.links.new(first, node.inputs[0])
    for socket, value in zip(node.inputs[1:], others, strict=False):
        socket.default_value = value
    return node.outputs[0]


def attribute_material(channels: tuple[str, ...]) -> bpy.types.Material:
    """A material of the attributes "albedo", which is linear, and of some channels."""
    material = bpy.data.materials.new(NAME)
    material.use_nodes = True
    tree = material.node_tree
    surface = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    wanted = {COLOR: ("Vector", "Base Color")}
    wanted |= {name: ("Fac", name.capitalize()) for name in ("roughness", "metallic")}
    for name in (COLOR, *channels):
        if name not in wanted:
            continue
        output, entry = wanted[name]
        attribute = tree.nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = name
        tree.links.new(attribute.outputs[output], surface.inputs[entry])
    return material


def main(arguments: list[str]) -> None:
    """Run the command line described above; saves the open .blend file."""
    parser = argparse.ArgumentParser(prog="solidtex_vdb.py", description=__doc__.splitlines()[0])
    parser.add_argument("vdb", type=Path)
    parser.add_argument("object", help="name of a mesh in the .blend file")
    parser.add_argument(
        "--texels-per-unit",
        type=float,
        help="default: 512 along the longest side of the object",
    )
    parser.add_argument("--origin", type=float, nargs=3, default=(0.0, 0.0, 0.0))
    parser.add_argument("--subdivide", type=int, default=0)
    parser.add_argument("--channel", action="append", default=[], help="beside the albedo")
    parser.add_argument("--linear", action="store_true", help="the model's albedo is not sRGB")
    args = parser.parse_args(arguments)
    if args.object not in bpy.data.objects:
        parser.error(f"object {args.object!r}: found {list(bpy.data.objects.keys())}")
    apply(
        bpy.data.objects[args.object],
        args.vdb,
        args.texels_per_unit,
        tuple(args.origin),
        args.subdivide,
        tuple(args.channel),
        not args.linear,
    )
    bpy.ops.wm.save_mainfile()


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else [])
