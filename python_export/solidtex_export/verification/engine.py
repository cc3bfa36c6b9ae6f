"""The C++ engine in Python: a thin ctypes binding of solidtex.h, used to verify what is written.

The library is SOLIDTEX_LIBRARY (a file), else the build folder SOLIDTEX_BUILD, else build/ of this
source tree, else what the system's loader finds.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import functools
import os
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import ArrayLike

LIBRARY_NAME = "libsolidtex.so"
PRECISIONS = ("full", "fast")  # in the order of solidtex_precision


class EngineError(RuntimeError):
    """What the engine said, or that there is none."""


class _Options(ctypes.Structure):
    _fields_ = (
        ("struct_size", ctypes.c_size_t),
        ("seed", ctypes.c_uint64),
        ("cache_limit_bytes", ctypes.c_uint64),
        ("precision", ctypes.c_int),
    )


class Texture:
    """An open model. Use it in a `with` statement, or call close()."""

    def __init__(
        self, model: str | os.PathLike[str], seed: int = 0, precision: str = "full"
    ) -> None:
        """`model` is a path, or the bare name of a shipped model; precision is full or fast."""
        self._handle = ctypes.c_void_p()
        self._library = library()
        options = _Options()
        self._library.solidtex_options_init(ctypes.byref(options))
        options.seed = seed
        options.precision = PRECISIONS.index(precision)
        path = os.fsencode(model)
        self._call("open", path, ctypes.byref(options), ctypes.byref(self._handle))

    @property
    def channels(self) -> int:
        return self._library.solidtex_channel_count(self._handle)

    def eval_box(self, origin: Sequence[int], size: Sequence[int]) -> np.ndarray:
        """The voxels [origin, origin + size): float32 [x, y, z, channel]."""
        triple = ctypes.c_int64 * 3
        values = np.empty((*size, self.channels), dtype=np.float32)
        self._call("eval_box", self._handle, triple(*origin), triple(*size), _floats(values))
        return values

    def eval_points(
        self, points: ArrayLike, origin: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> np.ndarray:
        """The colours at origin + points [point, 3]: float32 [point, channel]."""
        offsets = np.ascontiguousarray(points, dtype=np.float32)
        if offsets.ndim != 2 or offsets.shape[1] != 3:
            raise EngineError(f"points: found shape {offsets.shape}, expected (count, 3)")
        values = np.empty((len(offsets), self.channels), dtype=np.float32)
        base = (ctypes.c_double * 3)(*origin)
        count = ctypes.c_size_t(len(offsets))
        self._call("eval_points", self._handle, base, _floats(offsets), count, _floats(values))
        return values

    def eval_filtered(
        self, points: ArrayLike, radii: ArrayLike, origin: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> np.ndarray:
        """The same, each the mean over a cube of twice its radius [point], in texels."""
        offsets = np.ascontiguousarray(points, dtype=np.float32)
        sizes = np.ascontiguousarray(radii, dtype=np.float32)
        if offsets.ndim != 2 or offsets.shape[1] != 3 or sizes.shape != offsets.shape[:1]:
            raise EngineError(
                f"points, radii: found shapes {offsets.shape}, {sizes.shape},"
                " expected (count, 3), (count,)"
            )
        values = np.empty((len(offsets), self.channels), dtype=np.float32)
        base = (ctypes.c_double * 3)(*origin)
        self._call(
            "eval_filtered",
            self._handle,
            base,
            _floats(offsets),
            _floats(sizes),
            ctypes.c_size_t(len(offsets)),
            _floats(values),
        )
        return values

    def eval_footprints(
        self, points: ArrayLike, axes: ArrayLike, origin: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> np.ndarray:
        """The same, each the mean over a parallelepiped: half-edges [point, 3, 3], in texels."""
        offsets = np.ascontiguousarray(points, dtype=np.float32)
        edges = np.ascontiguousarray(axes, dtype=np.float32)
        if offsets.ndim != 2 or edges.shape != (len(offsets), 3, 3) or offsets.shape[1] != 3:
            raise EngineError(
                f"points, axes: found shapes {offsets.shape}, {edges.shape},"
                " expected (count, 3), (count, 3, 3)"
            )
        values = np.empty((len(offsets), self.channels), dtype=np.float32)
        self._call(
            "eval_footprints",
            self._handle,
            (ctypes.c_double * 3)(*origin),
            _floats(offsets),
            _floats(edges),
            ctypes.c_size_t(len(offsets)),
            _floats(values),
        )
        return values

    def close(self) -> None:
        """Frees the model; the texture cannot be used any more."""
        self._library.solidtex_close(self._handle)
        self._handle = ctypes.c_void_p()

    def __enter__(self) -> Texture:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _call(self, function: str, *arguments: object) -> None:
        self._library.solidtex_clear_error()
        if getattr(self._library, f"solidtex_{function}")(*arguments) != 0:
            raise EngineError(self._library.solidtex_error_message().decode())


def version() -> str:
    """The library's version."""
    return library().solidtex_version().decode()


@functools.cache
def library() -> ctypes.CDLL:
    """libsolidtex, loaded once."""
    tried = list(_candidates())
    for path in tried:
        if os.path.isfile(path) or os.sep not in path:
            return _declared(ctypes.CDLL(path))
    raise EngineError(
        f"{LIBRARY_NAME}: not found as {', '.join(tried)}, nor by the system's loader;"
        " build solidtex, or set SOLIDTEX_LIBRARY to the file"
    )


def _candidates() -> list[str]:
    if "SOLIDTEX_LIBRARY" in os.environ:
        return [os.path.abspath(os.environ["SOLIDTEX_LIBRARY"])]
    repository = Path(__file__).resolve().parents[3]
    builds = [Path(os.environ["SOLIDTEX_BUILD"])] if "SOLIDTEX_BUILD" in os.environ else []
    paths = [str(build / "lib" / LIBRARY_NAME) for build in [*builds, repository / "build"]]
    installed = ctypes.util.find_library("solidtex")
    return [*paths, installed] if installed else paths


def _declared(lib: ctypes.CDLL) -> ctypes.CDLL:
    """Declares what ctypes would guess wrongly: 64-bit results and pointers."""
    lib.solidtex_version.restype = ctypes.c_char_p
    lib.solidtex_error_message.restype = ctypes.c_char_p
    lib.solidtex_channel_count.restype = ctypes.c_size_t
    lib.solidtex_channel_count.argtypes = [ctypes.c_void_p]
    lib.solidtex_close.argtypes = [ctypes.c_void_p]
    lib.solidtex_close.restype = None
    return lib


def _floats(values: np.ndarray) -> ctypes.POINTER(ctypes.c_float):
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_float))
