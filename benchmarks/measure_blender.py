"""Measures solid textures in Cycles: lookups per second of processor time.

Lookups go through OSL and the OpenImageIO plugin; direct calls of the library are the reference.
Run it on one core by a Python with bpy 4.5:

    taskset -c 1 bpy/bin/python benchmarks/measure_blender.py granite-grey granite-speckled

An unlit plane fills the image, so a render with a constant color differs in the material alone. Set
OIIO_LIBRARY_PATH as in docs/hosts/blender-osl.md and PYTHONPATH to build/python, the folder of the
module. Tiles are computed before timing.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import bpy
import numpy as np

import solidtex

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "plugins" / "blender"))
import solidtex_osl

SIDE, SAMPLES, ROUNDS = 512, 16, 3
TEXELS = 256.0  # across the image: two pixels a texel


def plane_and_camera() -> bpy.types.Object:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.object.camera_add(location=(0, 0, 5))
    scene.camera = bpy.context.object
    scene.camera.data.type, scene.camera.data.ortho_scale = "ORTHO", 2
    bpy.ops.mesh.primitive_plane_add(size=2)
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.use_persistent_data = True
    scene.cycles.samples, scene.cycles.use_denoising = SAMPLES, False
    scene.cycles.use_adaptive_sampling = False
    return bpy.context.object


def shine(material: bpy.types.Material, is_textured: bool) -> None:
    tree = material.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    end = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    script = next(node for node in tree.nodes if node.type == "SCRIPT")
    if is_textured:
        tree.links.new(script.outputs["Color"], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], end.inputs["Surface"])


def seconds() -> float:
    """Smallest processor time of several frames."""
    found = []
    for _ in range(ROUNDS + 1):  # the first computes the tiles
        start = time.process_time()
        bpy.ops.render.render()
        found.append(time.process_time() - start)
    return min(found[1:])


def frame(model: str, is_textured: bool) -> float:
    material = solidtex_osl.apply(plane_and_camera(), f"{model}.solidtex", TEXELS / 2)
    shine(material, is_textured)
    return seconds()


def direct(model: str) -> float:
    """Points per second of direct calls of the library."""
    texture = solidtex.Texture(model, threads=1)
    at = (np.random.default_rng(0).random((65536, 3)) * (TEXELS, TEXELS, 1)).astype(np.float32)
    texture.eval_points(at)
    found = []
    for _ in range(ROUNDS):
        start = time.process_time()
        texture.eval_points(at)
        found.append(time.process_time() - start)
    return len(at) / min(found)


def main(models: list[str]) -> None:
    for model in models:
        through = SIDE * SIDE * SAMPLES / (frame(model, True) - frame(model, False))
        at_once = direct(model)
        print(
            f"{model}: {through / 1e6:.2f} million lookups a second through OSL, "
            f"{at_once / 1e6:.2f} direct, {through / at_once:.2f} of direct",
            file=sys.stderr,
        )


if __name__ == "__main__":
    main(sys.argv[1:])
