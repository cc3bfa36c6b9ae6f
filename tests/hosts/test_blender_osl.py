"""Blender's OSL route, where SOLIDTEX_BPY45 names a Python with the module bpy 4.5 (1 GB, so not by
default): the page's commands build the plugin for the OpenImageIO inside it and make the picture,
and the shader gives what the library does, at every level of detail."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from test_blender import between_voxels, light, run, run_commands
from test_blender_extension import INSTALL, clean, package
from test_pages import PICTURES, REPOSITORY, blocks, link_sources, pixels, programs

import solidtex

BPY = os.environ.get("SOLIDTEX_BPY45", "")
MODELS = ("marble", "paint-rusted")
EXAMPLE = str(REPOSITORY / "plugins" / "blender" / "example.py")
pytestmark = pytest.mark.skipif(not BPY, reason="SOLIDTEX_BPY45 names no Python with bpy 4.5")

SCALE, ORIGIN, SIDE = 10.0, (100.5, 50.25, -7.0), 96
# Looks straight down, one sample in the middle of each pixel, at a plane that shines with an output
# of the shader.
SHINE = """
import sys
import bpy, numpy as np
sys.path.insert(0, sys.argv[1])
import solidtex_osl
model, output, units, scale, side, out = *sys.argv[2:4], *map(float, sys.argv[4:7]), sys.argv[7]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_plane_add(size=2 * units)
plane = bpy.context.object
plane.location.x = 3  # the texture moves with it
material = solidtex_osl.apply(plane, model, scale, tuple(map(float, sys.argv[8:11])))
tree = material.node_tree
script = next(node for node in tree.nodes if node.type == "SCRIPT")
emission = tree.nodes.new("ShaderNodeEmission")
end = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
tree.links.new(script.outputs[output], emission.inputs["Color"])
tree.links.new(emission.outputs[0], end.inputs["Surface"])
scene = bpy.context.scene
bpy.ops.object.camera_add(location=(3, 0, 5))
scene.camera = bpy.context.object
scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", units
scene.render.resolution_x = scene.render.resolution_y = int(side)
scene.cycles.samples, scene.cycles.use_denoising = 1, False
scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
settings = scene.render.image_settings
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = out
bpy.ops.render.render(write_still=True)
import OpenImageIO
np.save(out + ".npy", OpenImageIO.ImageBuf(out).get_pixels()[..., :3])
"""


def environment(**others: str) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": "", **others}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the commands of the page have run."""
    folder = tmp_path_factory.mktemp("page")
    link_sources(folder)
    (commands,) = programs("blender-osl.md", "sh")
    run_commands(commands, folder, BPY)
    return folder


def shine(made: Path, output: str, units: float, to: Path) -> np.ndarray:
    """The picture of a plane, rows from the top: (SIDE, SIDE, 3)."""
    scripts = REPOSITORY / "plugins" / "blender"
    plugin = str(made / "build-blender" / "lib" / "openimageio")
    out = to / "shine.exr"
    numbers = (units, SCALE, SIDE, out, *ORIGIN)
    command = [BPY, "-B", "-c", SHINE, scripts, "granite-grey.solidtex", output, *numbers]
    run(command, to, env=environment(OIIO_LIBRARY_PATH=plugin))
    return np.load(f"{out}.npy")


def points(units: float) -> np.ndarray:
    """The texels that the pixels see, (SIDE * SIDE, 3)."""
    at = ((np.arange(SIDE) + 0.5) / SIDE - 0.5) * units
    y, x = np.meshgrid(-at, at, indexing="ij")
    return SCALE * np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3) + ORIGIN


def test_the_page_makes_its_image(made: Path) -> None:
    found = np.concatenate([pixels(made / f"{model}.png") for model in MODELS], axis=1)
    shown = pixels(PICTURES / "blender-osl.png")
    assert found.shape == shown.shape and shown.std() > 10
    assert np.abs(blocks(found) - blocks(shown)).max() < 8


