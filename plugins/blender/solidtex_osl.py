"""A solid texture in Blender 4.5 without baking: an OSL script node asks the plugin of OpenImageIO
at every hit of a ray, with the level of detail that the hit covers.

As a module in Blender:

    import solidtex_osl
    solidtex_osl.apply(bpy.context.object, "marble.solidtex", texels_per_unit=100)

As a program, which adds the material to a mesh of a .blend file:

    blender -b scene.blend -P solidtex_osl.py -- marble.solidtex Ball --texels-per-unit 100

OIIO_LIBRARY_PATH must name the folder of a solidtex.imageio.so that is built for the OpenImageIO
inside Blender, when a scene is made and when it is rendered (docs/hosts/blender.md).
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import bpy
import mathutils

NAME = "solidtex"
HERE = Path(__file__).resolve().parent
# In the repository, in an installation, and in the extension.
SHADERS = tuple(
    folder / "solidtex.osl" for folder in (HERE.parent / "openimageio", HERE.parent, HERE)
)
# Levels of detail: footprints of up to 2^(LEVELS - 1) texels are averaged.
LEVELS = 6
COLORS = 3
# Texels along the longest side of an object whose scale is not said, as in solidtex-bake.
EXTENT = 512


def apply(
    target: bpy.types.Object,
    model: str | Path,
    texels_per_unit: float | None = None,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
    seed: int = 0,
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> bpy.types.Material:
    """Give a mesh a material with the color, and the roughness if any, of a solid texture.

    model: a file, or a shipped one as "marble.solidtex".
    texels_per_unit, origin: a point p of the object is looked up at origin + texels_per_unit * p,
        in texels. Without texels_per_unit the longest side of the object has 512 texels.
    seed: which variant of the material.
    rotation: XYZ Euler angles in radians, by which p is turned before it is looked up.

    The scene is set to Cycles with OSL, on the processor. The script is kept in the .blend file;
    the model is not. What grows beyond the object's bounding box of now is black there.
    """
    find_modules_of_blender()
    if texels_per_unit is None:
        texels_per_unit = fitting_scale(target)
    query = _query(turned_corners(target, rotation), model, texels_per_unit, origin, seed)
    channels, is_encoded = _found(query)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.shading_system = True
    material = bpy.data.materials.new(NAME)
    material.use_nodes = True
    tree = material.node_tree
    surface = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    script = _script_node(tree)
    values = {
        "filename": query,
        "scale": texels_per_unit,
        "origin": origin,
        "levels": LEVELS,
        "is_encoded": is_encoded,
    }
    if "roughness" in channels:
        values["channel"] = channels.index("roughness")
        tree.links.new(script.outputs["Value"], surface.inputs["Roughness"])
    for name, value in values.items():
        script.inputs[name].default_value = value
    tree.links.new(script.outputs["Color"], surface.inputs["Base Color"])
    if any(rotation):
        turn = tree.nodes.new("ShaderNodeVectorRotate")
        turn.rotation_type = "EULER_XYZ"
        turn.inputs["Rotation"].default_value = rotation
        place = tree.nodes.new("ShaderNodeTexCoord").outputs["Object"]
        tree.links.new(place, turn.inputs["Vector"])
        tree.links.new(turn.outputs["Vector"], script.inputs["position"])
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


def turned_corners(
    target: bpy.types.Object, rotation: tuple[float, float, float]
) -> list[mathutils.Vector]:
    """Corners of the box around an object, turned by XYZ Euler angles."""
    matrix = mathutils.Euler(rotation).to_matrix()
    return [matrix @ mathutils.Vector(corner) for corner in target.bound_box]


def find_modules_of_blender() -> None:
    """Add Blender's modules to the path: script nodes need oslquery, which bpy does not find."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    bundled = Path(bpy.utils.resource_path("LOCAL")) / "python/lib" / version / "site-packages"
    if str(bundled) not in sys.path:
        sys.path.append(str(bundled))


def _query(
    corners: list[mathutils.Vector],
    model: str | Path,
    texels_per_unit: float,
    origin: tuple[float, float, float],
    seed: int,
) -> str:
    """Query of the plugin for a volume around the corners, whole voxels of its coarsest level."""
    voxel = 2 ** (LEVELS - 1)
    low, size = [], []
    for axis in range(3):
        texels = [origin[axis] + texels_per_unit * corner[axis] for corner in corners]
        first = math.floor(min(texels) / voxel) - 1
        low.append(voxel * first)
        size.append(voxel * (math.ceil(max(texels) / voxel) + 1 - first))
    return (
        f"{model}?size={'x'.join(map(str, size))}&origin={','.join(map(str, low))}"
        f"&seed={seed}&scale={texels_per_unit:.9g}"
    )


def _found(query: str) -> tuple[list[str], bool]:
    """Channels of the model, and whether its colors are sRGB-encoded, by the plugin."""
    import OpenImageIO  # Blender's own

    picture = OpenImageIO.ImageInput.open(query)
    if picture is None:
        raise RuntimeError(
            f"{query}: OpenImageIO {OpenImageIO.VERSION_STRING} found {OpenImageIO.geterror()!r}; "
            "expected a model that exists, and OIIO_LIBRARY_PATH to name the folder of a "
            "solidtex.imageio.so for this version"
        )
    spec = picture.spec()
    picture.close()
    channels = list(spec.channelnames)
    if len(channels) < COLORS:
        raise RuntimeError(f"{query}: found the channels {channels}, expected {COLORS} or more")
    return channels, spec.get_string_attribute("oiio:ColorSpace") == "sRGB"


def _script_node(tree: bpy.types.NodeTree) -> bpy.types.Node:
    path = next((path for path in SHADERS if path.is_file()), None)
    if path is None:
        raise FileNotFoundError(f"found no {' and no '.join(map(str, SHADERS))}, expected one")
    script = tree.nodes.new("ShaderNodeScript")
    script.script = bpy.data.texts.get(path.name) or bpy.data.texts.load(str(path), internal=True)
    if "Color" not in script.outputs:
        raise RuntimeError(f"{path}: was not compiled, expected Cycles with OSL (see the console)")
    return script


def main(arguments: list[str]) -> None:
    """Run the command line described above; saves the open .blend file."""
    parser = argparse.ArgumentParser(prog="solidtex_osl.py", description=__doc__.splitlines()[0])
    parser.add_argument("model")
    parser.add_argument("object", help="name of a mesh in the .blend file")
    parser.add_argument(
        "--texels-per-unit",
        type=float,
        help="default: 512 along the longest side of the object",
    )
    parser.add_argument("--origin", type=float, nargs=3, default=(0.0, 0.0, 0.0))
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args(arguments)
    if args.object not in bpy.data.objects:
        parser.error(f"object {args.object!r}: found {list(bpy.data.objects.keys())}")
    target = bpy.data.objects[args.object]
    apply(target, args.model, args.texels_per_unit, tuple(args.origin), args.seed)
    bpy.ops.wm.save_mainfile()


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else [])
