"""Blender's extension, where SOLIDTEX_BPY names a Python with the module bpy 4.2 or later (1 GB, so
not by default): the zip is installed, every operator runs, and the page's commands make its
picture. The panel is drawn in a window only, so no test sees it."""

import json
import os
import shutil
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from test_blender import BPY, BUILD, between_voxels, light, needs_bpy, run, run_commands
from test_pages import PICTURES, REPOSITORY, blocks, pixels, programs

import solidtex

SEED, TEXELS, ROTATION = 3, 20.0, (0.3, 0.5, 0.7)
INSTALL = """
import json, math, sys
from pathlib import Path
import bpy, numpy as np
folder = Path.cwd()
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(
    filepath=str(folder / "extension.zip"), repo="user_default", enable_on_install=True)
NAME = "bl_ext.user_default.solidtex"
preferences = bpy.context.preferences.addons[NAME].preferences
preferences.programs = sys.argv[1]
bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
ball = bpy.context.object
ball.location.x = 5  # the texture moves with it
settings = bpy.context.scene.solidtex
module = lambda name: sys.modules[NAME + "." + name]
def message(operator):
    try:
        operator()
    except RuntimeError as error:
        return str(error)
"""
PAINTED = f"""
settings.chosen, settings.seed, settings.texels = "paint-rusted", {SEED}, {TEXELS}
settings.rotation = {ROTATION}
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
def values(mesh, name, key="value", width=1):
    found = np.empty(len(mesh.vertices) * width, np.float32)
    mesh.attributes[name].data.foreach_get(key, found)
    return found.reshape(-1, width)
"""


def has_volumes() -> bool:
    code = "import importlib.metadata as found; print(found.version('bpy'))"
    return bool(BPY) and int(run([BPY, "-c", code], Path()).split(".")[0]) >= 5


HAS_VOLUMES = has_volumes()
needs_volumes = pytest.mark.skipif(not HAS_VOLUMES, reason="SOLIDTEX_BPY names no bpy 5 or later")


def package(folder: Path) -> None:
    script = REPOSITORY / "plugins" / "blender" / "package.cmake"
    run(["cmake", "-D", f"OUT={folder / 'extension.zip'}", "-P", script], folder)


def clean(folder: Path, **others: str) -> dict[str, str]:
    """An environment in which Blender has no settings yet."""
    resources = {"BLENDER_USER_RESOURCES": str(folder / "blender"), "TMPDIR": str(folder)}
    return {**os.environ, "PYTHONPATH": "", **resources, **others}


def blender(code: str, folder: Path, where: Path = BUILD / "bin", **others: str) -> dict:
    """What the code puts into `found`, in a Blender with the extension."""
    code = f"{INSTALL}{code}\nPath('found.json').write_text(json.dumps(found))"
    run([BPY, "-B", "-c", code, where], folder, env=clean(folder, **others))
    return json.loads((folder / "found.json").read_text())


def test_the_zip_has_a_manifest_and_a_thumbnail_for_every_shipped_model(folder: Path) -> None:
    with zipfile.ZipFile(folder / "extension.zip") as archive:
        names = set(archive.namelist())
        manifest = archive.read("blender_manifest.toml").decode()
    assert {"__init__.py", "solidtex_osl.py", "solidtex.osl", "LICENSE"} <= names
    assert f'version = "{solidtex.__version__}"' in manifest
    for model in (REPOSITORY / "models").glob("*.solidtex"):
        assert f"thumbnails/{model.stem}.jpg" in names


@needs_bpy
def test_vertices_have_the_means_of_their_neighborhoods(folder: Path) -> None:
    blender(
        f"""{PAINTED}
settings.way = "VERTICES"
bpy.ops.solidtex.make_material()
colors, rough = values(ball.data, "albedo", "color", 4)[:, :3], values(ball.data, "roughness")
at = values(ball.data, "position", "vector", 3)
np.save("values.npy", np.concatenate([at, colors, rough], axis=1))
found = {{}}
""",
        folder,
    )
    table = np.load(folder / "values.npy").astype(np.float64)
    near = painted(table[:, :3])
    assert near[:, :3].std() > 0.01
    assert np.corrcoef(table[:, 3:6].ravel(), near[:, :3].ravel())[0, 1] > 0.9
    assert np.corrcoef(table[:, 6], near[:, 3])[0, 1] > 0.9


