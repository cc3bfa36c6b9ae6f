@tool
extends MeshInstance3D
## Gives the material of this mesh the weights that solidtex-export-shader wrote beside the shader.

const WIDTH := 128 ## Texels in a row.
const TEXEL_BYTES := 8 ## Four halves.

@export_file("*.bin") var file := "res://stone.weights.bin"
@export var parameter := "solidtex_stone_weights"


func _ready() -> void:
	var bytes := FileAccess.get_file_as_bytes(file)
	if bytes.is_empty():
		push_error("%s: %s" % [file, error_string(FileAccess.get_open_error())])
		return
	var rows := bytes.size() / (WIDTH * TEXEL_BYTES)
	var image := Image.create_from_data(WIDTH, rows, false, Image.FORMAT_RGBAH, bytes)
	material_override.set_shader_parameter(parameter, ImageTexture.create_from_image(image))
