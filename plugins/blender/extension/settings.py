"""Preferences of the extension, the settings of a scene, and the models with their thumbnails."""

from __future__ import annotations

import contextlib
import os
import zlib
from pathlib import Path

import bpy
import bpy.utils.previews

from . import programs, solidtex_osl

SHIPPED_THUMBNAILS = Path(__file__).resolve().parent / "thumbnails"
DEFAULT_MODEL = "marble"
PLUGIN = "solidtex.imageio.so"
NO_MODEL = -1  # the menu shows nothing
WAYS = (
    ("AUTO", "Automatic", "At every hit where this Blender can, otherwise images"),
    ("OSL", "At every hit", "Nothing is baked: Cycles with OSL, and the OpenImageIO plugin"),
    (
        "IMAGES",
        "Images",
        "Baked to images of the UV atlas; normals if the model has height",
    ),
    ("VERTICES", "Vertex colors", "Baked to the vertices; detail ends at their spacing"),
    ("VOLUME", "Volume", "Baked to a .vdb file; the mesh may still be modelled (Blender 5)"),
)
_thumbnails = bpy.utils.previews.new()
# Blender keeps no reference to the texts of a menu.
_items: list[tuple[str, str, str, int, int]] = []


# Blender evaluates annotations outside of this module, so they hold no lambda.
def _models_changed(_preferences: Preferences, _context: bpy.types.Context) -> None:
    refresh()


def _plugin_changed(_preferences: Preferences, _context: bpy.types.Context) -> None:
    announce_plugin()


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    programs: bpy.props.StringProperty(
        name="Programs", subtype="DIR_PATH",
        description="Folder with solidtex-bake; empty: searched where programs are installed",
    )  # fmt: skip
    models: bpy.props.StringProperty(
        name="My models", subtype="DIR_PATH", update=_models_changed,
        description="Folder with .solidtex files of your own",
    )  # fmt: skip
    plugin: bpy.props.StringProperty(
        name="OpenImageIO plugin", subtype="DIR_PATH",
        update=_plugin_changed,
        description="Folder with a solidtex.imageio.so built for this Blender",
    )  # fmt: skip

    def draw(self, _context: bpy.types.Context) -> None:
        for name in ("programs", "models", "plugin"):
            self.layout.prop(self, name)
        try:
            self.layout.label(text=f"Found {programs.find('solidtex-bake')}")
        except programs.ProgramError as error:
            self.layout.label(text=str(error), icon="ERROR")


def announce_plugin() -> None:
    """Tell Blender's OpenImageIO where the plugin is, so that saved scenes render after a start."""
    folder = programs.preferences().plugin
    if not folder or not Path(bpy.path.abspath(folder), PLUGIN).is_file():
        return
    with contextlib.suppress(ImportError):
        solidtex_osl.find_modules_of_blender()
        import OpenImageIO  # Blender's own

        known = OpenImageIO.get_string_attribute("plugin_searchpath").split(":")
        paths = dict.fromkeys([bpy.path.abspath(folder), *filter(None, known)])
        OpenImageIO.attribute("plugin_searchpath", ":".join(paths))


def model_folders() -> list[Path]:
    """Folders with models: one's own, those of SOLIDTEX_MODEL_PATH, and beside the programs."""
    own = programs.preferences().models
    found = [Path(bpy.path.abspath(own))] if own else []
    found += [Path(p) for p in os.environ.get("SOLIDTEX_MODEL_PATH", "").split(":") if p]
    for folder in programs.folders():
        if (folder / "solidtex-bake").is_file():
            found.append(folder.resolve().parent / "share" / "solidtex" / "models")
    return list(dict.fromkeys(found))


def models() -> list[Path]:
    """Models by name; the first folder wins."""
    found: dict[str, Path] = {}
    for folder in model_folders():
        for path in sorted(folder.glob("*.solidtex")):
            if path.is_file():
                found.setdefault(path.stem, path)
    return [found[name] for name in sorted(found)]


def thumbnail_to_make(model: Path) -> Path:
    """Where the extension keeps the thumbnail of a model that it has none of."""
    folder = bpy.utils.extension_path_user(__package__, path="thumbnails", create=True)
    stamp = f"{model.resolve()} {model.stat().st_mtime_ns}"
    return Path(folder) / f"{model.stem}-{zlib.crc32(stamp.encode()):08x}.png"


def thumbnail(model: Path) -> Path | None:
    """The picture of a model: shipped for shipped models, or made before."""
    shipped = SHIPPED_THUMBNAILS / f"{model.stem}.jpg"
    is_own = programs.preferences().models and model.parent == model_folders()[0]
    made = thumbnail_to_make(model)
    candidates = (made,) if is_own else (shipped, made)
    return next((path for path in candidates if path.is_file()), None)


def _icon(model: Path) -> int:
    picture = thumbnail(model)
    if picture is None:
        return 0
    key = str(picture)
    if key not in _thumbnails:
        _thumbnails.load(key, key, "IMAGE")
    return _thumbnails[key].icon_id


def refresh() -> None:
    """Look for models again."""
    _items.clear()
    for number, model in enumerate(models()):
        _items.append((str(model), model.stem, str(model), _icon(model), number))


def forget_thumbnails() -> None:
    _items.clear()
    _thumbnails.clear()


def _model_items(_self: Settings, _context: bpy.types.Context | None) -> list:
    if not _items:
        refresh()
    return _items


def number_of_model(settings: Settings) -> int | None:
    """The chosen model, by name if it has moved. Without a choice, the default or the first."""
    items = _model_items(settings, None)
    chosen = settings.chosen
    name = Path(chosen).name.removesuffix(".solidtex")
    for wanted in (chosen, name) if chosen else (DEFAULT_MODEL,):
        for path, stem, _, _, number in items:
            if wanted in (path, stem):
                return number
    return None if chosen or not items else 0


def _shown_model(settings: Settings) -> int:
    number = number_of_model(settings)
    return NO_MODEL if number is None else number


def _choose_model(settings: Settings, number: int) -> None:
    settings.chosen = _model_items(settings, None)[number][0]


class Settings(bpy.types.PropertyGroup):
    """What the next material is made of."""

    chosen: bpy.props.StringProperty(options={"HIDDEN"})
    # The list may change between sessions, so a scene stores the path.
    model: bpy.props.EnumProperty(
        name="Model", items=_model_items, get=_shown_model, set=_choose_model,
        description="Material, learned from a photograph",
    )  # fmt: skip
    seed: bpy.props.IntProperty(name="Seed", min=0, description="Which piece of the material")
    texels: bpy.props.FloatProperty(
        name="Texels", default=solidtex_osl.EXTENT, min=1, soft_max=4096,
        description="Texels along the longest side of the object. Fewer show larger features",
    )  # fmt: skip
    rotation: bpy.props.FloatVectorProperty(
        name="Orientation", subtype="EULER", description="Turns the object within the material"
    )
    way: bpy.props.EnumProperty(
        name="Way", items=WAYS, description="How Blender shows the material"
    )
    resolution: bpy.props.IntProperty(
        name="Resolution",
        default=2048,
        min=16,
        max=16384,
        description="Edge of the images, in texels",
    )
    subdivide: bpy.props.IntProperty(
        name="Subdivide", min=0, max=6,
        description="Cut faces into four, so often, before vertices look the volume up",
    )  # fmt: skip


CLASSES = (Preferences, Settings)
