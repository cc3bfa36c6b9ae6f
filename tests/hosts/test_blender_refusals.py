"""What Blender's extension refuses, in the words of its panel."""

from pathlib import Path

from test_blender import needs_bpy
from test_blender_extension import HAS_VOLUMES, blender, needs_volumes


@needs_bpy
def test_what_is_missing_is_said(folder: Path) -> None:
    (folder / "empty").mkdir()
    found = blender(
        """
settings.chosen = "granite-grey"
unsaved = message(lambda: (setattr(settings, "way", "VOLUME"), bpy.ops.solidtex.make_material()))
broken = folder / "broken.solidtex"
broken.write_text("nothing")
preferences.models = str(folder)
settings.chosen, settings.way = str(broken), "AUTO"
damaged = message(bpy.ops.solidtex.make_material)
preferences.programs, preferences.models = str(folder / "empty"), ""
module("settings").refresh()
found = {"unsaved": unsaved, "damaged": damaged, "missing": message(bpy.ops.solidtex.make_material)}
bpy.ops.preferences.addon_disable(module=NAME)
found["disabled"] = not hasattr(bpy.types.Scene, "solidtex")
""",
        folder,
    )
    expected = "Save the .blend file first" if HAS_VOLUMES else "volumes need Blender 5.0 or later"
    assert expected in found["unsaved"]
    assert "broken.solidtex" in found["damaged"]
    assert "solidtex-bake" in found["missing"] and "Preferences" in found["missing"]
    assert str(folder / "empty") in found["missing"] and found["disabled"]


@needs_bpy
def test_a_model_that_is_gone_is_not_replaced_by_another(folder: Path) -> None:
    found = blender(
        """
settings.way = "VERTICES"
shown = []
for settings.chosen in ("", "/elsewhere/granite-grey.solidtex", "granite-grey.v2"):
    shown.append(Path(settings.model).stem)
found = {"shown": shown, "gone": message(bpy.ops.solidtex.make_material),
         "materials": len(ball.data.materials)}
""",
        folder,
    )
    assert found["shown"] == ["marble", "granite-grey", ""]
    assert "Found no model granite-grey.v2 in " in found["gone"] and found["materials"] == 0


UNUSABLE = {
    "edges": ("found a mesh without faces",),
    "tiny": ("2e-09 units wide", "Make the mesh larger", "fewer Texels"),
    "huge": ("2e+12 units wide", "Make the mesh smaller", "more Texels"),
    "far": ("texels from the object's origin", "Origin to Geometry"),
    "nan": ("found 1 of 8 vertices", "are no numbers"),
}
WAYS = ("AUTO", "OSL", "IMAGES", "VERTICES", "VOLUME")


@needs_bpy
def test_meshes_without_a_place_in_a_solid_are_refused_by_name_in_every_way(folder: Path) -> None:
    found = blender(
        f"""
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
def cube(name, factor=1.0, move=0.0):
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.name = name
    for vertex in bpy.context.object.data.vertices:
        vertex.co = [factor * number + move for number in vertex.co]
    return bpy.context.object
edges = bpy.data.objects.new("edges", bpy.data.meshes.new("edges"))
edges.data.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
bpy.context.collection.objects.link(edges)
cube("tiny", 1e-9), cube("huge", 1e12), cube("far", 1, 1e6)
cube("nan").data.vertices[3].co.x = math.nan
settings.chosen = "granite-grey"
found = {{}}
for name in {tuple(UNUSABLE)}:
    settings.texels = 1e4 if name == "far" else 64
    bpy.context.view_layer.objects.active = bpy.data.objects[name]
    found[name] = []
    for settings.way in {WAYS}:
        found[name].append(message(bpy.ops.solidtex.make_material))
        found[name].append(bpy.context.mode)
bpy.data.meshes[bpy.data.objects["nan"].data.name].validate()
settings.way = "VERTICES"
found["validated"] = message(bpy.ops.solidtex.make_material)
""",
        folder,
    )
    assert found.pop("validated") is None
    for name, parts in UNUSABLE.items():
        assert set(found[name][1::2]) == {"OBJECT"}
        for said in found[name][::2]:
            assert said.startswith(f"Error: {name}: ") and all(part in said for part in parts)


@needs_bpy
def test_an_unwrap_that_fails_ends_in_object_mode(folder: Path) -> None:
    found = blender(
        """
def fails(**_others):
    raise RuntimeError("no unwrap")
atlas = module("solidtex_atlas")
atlas.bpy = type("", (), {"context": bpy.context, "ops": type("", (), {
    "object": bpy.ops.object, "mesh": bpy.ops.mesh,
    "uv": type("", (), {"smart_project": staticmethod(fails)})})})
found = {"said": message(lambda: atlas.unwrap(ball)), "mode": bpy.context.mode}
""",
        folder,
    )
    assert found == {"said": "no unwrap", "mode": "OBJECT"}


@needs_volumes
def test_too_large_a_volume_is_refused_with_the_advice_of_the_panel(folder: Path) -> None:
    found = blender(
        """
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
settings.chosen, settings.way = "granite-grey", "VOLUME"
found = []
for settings.texels in (20000, 2e6):
    found.append(message(bpy.ops.solidtex.make_material))
""",
        folder,
    )
    memory, edge = found
    assert "Sphere: a volume of 20004 x " in memory and " voxels needs " in memory
    assert "of memory" in memory and "Choose fewer Texels, now 20000" in memory
    assert ".zarr" not in memory and str(folder) not in memory
    assert "expected at most 1048576 along an edge. Choose fewer Texels, now 2e+06" in edge


@needs_bpy
def test_a_missing_plugin_is_named_by_its_preference(folder: Path) -> None:
    found = blender(
        """
settings.chosen, settings.way = "granite-grey", "OSL"
found = []
for preferences.plugin in ("", str(folder / "nowhere")):
    found.append(message(bpy.ops.solidtex.make_material))
""",
        folder,
    )
    for said, value in zip(found, ("nothing", f"{folder / 'nowhere'} without"), strict=True):
        assert (
            f"OpenImageIO plugin, in Edit > Preferences > Add-ons > Solidtex: found {value}" in said
        )
        assert "OIIO_LIBRARY_PATH" not in said and "?size" not in said
