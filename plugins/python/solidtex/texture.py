"""Texture: an open model, evaluated at points and in boxes of voxels."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple, Protocol, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solidtex import _engine
from solidtex.arguments import Floats, checked, query, target, triple, unsigned, whole
from solidtex.errors import InvalidArgument

Precision = Literal["full", "fast"]
Progress = Callable[[float], object]

PRECISIONS = ("full", "fast")
CACHE_LIMIT = 256 << 20
MOST_THREADS = 1024


class SupportsDLPack(Protocol):
    """Array of another library, such as a PyTorch tensor in CPU memory."""

    def __dlpack__(self, *, stream: Any = ...) -> Any: ...
    def __dlpack_device__(self) -> tuple[Any, int]: ...


Out = TypeVar("Out", bound=SupportsDLPack)


class Statistics(NamedTuple):
    """Work that a texture has done so far. Brick counts are zero for the sampler family."""

    points: int
    """Points evaluated."""
    voxels: int
    """Voxels of boxes evaluated."""
    hits: int
    """Bricks found in the cache."""
    misses: int
    """Bricks computed."""
    bricks: int
    """Distinct bricks computed; less than misses if the cache evicted some that were needed."""
    brick_nanoseconds: int
    """Time spent computing bricks, summed over threads."""
    resident_bytes: int
    """Size of the cache now."""
    peak_bytes: int
    """Largest size of the cache."""
    scratch_bytes: int
    """Size of the queries' scratch memory now, most of it kept by threads for their next query."""
    peak_scratch_bytes: int
    """Largest size of the scratch memory."""


def models() -> list[str]:
    """Return the names that Texture() finds without a path, sorted.

    They lie in the folders of SOLIDTEX_MODEL_PATH and among the installed models.
    """
    return _engine.model_names().splitlines()


def load(
    model: str | os.PathLike[str],
    seed: int = 0,
    precision: Precision = "full",
    cache_limit: int = CACHE_LIMIT,
    threads: int = 0,
    period: int = 0,
) -> Texture:
    """Open a model: the same as Texture(model, ...)."""
    return Texture(model, seed, precision, cache_limit, threads, period)


