"""An open model and the two questions that it answers."""

from __future__ import annotations

import json
import operator
import os
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, Protocol, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solidtex import _engine
from solidtex.errors import InvalidArgument

Floats = NDArray[np.float32]
Precision = Literal["full", "fast"]

PRECISIONS = ("full", "fast")
CACHE_LIMIT = 256 << 20
LARGEST_UNSIGNED = (1 << 64) - 1


class SupportsDLPack(Protocol):
    """An array of another library, such as a tensor of PyTorch in the memory of the CPU."""

    def __dlpack__(self, *, stream: Any = ...) -> Any: ...
    def __dlpack_device__(self) -> tuple[Any, int]: ...


Out = TypeVar("Out", bound=SupportsDLPack)


class Statistics(NamedTuple):
    """What a texture has done so far; those of bricks are zero for the sampler family."""

    points: int
    """Points answered, with footprints or without."""
    voxels: int
    """Voxels of boxes answered."""
    hits: int
    """Bricks found in the cache."""
    misses: int
    """Bricks computed."""
    bricks: int
    """Different bricks computed: fewer than misses where the limit made it forget some."""
    brick_nanoseconds: int
    """Time spent computing bricks, added up over the threads."""
    resident_bytes: int
    """Held by the cache now."""
    peak_bytes: int
    """Most ever held."""


