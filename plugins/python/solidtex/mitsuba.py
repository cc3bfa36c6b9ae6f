"""Solid textures in Mitsuba 3: after `import solidtex.mitsuba` there is a texture "solidtex".

    import mitsuba as mi
    import solidtex.mitsuba

    mi.set_variant("llvm_ad_rgb")
    stone = {"type": "solidtex", "model": "granite-grey", "texels_per_unit": 90.0}
    bsdf = mi.load_dict({"type": "diffuse", "reflectance": stone})

It works in variants with RGB or monochromatic colors, scalar or not, also where the variant is set
later or changed. docs/hosts/mitsuba.md lists its parameters.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from solidtex.arguments import Floats
from solidtex.errors import Error, InvalidArgument
from solidtex.texture import CACHE_LIMIT, Texture

mi: Any = importlib.import_module("mitsuba")
dr: Any = importlib.import_module("drjit")

ALBEDO = ("albedo.r", "albedo.g", "albedo.b")
LARGEST_ALBEDO = 0.999  # as in solidtex-render: all that comes in never leaves again
LUMINANCE = np.array([0.212671, 0.715160, 0.072169])  # of linear sRGB


class Lookup:
    """Lookup of one texture of a scene in NumPy, independent of variants and their types."""

    def __init__(self, props: Any) -> None:
        self.model = _model(props)
        self.texture = Texture(
            self.model,
            _whole(props, "seed", 0),
            props.get("precision", "full"),
            _whole(props, "cache_limit", CACHE_LIMIT),
        )
        channel = props.get("channel", "albedo")
        self.is_color = channel == "albedo"
        self.channels = self._indices(ALBEDO if self.is_color else (channel,))
        scale = np.diag(_texels_per_unit(props))
        to_world = props.get("to_world", None)
        matrix = np.eye(4) if to_world is None else np.array(to_world.matrix, float).reshape(4, 4)
        to_object = np.linalg.inv(matrix)
        self._linear = (scale @ to_object[:3, :3]).T
        self._offset = scale @ to_object[:3, 3]

    def _indices(self, names: tuple[str, ...]) -> list[int]:
        there = self.texture.channels
        for name in names:
            if name not in there:
                raise ValueError(
                    f"solidtex: channel: found no {name!r} in {self.model}, expected one of"
                    f" {', '.join(there)}"
                )
        return [there.index(name) for name in names]

    def at(self, points: np.ndarray[Any, Any]) -> Floats:
        """Evaluate points [n, 3] in world space: linear colors [n, 3] or plain numbers [n, 1]."""
        places = (points @ self._linear + self._offset).astype(np.float32)
        return self._shown(self.texture.eval_points(places))

    def mean(self) -> Floats:
        """Mean of the material, in the same form."""
        (mean,) = self._shown(self.texture.mean()[None])
        found: Floats = mean
        return found

    def _shown(self, values: Floats) -> Floats:
        values = values[:, self.channels]
        if not self.is_color:
            return values
        if self.texture.color_space == "srgb":
            values = decoded(values)
        shown: Floats = np.clip(values, 0, LARGEST_ALBEDO)
        return shown


def _model(props: Any) -> str:
    model = props.get("model", None)
    if not isinstance(model, str):
        found = "nothing" if model is None else repr(model)
        raise InvalidArgument(f"model: found {found}, expected a path or the name of a model")
    return model


def _whole(props: Any, name: str, default: int) -> int:
    value = props.get(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or value != value // 1:
        raise InvalidArgument(f"{name}: found {value!r}, expected a whole number")
    return int(value)


def _texels_per_unit(props: Any) -> np.ndarray[Any, Any]:
    value = props.get("texels_per_unit", 1.0)
    try:
        scale = np.broadcast_to(np.array(None if isinstance(value, str) else value, float), 3)
    except (TypeError, ValueError):
        scale = np.zeros(3)
    if not (np.isfinite(scale) & (scale > 0)).all():
        raise InvalidArgument(
            f"texels_per_unit: found {value}, expected one positive number or three"
        )
    return scale


def decoded(values: Floats) -> Floats:
    """Decode sRGB values to linear light."""
    low = np.clip(values, 0, None)
    light: Floats = np.where(low <= 0.04045, low / 12.92, ((low + 0.055) / 1.055) ** 2.4)
    return light.astype(np.float32)


def _lanes(lookup: Lookup, si: Any, active: Any) -> Any:
    """Values [n, channels] for the lanes of an interaction, zero for inactive lanes."""
    if dr.flag(dr.JitFlag.SymbolicScope):
        raise RuntimeError(
            "solidtex: found a symbolic loop or call, expected evaluated ones: switch"
            " JitFlag.SymbolicLoops and JitFlag.SymbolicCalls of drjit off on this thread"
        )
    points = np.array(si.p).T
    there = np.isfinite(points).all(axis=1) & np.array(active)
    values = np.zeros((len(points), len(lookup.channels)), np.float32)
    values[there] = lookup.at(points[there])
    return values.T


def _one(lookup: Lookup, si: Any, active: Any) -> Any:
    p = si.p
    return lookup.at(np.array([[p.x, p.y, p.z]]))[0] if active else np.zeros(len(lookup.channels))


def _texture_class() -> type:
    """Texture class of the current variant."""
    scalar = not dr.is_jit_v(mi.Float)
    values = _one if scalar else _lanes

    class SolidTexture(mi.Texture):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            if mi.is_spectral:
                raise ValueError(
                    f"solidtex: found the variant {mi.variant()}, expected one of RGB or mono"
                )
            try:
                self.lookup = Lookup(props)
            except Error as error:
                raise ValueError(f"solidtex: {error}") from error

        def eval(self, si: Any, active: Any = True) -> Any:
            found = values(self.lookup, si, active)
            if not self.lookup.is_color:
                return mi.UnpolarizedSpectrum(mi.Float(found[0]))
            if mi.is_monochromatic:
                gray = (LUMINANCE @ found).astype(np.float32)
                return mi.UnpolarizedSpectrum(float(gray) if scalar else mi.Float(gray))
            return self._color(found)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            found = values(self.lookup, si, active)
            weights = LUMINANCE if self.lookup.is_color else np.ones(1)
            number = weights @ found
            return float(number) if scalar else mi.Float(number.astype(np.float32))

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return self._color(values(self.lookup, si, active))

        def mean(self) -> Any:
            found = self.lookup.mean()
            return mi.Float(float(LUMINANCE @ found if self.lookup.is_color else found[0]))

        def is_spatially_varying(self) -> bool:
            return True

        def to_string(self) -> str:
            return f"SolidTexture[{self.lookup.texture!r}]"

        def _color(self, found: Any) -> Any:
            red, green, blue = found if self.lookup.is_color else (found[0],) * 3
            if scalar:
                return mi.Color3f(float(red), float(green), float(blue))
            return mi.Color3f(mi.Float(red), mi.Float(green), mi.Float(blue))

    return SolidTexture


def register(*_: Any) -> None:
    """Register the texture with the current variant; importing this module calls it.

    In compiled variants, loops and calls of this thread are evaluated eagerly from now on: symbolic
    ones have no values to look up. (Flags belong to threads, and many threads load scenes.)
    """
    if dr.is_jit_v(mi.Float):
        dr.set_flag(dr.JitFlag.SymbolicLoops, False)
        dr.set_flag(dr.JitFlag.SymbolicCalls, False)
    texture = _texture_class()
    mi.register_texture("solidtex", lambda props: texture(props))


mi.detail.add_variant_callback(register)
if mi.variant() is not None:
    register()