class Texture:
    """Open model.

    Any number of threads may query one texture at once. A query releases the interpreter's lock and
    runs on oneTBB's threads. Leave the arrays of a query alone until it returns.

    Ctrl-C cancels a query of the main thread within a fraction of a second. Discard what it wrote.

    A texture that was opened by path or name can be pickled.

    Exceptions are those of solidtex.errors. Each also derives from the matching built-in:
    ValueError, OSError or MemoryError. An argument of a wrong type may raise TypeError instead.
    """

    def __init__(
        self,
        model: str | os.PathLike[str],
        seed: int = 0,
        precision: Precision = "full",
        cache_limit: int = CACHE_LIMIT,
        threads: int = 0,
        period: int = 0,
    ) -> None:
        """Open a model.

        model: Path of a .solidtex file, or bare name of a model ("granite-grey"). Names are looked
            up in the folders of SOLIDTEX_MODEL_PATH, then among the installed models.
        seed: Random seed, 0 to 2**64 - 1.
        precision: "full" is float32. "fast" is bfloat16 for the sampler family on processors with
            AMX, otherwise the same as "full".
        cache_limit: Memory bound of the brick cache in bytes (lattice family).
        threads: Number of threads that run queries, 1 to 1024. 0 means one per core. With a number
            a query may run on another thread than the caller's, where Ctrl-C cannot cancel it.
        period: The solid repeats after so many texels on every axis (lattice family), a multiple
            of the pitch of the model's coarsest level. 0 means never.
        """
        encoded = os.fsencode(model)
        if b"\0" in encoded:
            raise InvalidArgument(f"model: found a null byte in {model!r}, expected none")
        self._options = _options(seed, precision, cache_limit, threads, period)
        self._engine = _engine.Texture(encoded, *self._options)

    @classmethod
    def from_bytes(
        cls,
        data: bytes,
        seed: int = 0,
        precision: Precision = "full",
        cache_limit: int = CACHE_LIMIT,
        threads: int = 0,
        period: int = 0,
    ) -> Texture:
        """Open a model from the bytes of a .solidtex file. The bytes are copied."""
        texture = cls.__new__(cls)
        texture._options = _options(seed, precision, cache_limit, threads, period)
        texture._engine = _engine.Texture.from_bytes(data, *texture._options)
        return texture

    @classmethod
    def _from_space(
        cls,
        space: _engine.Space,
        material: _engine.Material,
        details: bytes,
        options: tuple[int, Precision, int, int],
    ) -> Texture:
        texture = cls.__new__(cls)
        texture._options = _options(*options)
        texture._engine = _engine.Texture.from_space(space, material, details, *texture._options)
        return texture

    @property
    def name(self) -> str:
        """Name of the material."""
        return self._engine.name

    @property
    def path(self) -> str:
        """Path of the file, "" for a model from bytes."""
        return self._engine.path

    @property
    def family(self) -> Literal["lattice", "sampler"]:
        """Family of the model: a lattice interpolates voxels, a sampler is exact at every point."""
        return "sampler" if self._engine.family == "sampler" else "lattice"

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels in order, such as albedo.r, albedo.g, albedo.b, roughness."""
        return tuple(self._engine.channels)

    @property
    def color_space(self) -> str:
        """Color space of the albedo: srgb, linear or data. Other channels are plain numbers."""
        return self._engine.color_space

    @property
    def seed(self) -> int:
        """Random seed."""
        return self._options[0]

    @property
    def precision(self) -> Precision:
        """Precision: full or fast."""
        return self._options[1]

    @property
    def period(self) -> int:
        """Period in texels, 0 for none."""
        return self._options[4]

    @property
    def metadata(self) -> dict[str, Any]:
        """Metadata document of the model. See docs/file-format.md."""
        document: dict[str, Any] = json.loads(self._engine.metadata_json)
        return document

    @property
    def parameter_count(self) -> int:
        """Number of float parameters in the file."""
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
        progress: Progress | None = ...,
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
        progress: Progress | None = ...,
    ) -> Out: ...

    def eval_points(
        self,
        points: ArrayLike | SupportsDLPack,
        origin: Sequence[float] | NDArray[Any] = (0.0, 0.0, 0.0),
        *,
        radii: ArrayLike | SupportsDLPack | None = None,
        axes: ArrayLike | SupportsDLPack | None = None,
        out: Any = None,
        progress: Progress | None = None,
    ) -> Any:
        """Evaluate the texture at origin + points.

        points: Array [..., 3] in texels. Contiguous float32 is not copied. All else, float64 too,
            is rounded to float32, which holds a hundredth of a texel up to 2**17 texels.
        origin: Three numbers in texels. The sum is in double precision: use an origin far from
            zero, and points near it. Positions reach 2**30 texels.
        radii: Footprints as cubes: half the edge in texels, one number or an array [...]. The value
            is the mean over the cube. 0 is the point itself, infinity the mean of the material.
        axes: Footprints as parallelepipeds: three half edges (x, y, z) in texels, an array [3, 3]
            or [..., 3, 3]. Axes of zeros make a parallelogram, a line or a point. Give radii or
            axes, not both.
        out: Array [..., channel] to write: float32, contiguous, in CPU memory, from NumPy or any
            library with DLPack. None creates one.
        progress: Function that is called about every 50 ms with the finished fraction of the query,
            0 to 1. A true value cancels the query, which then raises Cancelled; so does an
            exception, which is raised again. A short query never calls it.

        Returns out, or a new array: float32 [..., channel] in the color space of the file, not
        clamped. Points that are a PyTorch tensor with requires_grad give a tensor, through which
        gradients flow to the points by the exact jacobians; it has no progress.
        """
        if out is None and getattr(points, "requires_grad", False):
            from solidtex.torch import EvalPoints

            more = {"origin": origin, "radii": radii, "axes": axes}
            return EvalPoints.apply(points, self, more)
        given = query(points, origin, radii, axes)
        values = target(out, (*given[0].shape[:-1], len(self.channels)))
        self._engine.eval(*given, values, None, checked(progress))
        return values

    def eval_jacobian(
        self,
        points: ArrayLike | SupportsDLPack,
        origin: Sequence[float] | NDArray[Any] = (0.0, 0.0, 0.0),
        *,
        radii: ArrayLike | SupportsDLPack | None = None,
        axes: ArrayLike | SupportsDLPack | None = None,
    ) -> tuple[Floats, Floats]:
        """Evaluate the texture and its derivatives at origin + points, in full precision.

        The arguments are those of eval_points.

        Returns two new arrays: the values, float32 [..., channel], and their exact derivatives with
        respect to x, y and z, float32 [..., channel, 3], per texel. Where a value has an edge the
        derivatives are those of one side.
        """
        given = query(points, origin, radii, axes)
        values = target(None, (*given[0].shape[:-1], len(self.channels)))
        jacobians = target(None, (*values.shape, 3))
        self._engine.eval(*given, values, jacobians)
        return values, jacobians

    eval_gradients = eval_jacobian
    """Former name of eval_jacobian."""

    @overload
    def eval_box(
        self,
        origin: Sequence[int],
        size: Sequence[int],
        *,
        out: None = ...,
        progress: Progress | None = ...,
    ) -> Floats: ...

    @overload
    def eval_box(
        self,
        origin: Sequence[int],
        size: Sequence[int],
        *,
        out: Out,
        progress: Progress | None = ...,
    ) -> Out: ...

    def eval_box(
        self,
        origin: Sequence[int],
        size: Sequence[int],
        *,
        out: Any = None,
        progress: Progress | None = None,
    ) -> Any:
        """Evaluate the voxels [origin, origin + size) at their centers.

        origin: Three integers in texels.
        size: Three integers, 0 or more.
        out: Array [x, y, z, channel] to write, as for eval_points.
        progress: As for eval_points.

        Returns out, or a new array: float32 [x, y, z, channel] in the color space of the file, not
        clamped.
        """
        corner = triple("origin", origin, whole)
        extent = triple("size", size, whole)
        if min(extent) < 0:
            raise InvalidArgument(f"size: found {extent}, expected numbers of 0 or more")
        values = target(out, (*extent, len(self.channels)))
        self._engine.eval_box(corner, extent, values, checked(progress))
        return values

    def mean(self) -> Floats:
        """Return the mean of the material, float32 [channel], averaged as light if sRGB."""
        mean: Floats = self.eval_points(np.zeros(3, np.float32), radii=np.inf)
        return mean

    def to_torch(self) -> Any:
        """Return a torch.nn.Module of the model's weights, with the texture's seed.

        Its parameters have the names and values of the file. Called with an origin and a size in
        voxels it computes [x, y, z, channel] in PyTorch, with gradients for the parameters. Needs
        the package solidtex-export. It is slower than the engine.
        """
        from solidtex.torch import module_of

        return module_of(self)

    def statistics(self) -> Statistics:
        """Return the work done so far."""
        return Statistics(*self._engine.statistics())

    def close(self) -> None:
        """Free the model once running queries have ended. Closing twice is allowed."""
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
            raise TypeError("a texture opened from bytes or a space cannot be pickled")
        return Texture, (self.path, *self._options)


def _options(
    seed: int, precision: Precision, cache_limit: int, threads: int, period: int = 0
) -> tuple[int, Precision, int, int, int]:
    if precision not in PRECISIONS:
        raise InvalidArgument(f"precision: found {precision!r}, expected one of {PRECISIONS}")
    return (
        unsigned("seed", seed),
        precision,
        unsigned("cache_limit", cache_limit),
        unsigned("threads", threads, MOST_THREADS),
        unsigned("period", period),
    )
