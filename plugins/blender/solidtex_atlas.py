"""A solid texture that was baked to images of an object's UV atlas, in Blender.

As a module in Blender:

    import solidtex_atlas
    solidtex_atlas.unwrap(bpy.context.object)
    solidtex_atlas.apply(bpy.context.object, {"Base Color": Path("marble.exr")})
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import bpy

NAME = "solidtex"
COLOR, NORMAL = "Base Color", "Normal"


def unwrap(target: bpy.types.Object) -> None:
    """Give the object texture coordinates without overlaps. Ends in Object Mode."""
    if not target.data.polygons:
        raise ValueError(f"{target.name}: found a mesh without faces, expected one with faces")
    bpy.context.view_layer.objects.active = target
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.smart_project(island_margin=0.02)
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def apply(
    target: bpy.types.Object, pictures: Mapping[str, Path], uv_map: str = ""
) -> bpy.types.Material:
    """Give a mesh a material of images, by the inputs of the principled shader that they fill.

    uv_map: the UV map that the images were baked for; without, the one that Blender renders.
    """
    material = bpy.data.materials.new(NAME)
    material.use_nodes = True
    tree = material.node_tree
    surface = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    for name, path in pictures.items():
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(str(path.resolve()))
        if uv_map:
            place = tree.nodes.new("ShaderNodeUVMap")
            place.uv_map = uv_map
            tree.links.new(place.outputs["UV"], node.inputs["Vector"])
        if name != COLOR:
            node.image.colorspace_settings.name = "Non-Color"
        value = node.outputs["Color"]
        if name == NORMAL:
            relief = tree.nodes.new("ShaderNodeNormalMap")
            relief.uv_map = uv_map
            tree.links.new(value, relief.inputs["Color"])
            value = relief.outputs["Normal"]
        tree.links.new(value, surface.inputs[name])
    target.data.materials.clear()
    target.data.materials.append(material)
    return material