@needs_volumes
def test_volumes_have_the_values_of_the_library(folder: Path) -> None:
    found = blender(
        f"""{PAINTED}
settings.way = "VOLUME"
bpy.ops.solidtex.make_material()
bpy.ops.solidtex.make_material()  # in place of the first one
mesh = ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
volume = [values(mesh, "albedo", "vector", 3), values(mesh, "roughness")]
np.save("values.npy", np.concatenate([values(mesh, "position", "vector", 3), *volume], axis=1))
material = ball.data.materials[0]
found = {{"modifiers": len(ball.modifiers), "objects": len(bpy.data.objects),
          "vdbs": len(list(folder.glob("scene-Sphere-paint-rusted-*.vdb"))),
          "name": material.name, "seed": material["solidtex"]["seed"]}}
""",
        folder,
    )
    assert found == {"modifiers": 1, "objects": 1, "vdbs": 1, "seed": SEED,
                     "name": "paint-rusted Sphere"}  # fmt: skip
    table = np.load(folder / "values.npy").astype(np.float64)
    volume = painted(table[:, :3])
    assert volume[:, :3].std() > 0.01
    assert np.abs(table[:, 3:] - volume).max() < 1e-4


@needs_volumes
def test_a_volume_replaces_no_other_one(folder: Path) -> None:
    """Neither that of another .blend file, nor the former one, which Blender would still show."""
    found = blender(
        f"""{PAINTED}
settings.chosen, settings.way = "granite-grey", "VOLUME"
def made(seed):
    settings.seed = seed
    bpy.ops.solidtex.make_material()
    mesh = ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    return float(values(mesh, "albedo", "vector", 3)[0, 0])
contents = lambda: {{p.name: p.read_bytes() for p in folder.glob("*.vdb")}}
first, second = made(0), made(1)
before = contents()
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "other.blend"))
again = made(0)
after = contents()
found = {{"shown": [first, second, again], "kept": all(after[n] == before[n] for n in before),
          "names": [len(before), len(after)], "new": list(after.keys() - before.keys())}}
""",
        folder,
    )
    first, second, again = found["shown"]
    assert first == again and abs(first - second) > 1e-3
    assert found["kept"] and found["names"] == [2, 3]
    assert found["new"][0].startswith("other-Sphere-granite-grey-")


def painted(positions: np.ndarray) -> np.ndarray:
    """Linear color and roughness at positions (N, 3) of the ball that PAINTED orders."""
    points = TEXELS / 2 * turned(positions, ROTATION)  # the ball is two units wide
    texture = solidtex.Texture("paint-rusted", seed=SEED)
    values = between_voxels(texture, points)
    return np.column_stack([light(values), values[:, texture.channels.index("roughness")]])


def turned(points: np.ndarray, angles: tuple[float, float, float]) -> np.ndarray:
    """Points turned about x, then y, then z."""
    for axis, angle in enumerate(angles):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        matrix = np.eye(3)
        matrix[first, first] = matrix[second, second] = np.cos(angle)
        matrix[second, first], matrix[first, second] = np.sin(angle), -np.sin(angle)
        points = points @ matrix.T
    return points


@needs_bpy
def test_images_are_kept_in_the_blend_file(folder: Path) -> None:
    found = blender(
        """
settings.chosen, settings.way, settings.resolution = "paint-rusted", "IMAGES", 64
settings.texels = 60
ball.data.uv_layers.remove(ball.data.uv_layers[0])
bpy.ops.solidtex.make_material()
links = ball.data.materials[0].node_tree.links
found = {"packed": [bool(image.packed_file) for image in bpy.data.images],
         "size": sorted({tuple(image.size) for image in bpy.data.images}),
         "inputs": sorted(l.to_socket.name for l in links if l.to_node.type == "BSDF_PRINCIPLED"),
         "uvs": len(ball.data.uv_layers), "selected": ball.select_get()}
""",
        folder,
    )
    assert found["packed"] == [True] * 3 and found["size"] == [[64, 64]]
    assert found["inputs"] == ["Base Color", "Normal", "Roughness"]
    assert found["uvs"] == 1 and found["selected"]
    assert not list(folder.glob("solidtex-*"))


@needs_bpy
def test_images_are_shown_by_the_uv_map_that_was_baked(folder: Path) -> None:
    found = blender(
        """
settings.chosen, settings.way, settings.resolution = "granite-grey", "IMAGES", 32
settings.texels = 30
first = ball.data.uv_layers[0]
first.name = "tiled"
for item in first.data:
    item.uv = item.uv * 3
tiled = message(bpy.ops.solidtex.make_material)
ball.data.uv_layers.active = ball.data.uv_layers.new(name="atlas", do_init=False)
module("solidtex_atlas").unwrap(ball)
bpy.ops.solidtex.make_material()
nodes = ball.data.materials[0].node_tree.nodes
rendered = next(layer.name for layer in ball.data.uv_layers if layer.active_render)
found = {"tiled": tiled, "rendered": rendered,
         "shown": [node.uv_map for node in nodes if node.type == "UVMAP"]}
""",
        folder,
    )
    assert "Sphere: UV map tiled: found the texture coordinates (" in found["tiled"]
    assert "Smart UV Project" in found["tiled"] and "Vertex colors" in found["tiled"]
    assert found["rendered"] == "tiled" and found["shown"] == ["atlas"]


