"""Space: a network that has learned many materials. A photograph becomes a texture at once."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from solidtex import _engine
from solidtex.arguments import Floats, floats
from solidtex.errors import InvalidArgument
from solidtex.texture import CACHE_LIMIT, Precision, Texture

Patches = Literal["average", "medoid"]
PATCHES = ("average", "medoid")


@dataclass(frozen=True, eq=False)
class Material:
    """Material of a space."""

    code: Floats
    """Numbers z, [code size]."""
    colors: Floats | None = None
    """Rows of [basis | mean], [3, 4]; None where the space has no colors."""


class Space:
    """Open texture space. Any number of threads may use it.

        stones = solidtex.Space("stones")
        texture = stones.texture(stones.encode(pixels), seed=7)

    Exceptions are those of solidtex.errors.
    """

    def __init__(self, space: str | os.PathLike[str]) -> None:
        """Open a space.

        space: Path of a .solidtex-space file, or bare name of a space ("stones"), which is looked
            up where models are.
        """
        self._engine = _engine.Space(_path("space", space))

    @property
    def name(self) -> str:
        """Name of the space."""
        return self._engine.name

    @property
    def path(self) -> str:
        """Path of the file."""
        return os.fsdecode(self._engine.path)

    @property
    def sha256(self) -> str:
        """SHA-256 of the file, which models record."""
        return self._engine.sha256

    @property
    def metadata(self) -> dict[str, Any]:
        """Metadata document of the space. See docs/space-format.md."""
        document: dict[str, Any] = json.loads(self._engine.metadata_json)
        return document

    @property
    def family(self) -> Literal["lattice", "sampler", "none"]:
        """Family of the models of the space; that of an encoder alone is "none"."""
        return cast(Literal["lattice", "sampler", "none"], self._engine.family)

    @property
    def code_size(self) -> int:
        """Number of values in a code."""
        return self._engine.code_size

    @property
    def has_colors(self) -> bool:
        """Whether a material has colors beside its code."""
        return self._engine.has_colors

    @property
    def patch_size(self) -> int:
        """Side of the encoder's patches in pixels: the least side of a photograph."""
        return self._engine.patch_size

    @property
    def resolution(self) -> int:
        """Photographs are reduced so that the shorter side has at most this many pixels."""
        return self._engine.resolution

    @property
    def photographs(self) -> tuple[str, ...]:
        """Names of the training photographs."""
        return tuple(self._engine.photographs)

    def photograph(self, index: int) -> Material:
        """Return the material of a training photograph."""
        count = len(self._engine.photographs)
        if not -count <= index < count:
            raise InvalidArgument(f"index: found {index}, expected less than {count}")
        return _material(self._engine.photograph(index % count))

    def encode(self, pixels: ArrayLike, patches: Patches = "average") -> Material:
        """Encode a photograph. Needs ONNX Runtime; raises Unavailable without it.

        pixels: Array [row, column, channel] of sRGB colors: floats from 0 to 1, or uint8.
        patches: "average" is the mean of the patches' codes, "medoid" the code of the patch that is
            nearest to all others.
        """
        if patches not in PATCHES:
            raise InvalidArgument(f"patches: found {patches!r}, expected one of {PATCHES}")
        found = np.asarray(pixels)
        values = floats("pixels", found / 255 if found.dtype == np.uint8 else found)
        if values.ndim != 3 or values.shape[2] != 3:
            raise InvalidArgument(f"pixels: found shape {values.shape}, expected (row, column, 3)")
        return _material(self._engine.encode(values, patches == "medoid"))

    def blend(self, materials: Sequence[Material], weights: Sequence[float]) -> Material:
        """Blend materials: codes, and means and covariances of colors, linearly.

        weights: One for each material. They are divided by their sum, which must be positive.
        """
        if len(materials) != len(weights) or not materials:
            found = f"{len(materials)} materials and {len(weights)} weights"
            raise InvalidArgument(
                f"materials, weights: found {found}, expected one of each or more"
            )
        parts = [self._checked(material) for material in materials]
        return _material(self._engine.blend(parts, [float(w) for w in weights]))

    def texture(
        self,
        material: Material,
        seed: int = 0,
        precision: Precision = "full",
        cache_limit: int = CACHE_LIMIT,
        threads: int = 0,
        details: Mapping[str, Any] | None = None,
    ) -> Texture:
        """Open the texture of a material.

        details: Keys name, license, exemplar and training of the model's document, each optional.

        The other arguments are those of Texture.
        """
        options = (seed, precision, cache_limit, threads)
        checked, encoded = self._checked(material), _details(details)
        return Texture._from_space(self._engine, checked, encoded, options)

    def write_model(
        self,
        material: Material,
        path: str | os.PathLike[str],
        details: Mapping[str, Any] | None = None,
    ) -> None:
        """Write a material as a .solidtex file. Replaces an existing file."""
        target = _path("path", path)
        self._engine.write_model(self._checked(material), _details(details), target)

    def _checked(self, material: Material) -> _engine.Material:
        code = floats("code", material.code)
        if code.shape != (self.code_size,):
            raise InvalidArgument(f"code: found shape {code.shape}, expected ({self.code_size},)")
        if not self.has_colors:
            return _engine.Material(code.tolist(), [])
        if material.colors is None:
            raise InvalidArgument("colors: found None, expected an array (3, 4)")
        colors = floats("colors", material.colors)
        if colors.shape != (3, 4):
            raise InvalidArgument(f"colors: found shape {colors.shape}, expected (3, 4)")
        return _engine.Material(code.tolist(), colors.ravel().tolist())

    def __repr__(self) -> str:
        return f"<solidtex.Space {self.name!r}, {len(self._engine.photographs)} photographs>"

    def __reduce__(self) -> tuple[Any, ...]:
        return Space, (self.path,)


def _material(found: _engine.Material) -> Material:
    colors = np.array(found.colors, np.float32).reshape(3, 4) if found.colors else None
    return Material(np.array(found.code, np.float32), colors)


def _path(name: str, path: str | os.PathLike[str]) -> bytes:
    encoded = os.fsencode(path)
    if b"\0" in encoded:
        raise InvalidArgument(f"{name}: found a null byte in {path!r}, expected none")
    return encoded


def _details(details: Mapping[str, Any] | None) -> bytes:
    try:
        return json.dumps(details, allow_nan=False).encode() if details else b""
    except (TypeError, ValueError) as error:
        raise InvalidArgument(f"details: found {error}, expected values of JSON") from error
