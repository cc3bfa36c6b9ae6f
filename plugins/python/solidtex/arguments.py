"""Checks and conversions of the arguments of queries."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solidtex.errors import InvalidArgument, OutOfMemory

Floats = NDArray[np.float32]
LARGEST_UNSIGNED = (1 << 64) - 1


def unsigned(name: str, value: int, largest: int = LARGEST_UNSIGNED) -> int:
    number = operator.index(value)
    if not 0 <= number <= largest:
        limit = "2**64 - 1" if largest == LARGEST_UNSIGNED else largest
        raise InvalidArgument(f"{name}: found {number}, expected 0 to {limit}")
    return number


def whole(value: Any) -> int:
    """A number of the engine's boxes."""
    number = operator.index(value)
    if not -(1 << 63) <= number < 1 << 63:
        raise ValueError  # triple() names the argument
    return number


def checked(progress: Any) -> Any:
    if progress is not None and not callable(progress):
        raise TypeError(f"progress: found {progress!r}, expected a function of one number")
    return progress


def triple(name: str, values: Any, kind: Any) -> tuple[Any, Any, Any]:
    """Three numbers of an argument; others are refused by its name."""
    try:
        x, y, z = (kind(value) for value in values)
    except (TypeError, ValueError) as error:
        expected = "numbers" if kind is float else "whole numbers of 64 bits"
        raise InvalidArgument(f"{name}: found {values!r}, expected three {expected}") from error
    return x, y, z


def floats(name: str, values: Any) -> Floats:
    """Convert to contiguous float32, without a copy if it is that already."""
    try:
        if hasattr(values, "__dlpack__") and not isinstance(values, np.ndarray):
            values = np.from_dlpack(values)
        if np.iscomplexobj(values):
            raise TypeError("complex numbers, expected real ones")
        return np.ascontiguousarray(values, dtype=np.float32).reshape(np.shape(values))
    except (TypeError, ValueError, BufferError, RuntimeError) as error:
        raise InvalidArgument(f"{name}: found {type(values).__name__}: {error}") from error


def query(points: Any, origin: Any, radii: Any, axes: Any) -> tuple[Floats, Any, Any, Any]:
    """Check the arguments of a query: points, origin, and radii or axes or neither."""
    places = floats("points", points)
    if places.ndim == 0 or places.shape[-1] != 3:
        raise InvalidArgument(f"points: found shape {places.shape}, expected (..., 3)")
    shape = places.shape[:-1]
    if radii is not None and axes is not None:
        raise InvalidArgument("radii, axes: found both, expected one of them")
    sizes = None if radii is None else _footprints("radii", radii, shape, ())
    edges = None if axes is None else _footprints("axes", axes, shape, (3, 3))
    return places, triple("origin", origin, float), sizes, edges


def _footprints(name: str, found: Any, shape: tuple[int, ...], each: tuple[int, ...]) -> Floats:
    """Give every point of `shape` a footprint of shape `each`; a single one is repeated."""
    sizes = floats(name, found)
    if sizes.shape == each and shape:
        return np.ascontiguousarray(np.broadcast_to(sizes, (*shape, *each)))
    if sizes.shape != (*shape, *each):
        one = each or "one number"
        raise InvalidArgument(
            f"{name}: found shape {sizes.shape}, expected {one} or {(*shape, *each)}"
        )
    return sizes


def target(out: Any, shape: tuple[int, ...]) -> Any:
    """The array to write: `out`, or else a new one."""
    if out is None:
        try:
            return np.empty(shape, np.float32)
        except (MemoryError, ValueError, OverflowError) as error:
            raise OutOfMemory(
                f"values: found no memory for an array of shape {shape}, expected fewer values"
            ) from error
    if not hasattr(out, "__dlpack__"):
        raise InvalidArgument(f"out: found {type(out).__name__}, expected an array")
    if tuple(out.shape) != shape:
        raise InvalidArgument(f"out: found shape {tuple(out.shape)}, expected {shape}")
    if isinstance(out, np.ndarray) and not out.flags.writeable:
        raise InvalidArgument("out: found a read-only array, expected one that can be written")
    return out
