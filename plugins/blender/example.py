"""Renders one mesh with a solid texture in several ways, with Blender as a module (`bpy`):

    python example.py osl MESH.ply GRANITE.solidtex TEXELS_PER_UNIT OUT.png
    python example.py volume MESH.ply GRANITE.vdb TEXELS_PER_UNIT OUT.png
    python example.py vertices COLORED.ply OUT.png
    python example.py atlas UNWRAPPED.obj ATLAS.exr OUT.png
    python example.py unwrap MESH.ply UNWRAPPED.obj

or by the extension, with the folder of solidtex-bake:

    python example.py extension MESH.ply EXTENSION.zip PROGRAMS MODEL WAY OUT.png

Meshes stand on the ground at the origin, with z upwards, about two units high.
"""

from __future__ import annotations

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
import solidtex_atlas
import solidtex_osl
import solidtex_vdb

SIZE, SAMPLES = 320, 48
# Along the longest side, by the extension.
TEXELS = 340


def load(path: str) -> bpy.types.Object:
    """Load the mesh as stored: axes are not changed, so points keep their texels."""
    if path.endswith(".ply"):
        bpy.ops.wm.ply_import(filepath=path, forward_axis="Y", up_axis="Z")
    else:
        bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")
    return bpy.context.selected_objects[0]


def with_vertex_colors(target: bpy.types.Object) -> None:
    material = bpy.data.materials.new("vertex colors")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    color = next(n for n in nodes if n.type == "BSDF_PRINCIPLED").inputs["Base Color"]
    node = nodes.new("ShaderNodeVertexColor")
    node.layer_name = target.data.color_attributes[0].name
    material.node_tree.links.new(node.outputs["Color"], color)
    target.data.materials.append(material)


def unwrap(target: bpy.types.Object, out: str) -> None:
    solidtex_atlas.unwrap(target)
    axes = {"forward_axis": "Y", "up_axis": "Z"}
    bpy.ops.wm.obj_export(filepath=out, export_materials=False, **axes)


def by_extension(
    target: bpy.types.Object, extension: str, programs: str, model: str, way: str
) -> None:
    """What a person does: install the extension, choose in the panel, press its button."""
    bpy.ops.extensions.package_install_files(
        filepath=str(Path(extension).resolve()), repo="user_default", enable_on_install=True
    )
    addon = bpy.context.preferences.addons["bl_ext.user_default.solidtex"]
    addon.preferences.programs = str(Path(programs).resolve())
    settings = bpy.context.scene.solidtex
    settings.chosen, settings.way, settings.texels = model, way, TEXELS
    bpy.context.view_layer.objects.active = target
    bpy.ops.solidtex.make_material()


def render(target: bpy.types.Object, out: str) -> None:
    """Render from slightly above with a sun and a bright sky, on the CPU."""
    target.rotation_euler = (1.5708, 0, 0)  # its y becomes up
    scene = bpy.context.scene
    bpy.ops.object.light_add(type="SUN", rotation=(0.7, 0.3, 0.4))
    bpy.context.object.data.energy = 2
    bpy.ops.object.camera_add(location=(0, -5.5, 1.9), rotation=(1.41, 0, 0))
    scene.camera = bpy.context.object
    scene.camera.data.lens = 80
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = next(n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.3, 0.33, 0.4, 1)
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = False
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.filepath = str(Path(out).resolve())
    bpy.ops.render.render(write_still=True)


def main(arguments: list[str]) -> None:
    if not arguments:
        raise SystemExit(__doc__)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    way, mesh, *others, out = arguments
    target = load(mesh)
    if way == "unwrap":
        unwrap(target, out)
        return
    if way == "osl":
        model, texels = others
        solidtex_osl.apply(target, model, float(texels))
    elif way == "volume":
        vdb, texels = others
        solidtex_vdb.apply(target, vdb, float(texels), subdivide=1)
    elif way == "vertices":
        with_vertex_colors(target)
    elif way == "atlas":
        solidtex_atlas.apply(target, {"Base Color": Path(others[0])})
    elif way == "extension":
        by_extension(target, *others)
    else:
        raise SystemExit(__doc__)
    render(target, out)


if __name__ == "__main__":
    main(sys.argv[1:])
