"""The panel in the sidebar of the 3D view."""

from __future__ import annotations

import bpy

from . import ways
from .operators import Run
from .programs import ProgramError, find


class SOLIDTEX_PT_material(bpy.types.Panel):
    bl_label = "Solid texture"
    bl_idname = "SOLIDTEX_PT_material"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Solidtex"

    def draw(self, context: bpy.types.Context) -> None:
        layout, settings = self.layout, context.scene.solidtex
        layout.use_property_split = True
        try:
            find("solidtex-bake")
        except ProgramError:
            layout.label(text="solidtex-bake was not found", icon="ERROR")
            layout.operator("preferences.addon_show", text="Preferences").module = __package__
            return
        layout.template_icon_view(settings, "model", show_labels=True)
        row = layout.row(align=True)
        row.prop(settings, "model", text="Model")
        row.operator("solidtex.refresh_models", text="", icon="FILE_REFRESH")
        for name in ("seed", "texels", "rotation", "way"):
            layout.prop(settings, name)
        if settings.way in ("AUTO", "IMAGES"):
            layout.prop(settings, "resolution")
        if settings.way == "VOLUME":
            layout.prop(settings, "subdivide")
            self._show_volume(context)
        if Run.active is None:
            layout.operator("solidtex.make_material", icon="MATERIAL")
            return
        layout.progress(factor=Run.active.progress, text=f"{Run.active.progress:.0%}")
        layout.operator("solidtex.cancel", icon="CANCEL")

    def _show_volume(self, context: bpy.types.Context) -> None:
        target = context.active_object
        if target is None or target.type != "MESH":
            return
        settings = context.scene.solidtex
        try:
            scale = ways.texels_per_unit(target, settings)
        except (ProgramError, ValueError):
            return  # making the material says what is wrong
        x, y, z = ways.volume_box(target, scale, tuple(settings.rotation))[1]
        self.layout.label(text=f"{x} x {y} x {z} voxels, {x * y * z / 1e6:.1f} million")


CLASSES = (SOLIDTEX_PT_material,)