def test_near_by_the_shader_has_the_values_of_the_library(made: Path, tmp_path: Path) -> None:
    units = SIDE / SCALE / 2  # two pixels for a texel
    found = shine(made, "Color", units, tmp_path).reshape(-1, 3)
    true = light(between_voxels(solidtex.Texture("granite-grey"), points(units)))
    assert true.std() > 0.05
    # Tiles are of half precision, and samples up to a hundredth of a pixel off the middle.
    assert np.abs(found - true).max() < 0.01


def test_far_away_the_shader_takes_the_level_that_a_pixel_covers(
    made: Path, tmp_path: Path
) -> None:
    units = 4 * SIDE / SCALE  # four texels a pixel
    level = shine(made, "Level", units, tmp_path)
    # log2(0.75 * 4) lies between the levels 1 and 2, halfway.
    assert np.abs(level - 1.5).max() < 0.01
    found = shine(made, "Color", units, tmp_path).reshape(-1, 3)
    texture = solidtex.Texture("granite-grey")
    sharp = light(texture.eval_points(points(units)))
    mean = light(texture.eval_points(points(units), radii=2))
    assert np.abs(sharp - mean).mean() > 0.05
    assert np.abs(found - mean).mean() < 0.01


def test_without_the_plugin_it_says_what_is_missing(tmp_path: Path) -> None:
    scripts = REPOSITORY / "plugins" / "blender"
    model = REPOSITORY / "models" / "marble.solidtex"
    code = "import sys, bpy; sys.path.insert(0, sys.argv[1]); import solidtex_osl\n"
    code += "solidtex_osl.apply(bpy.data.objects['Cube'], sys.argv[2])"
    command = [BPY, "-B", "-c", code, str(scripts), str(model)]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert f"{model}?size=" in done.stderr and "OIIO_LIBRARY_PATH" in done.stderr


def test_the_measurement_runs(made: Path, tmp_path: Path) -> None:
    code = "import sys; sys.path.insert(0, sys.argv[1]); import measure_blender as m\n"
    code += "m.SIDE, m.SAMPLES, m.ROUNDS = 64, 4, 1; m.main(['granite-grey'])"
    plugin = str(made / "build-blender" / "lib" / "openimageio")
    module = os.environ["SOLIDTEX_BUILD"] + "/python"
    env = environment(OIIO_LIBRARY_PATH=plugin, PYTHONPATH=module)
    run([BPY, "-B", "-c", code, REPOSITORY / "benchmarks"], tmp_path, env=env)


def test_the_extension_evaluates_at_every_hit(made: Path, tmp_path: Path) -> None:
    """With the plugin's folder as a preference, and without OIIO_LIBRARY_PATH."""
    package(tmp_path)
    code = f"""{INSTALL}
preferences.plugin = {str(made / "build-blender" / "lib" / "openimageio")!r}
settings.chosen, settings.texels, settings.rotation = "granite-grey", 60, (0.3, 0.5, 0.7)
settings.resolution = 256
ball.location = 0, 0, 1
import importlib.util
spec = importlib.util.spec_from_file_location("example", {EXAMPLE!r})
example = importlib.util.module_from_spec(spec)
spec.loader.exec_module(example)
found = []
for way in ("AUTO", "IMAGES"):
    settings.way = way
    bpy.context.view_layer.objects.active = ball
    bpy.ops.solidtex.make_material()
    found.append(ball.data.materials[0]["solidtex"]["way"])
    example.render(ball, way + ".png")
    bpy.data.lights.remove(bpy.data.lights[0])  # the next render has its own
Path("found.json").write_text(json.dumps(found))
"""
    bin_folder = os.environ["SOLIDTEX_BUILD"] + "/bin"
    run([BPY, "-B", "-c", code, bin_folder], tmp_path, env=clean(tmp_path))
    assert json.loads((tmp_path / "found.json").read_text()) == ["OSL", "IMAGES"]
    hit, image = (pixels(tmp_path / f"{way}.png") for way in ("AUTO", "IMAGES"))
    assert hit.std() > 10
    # One ball, evaluated and baked: alike, at the same places.
    assert np.abs(blocks(hit) - blocks(image)).mean() < 3
    middle = (slice(130, 230), slice(130, 190))
    assert np.corrcoef(hit[middle].ravel(), image[middle].ravel())[0, 1] > 0.7