class Texture:
    """An open model.

    Any number of threads may query one texture at once; queries release the interpreter's lock and
    run on oneTBB's threads. Arrays that a query reads or writes must be left alone until it
    returns. Ctrl-C stops a query of the main thread within a fraction of a second; what it wrote
    until then is to be thrown away. Textures can be pickled, if they were opened by path or name.

    Errors are those of solidtex.errors; each is also the built-in that one expects (ValueError,
    OSError, MemoryError).
    """

    def __init__(
        self,
        model: str | os.PathLike[str],
        seed: int = 0,
        precision: Precision = "full",
        cache_limit: int = CACHE_LIMIT,
        threads: int = 0,
    ) -> None:
        """Opens a model.

        model: path of a .solidtex file, or the bare name of a shipped model ("granite-grey"),
            looked up in the folders of SOLIDTEX_MODEL_PATH, then among those installed.
        seed: which of the endless variants of the material, 0 to 2**64 - 1.
        precision: "full" is float32 throughout. "fast" is for pictures of 8 bits: more than twice
            as fast for the sampler family on processors with AMX, elsewhere the same as full.
        cache_limit: bytes that the cache of bricks may hold (lattice family).
        threads: how many of them run queries, 1 to 1024; 0 for as many as there are cores. With a
            number a query may run on another thread than the one that asks, where Ctrl-C cannot
            stop it.
        """
        encoded = os.fsencode(model)
        if b"\0" in encoded:
            raise InvalidArgument(f"model: found a null byte in {model!r}, expected none")
        self._options = _options(seed, precision, cache_limit, threads)
        self._engine = _engine.Texture(encoded, *self._options)

    @classmethod
    def from_bytes(
        cls,
        data: bytes,
        seed: int = 0,
        precision: Precision = "full",
        cache_limit: int = CACHE_LIMIT,
        threads: int = 0,
    ) -> Texture:
        """Opens the content of a .solidtex file, which is copied."""
        texture = cls.__new__(cls)
        texture._options = _options(seed, precision, cache_limit, threads)
        texture._engine = _engine.Texture.from_bytes(data, *texture._options)
        return texture

    @property
    def name(self) -> str:
        """What the material is called."""
        return self._engine.name

    @property
    def path(self) -> str:
        """The file, "" for one opened from bytes."""
        return self._engine.path

    @property
    def family(self) -> Literal["field", "sampler"]:
        """field: evaluated in blocks, points are interpolated. sampler: exact at every point."""
        return "sampler" if self._engine.family == "sampler" else "field"

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the channels in their order: albedo.r, albedo.g, albedo.b, roughness ..."""
        return tuple(self._engine.channels)

    @property
    def color_space(self) -> str:
        """How albedo is encoded: srgb, linear or data. Other channels are plain numbers."""
        return self._engine.color_space

    @property
    def seed(self) -> int:
        """As opened."""
        return self._options[0]

    @property
    def precision(self) -> Precision:
        """As opened."""
        return self._options[1]

    @property
    def metadata(self) -> dict[str, Any]:
        """The document of the model: docs/file-format.md says what is in it."""
        document: dict[str, Any] = json.loads(self._engine.metadata_json)
        return document

    @property
    def parameter_count(self) -> int:
        """Numbers stored in the file."""
        return self._engine.parameter_count

    @overload
    def eval_points(
        self,
        points: ArrayLike | SupportsDLPack,
        origin: Sequence[float] | NDArray[Any] = ...,
        *,
        radii: ArrayLike | SupportsDLPack | None = ...,
        axes: ArrayLike | SupportsDLPack | None = ...,
        out: None = ...,
    ) -> Floats: ...

    @overload
    def eval_points(
        self,
        points: ArrayLike | SupportsDLPack,
        origin: Sequence[float] | NDArray[Any] = ...,
        *,
        radii: ArrayLike | SupportsDLPack | None = ...,
        axes: ArrayLike | SupportsDLPack | None = ...,
        out: Out,
    ) -> Out: ...

    def eval_points(
        self,
        points: ArrayLike | SupportsDLPack,
        origin: Sequence[float] | NDArray[Any] = (0.0, 0.0, 0.0),
        *,
        radii: ArrayLike | SupportsDLPack | None = None,
        axes: ArrayLike | SupportsDLPack | None = None,
        out: Any = None,
    ) -> Any:
        """The values at origin + points.

        points: [..., 3] in texels, rounded to float32 (no copy is made of contiguous float32).
            Far from zero give an origin, so that the sum, which is in double precision, stays
            exact; positions may be up to 2**30 texels away.
        origin: three numbers, in texels.
        radii: None for points; else footprints, in texels: for each point the mean over a cube
            whose edge is twice its radius, from 0 (the point) to infinity (the mean of the
            material). One number, or [...] as many as there are points.
        axes: instead of radii, footprints that are longer one way than another: [..., 3, 3] for
            each point, or [3, 3] for all, the three half-edges of a parallelepiped in texels, each
            of them a row (x, y, z). Zeros make it flat, a line or a point.
        out: where to write, an array [..., channel] of NumPy or of anything with DLPack (a tensor
            of PyTorch): float32, contiguous, in the memory of the CPU. None for a new array.

        Returns out, or a new NumPy array: float32 [..., channel] in the file's color space, not
        clamped.
        """
        query = _query(points, origin, radii, axes)
        values = _target(out, (*query[0].shape[:-1], len(self.channels)))
        self._engine.eval_points(*query, values)
        return values

    def eval_gradients(
        self,
        points: ArrayLike | SupportsDLPack,
        origin: Sequence[float] | NDArray[Any] = (0.0, 0.0, 0.0),
        *,
        radii: ArrayLike | SupportsDLPack | None = None,
        axes: ArrayLike | SupportsDLPack | None = None,
    ) -> tuple[Floats, Floats]:
        """The values at origin + points, and how they change along x, y and z.

        The arguments are those of eval_points. Everything is in full precision.

        Returns two new arrays: float32 [..., channel], as eval_points returns them, and float32
        [..., channel, 3], their exact derivatives by x, y and z, in values a texel. Values have
        edges, where a derivative is that of one side.
        """
        query = _query(points, origin, radii, axes)
        values = np.empty((*query[0].shape[:-1], len(self.channels)), np.float32)
        gradients = np.empty((*values.shape, 3), np.float32)
        self._engine.eval_points(*query, values, gradients)
        return values, gradients

    @overload
    def eval_box(
        self, origin: Sequence[int], size: Sequence[int], *, out: None = ...
    ) -> Floats: ...

    @overload
    def eval_box(self, origin: Sequence[int], size: Sequence[int], *, out: Out) -> Out: ...

    def eval_box(self, origin: Sequence[int], size: Sequence[int], *, out: Any = None) -> Any:
        """The voxels [origin, origin + size) at their centres.

        origin: three whole numbers, in texels.
        size: three whole numbers, 0 or more.
        out: as for eval_points, an array [x, y, z, channel].

        Returns out, or a new NumPy array: float32 [x, y, z, channel] in the file's color space, not
        clamped. A box of any size has the same bits as its parts.
        """
        corner = _triple("origin", origin, operator.index)
        extent = _triple("size", size, operator.index)
        if min(extent) < 0:
            raise InvalidArgument(f"size: found {extent}, expected numbers of 0 or more")
        values = _target(out, (*extent, len(self.channels)))
        self._engine.eval_box(corner, extent, values)
        return values

    def mean(self) -> Floats:
        """The mean of the material [channel], that of an infinite footprint.

        It is measured when first asked for, which takes some tenths of a second; albedo in sRGB is
        averaged as light.
        """
        mean: Floats = self.eval_points(np.zeros(3, np.float32), radii=np.inf)
        return mean

    def statistics(self) -> Statistics:
        """What the texture has done so far."""
        return Statistics(*self._engine.statistics())

    def close(self) -> None:
        """Frees the model, when the queries that run have ended. Closing twice is allowed."""
        self._engine.close()

    def __enter__(self) -> Texture:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __repr__(self) -> str:
        try:
            return f"<solidtex.Texture {self.name!r} of {', '.join(self.channels)}>"
        except InvalidArgument:
            return "<solidtex.Texture, closed>"

    def __reduce__(self) -> tuple[Any, ...]:
        if not self.path:
            raise TypeError("a texture opened from bytes cannot be pickled")
        return Texture, (self.path, *self._options)


def _options(
    seed: int, precision: Precision, cache_limit: int, threads: int
) -> tuple[int, Precision, int, int]:
    if precision not in PRECISIONS:
        raise InvalidArgument(f"precision: found {precision!r}, expected one of {PRECISIONS}")
    return (
        _unsigned("seed", seed),
        precision,
        _unsigned("cache_limit", cache_limit),
        _unsigned("threads", threads),
    )


def _unsigned(name: str, value: int) -> int:
    number = operator.index(value)
    if not 0 <= number <= LARGEST_UNSIGNED:
        raise InvalidArgument(f"{name}: found {number}, expected 0 to 2**64 - 1")
    return number


def _triple(name: str, values: Any, kind: Any) -> tuple[Any, Any, Any]:
    try:
        x, y, z = (kind(value) for value in values)
    except (TypeError, ValueError) as error:
        expected = "numbers" if kind is float else "whole numbers"
        raise InvalidArgument(f"{name}: found {values!r}, expected three {expected}") from error
    return x, y, z


def _floats(name: str, values: Any) -> Floats:
    """Contiguous float32 without a copy where it is that already."""
    try:
        if hasattr(values, "__dlpack__") and not isinstance(values, np.ndarray):
            values = np.from_dlpack(values)
        return np.ascontiguousarray(values, dtype=np.float32).reshape(np.shape(values))
    except (TypeError, ValueError, BufferError, RuntimeError) as error:
        raise InvalidArgument(f"{name}: found {type(values).__name__}: {error}") from error


def _query(points: Any, origin: Any, radii: Any, axes: Any) -> tuple[Floats, Any, Any, Any]:
    """What the engine takes: places, their origin, and radii or axes or neither."""
    places = _floats("points", points)
    if places.ndim == 0 or places.shape[-1] != 3:
        raise InvalidArgument(f"points: found shape {places.shape}, expected (..., 3)")
    shape = places.shape[:-1]
    if radii is not None and axes is not None:
        raise InvalidArgument("radii, axes: found both, expected one of them")
    sizes = None if radii is None else _footprints("radii", radii, shape, ())
    edges = None if axes is None else _footprints("axes", axes, shape, (3, 3))
    return places, _triple("origin", origin, float), sizes, edges


def _footprints(name: str, found: Any, shape: tuple[int, ...], each: tuple[int, ...]) -> Floats:
    """Of the shape `each` for every point of `shape`; one for all is repeated."""
    sizes = _floats(name, found)
    if sizes.shape == each and shape:
        return np.ascontiguousarray(np.broadcast_to(sizes, (*shape, *each)))
    if sizes.shape != (*shape, *each):
        one = each or "one number"
        raise InvalidArgument(
            f"{name}: found shape {sizes.shape}, expected {one} or {(*shape, *each)}"
        )
    return sizes


def _target(out: Any, shape: tuple[int, ...]) -> Any:
    if out is None:
        return np.empty(shape, np.float32)
    if not hasattr(out, "__dlpack__"):
        raise InvalidArgument(f"out: found {type(out).__name__}, expected an array")
    if tuple(out.shape) != shape:
        raise InvalidArgument(f"out: found shape {tuple(out.shape)}, expected {shape}")
    if isinstance(out, np.ndarray) and not out.flags.writeable:
        raise InvalidArgument("out: found a read-only array, expected one that can be written")
    return out
