"""Blender extension: solid textures as materials, from a panel in the sidebar of the 3D view."""

from __future__ import annotations

import bpy

from . import operators, panel, settings

CLASSES = (*settings.CLASSES, *operators.CLASSES, *panel.CLASSES)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.solidtex = bpy.props.PointerProperty(type=settings.Settings)
    settings.announce_plugin()


def unregister() -> None:
    operators.cancel_all()
    settings.forget_thumbnails()
    del bpy.types.Scene.solidtex
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
