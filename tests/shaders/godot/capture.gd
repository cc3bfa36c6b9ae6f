extends Node3D
## Gives the page two pictures as PNG: the example's scene, and a face of a box without light.

const FACE := "render_mode unshaded;\n#include \"stone.gdshaderinc\""


func _ready() -> void:
	var scene: Node3D = load("res://stone.tscn").instantiate()
	add_child(scene)
	await picture("scene")
	var ring: MeshInstance3D = scene.get_node("Ring")
	var shader := Shader.new()
	shader.code = ring.material_override.shader.code.replace("#include \"stone.gdshaderinc\"", FACE)
	ring.material_override.shader = shader
	ring.mesh = BoxMesh.new() # of one unit
	ring.transform = Transform3D.IDENTITY
	var camera: Camera3D = scene.get_node("Camera")
	camera.set_orthogonal(1.0, 0.05, 10.0) # as high as the box
	await picture("face")
	get_tree().quit()


func picture(name_: String) -> void:
	for frame in 2:
		await RenderingServer.frame_post_draw
	var png := get_viewport().get_texture().get_image().save_png_to_buffer()
	var url := "data:image/png;base64," + Marshalls.raw_to_base64(png)
	JavaScriptBridge.eval("pictures['%s'] = '%s'" % [name_, url])
