"""Renders a plane that shines with the color of an exported OSL shader; runs in Blender.

Arguments: shader, pixels a side, texels a side, footprint, EXR to write, origin of three numbers.
"""

import sys
from pathlib import Path

import bpy

# Script nodes need oslquery, which the module bpy does not find.
version = f"python{sys.version_info.major}.{sys.version_info.minor}"
sys.path.append(str(Path(bpy.utils.resource_path("LOCAL"), "python/lib", version, "site-packages")))

shader, picture = sys.argv[1], sys.argv[5]
side, texels, footprint, *origin = map(float, [*sys.argv[2:5], *sys.argv[6:9]])

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.shading_system = True

bpy.ops.mesh.primitive_plane_add(size=4)
plane = bpy.context.object
material = bpy.data.materials.new("solid")
material.use_nodes = True
tree = material.node_tree
tree.nodes.clear()
script = tree.nodes.new("ShaderNodeScript")
script.mode, script.filepath = "EXTERNAL", shader
coordinates = tree.nodes.new("ShaderNodeTexCoord")
place = tree.nodes.new("ShaderNodeVectorMath")
place.operation = "MULTIPLY_ADD"
place.inputs[1].default_value = (texels / 2,) * 3
place.inputs[2].default_value = origin
emission = tree.nodes.new("ShaderNodeEmission")
end = tree.nodes.new("ShaderNodeOutputMaterial")
tree.links.new(coordinates.outputs["Object"], place.inputs[0])
tree.links.new(place.outputs[0], script.inputs["texel"])
script.inputs["footprint"].default_value = footprint
tree.links.new(script.outputs["albedo"], emission.inputs["Color"])
tree.links.new(emission.outputs[0], end.inputs["Surface"])
plane.data.materials.append(material)

# One sample in the middle of each pixel, straight down on two units.
bpy.ops.object.camera_add(location=(0, 0, 5))
scene.camera = bpy.context.object
scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 2
scene.render.resolution_x = scene.render.resolution_y = int(side)
scene.cycles.samples, scene.cycles.use_denoising = 1, False
scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
settings = scene.render.image_settings
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = picture
bpy.ops.render.render(write_still=True)