@needs_bpy
def test_models_of_ones_own_get_thumbnails(folder: Path) -> None:
    own = folder / "mine"
    own.mkdir()
    shutil.copy(REPOSITORY / "models" / "granite-speckled.solidtex", own / "my-stone.solidtex")
    (own / "broken.solidtex").write_text("nothing")  # looked at before my-stone
    (own / "gone.solidtex").symlink_to(own / "nowhere.solidtex")
    found = blender(
        """
preferences.models = str(folder / "mine")
bpy.ops.solidtex.refresh_models()
settings.chosen = "my-stone"
path = module("settings").thumbnail(Path(settings.model))
image = bpy.data.images.load(str(path))
found = {"model": settings.model, "size": list(image.size),
         "models": len(module("settings").models()),
         "broken": module("settings").thumbnail(folder / "mine" / "broken.solidtex"),
         "contrast": float(np.std(image.pixels[:]))}
""",
        folder,
    )
    shipped = len(list((REPOSITORY / "models").glob("*.solidtex")))
    assert found["model"] == str(own / "my-stone.solidtex") and found["models"] == shipped + 2
    assert found["broken"] is None
    assert found["size"] == [128, 128] and found["contrast"] > 0.05


@needs_volumes
def test_a_bake_has_progress_and_is_cancelled_without_a_trace(folder: Path) -> None:
    found = blender(
        """
import time
settings.chosen, settings.way, settings.texels = "granite-grey", "VOLUME", 400
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
run = module("operators").Run(module("ways").make(ball, settings))
module("operators").Run.active = run
deadline = time.monotonic() + 300
while run.advance() and run.progress == 0 and time.monotonic() < deadline:
    time.sleep(0.05)
process = run._job._process
found = {"progress": run.progress, "runs": process.poll() is None,
         "poll": bpy.ops.solidtex.make_material.poll()}
bpy.ops.solidtex.cancel()
found |= {"ended": process.poll() is not None, "files": [p.name for p in folder.glob("*.vdb*")],
          "materials": len(ball.data.materials)}
""",
        folder,
    )
    assert 0 < found.pop("progress") < 1
    assert found == {"runs": True, "poll": False, "ended": True, "files": [], "materials": 0}
    assert not list(folder.glob("solidtex-*"))


def test_a_killed_blender_leaves_no_program_behind(tmp_path: Path) -> None:
    """A process that runs a bake as the extension does, without bpy, and is killed."""
    program = """
import importlib.util, sys, time, types
sys.modules["bpy"] = types.ModuleType("bpy")
spec = importlib.util.spec_from_file_location("programs", sys.argv[1])
programs = importlib.util.module_from_spec(spec)
spec.loader.exec_module(programs)
job = programs.Job([sys.argv[2], "granite-grey", "--size", "512", "-o", "large.npy"])
while job.is_running() and job.progress == 0:
    time.sleep(0.02)
print(job._process.pid, flush=True)
time.sleep(600)
"""
    source = REPOSITORY / "plugins" / "blender" / "extension" / "programs.py"
    command = [sys.executable, "-B", "-c", program, source, BUILD / "bin" / "solidtex-bake"]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE) as blender:
        assert blender.stdout
        bake = Path("/proc", blender.stdout.readline().decode().strip())
        assert (bake / "exe").resolve().name == "solidtex-bake"
        blender.kill()
    deadline = time.monotonic() + 120
    while bake.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not bake.exists() and not list(tmp_path.iterdir())


@needs_bpy
def test_the_page_makes_its_image(folder: Path) -> None:
    (commands,) = programs("blender-extension.md", "sh")
    (folder / "build").symlink_to(BUILD)
    for name in ("plugins", "scenes", "CMakeLists.txt"):
        (folder / name).symlink_to(REPOSITORY / name)
    resources = f"export BLENDER_USER_RESOURCES='{folder / 'blender'}'\n"
    run_commands(resources + commands, folder, BPY)
    made = np.concatenate([pixels(folder / f"{n}.png") for n in ("images", "vertices")], axis=1)
    shown = pixels(PICTURES / "blender-extension.png")
    assert made.shape == shown.shape and shown.std() > 10
    assert np.abs(blocks(made) - blocks(shown)).max() < 8
