"""Reads picture files of any depth and kind: every one is understood or refused, never guessed at.

OpenImageIO does the decoding, as in the renderer, so that 16-bit PNG and TIFF, float TIFF and EXR
keep their depth and EXR its channel names.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

MAX_VALUES = 1 << 29  # 2 GiB as float: 178 megapixels of colour
KINDS = "a picture (PNG, JPEG, TIFF, EXR ...)"


class ExemplarError(ValueError):
    """A picture that cannot be trained on; the message names the file, found and expected."""


@dataclass(frozen=True)
class Picture:
    """A picture file, upright as its camera held it.

    `values` [row, column, channel] are float32: whole-number pixels are scaled to 0 ... 1, float
    ones are as they are. `names` are the file's own, one per channel: R, G, B, Y (grey) ...
    """

    path: Path
    sha256: str
    names: tuple[str, ...]
    values: np.ndarray
    is_float: bool

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        return self.values.shape[1], self.values.shape[0]

    def channel(self, name: str) -> np.ndarray:
        return self.values[:, :, self.names.index(name)]


def refuse(path: Path, found: str, expected: str) -> ExemplarError:
    return ExemplarError(f"{path}: found {found}, expected {expected}")


def read_picture(path: Path) -> Picture:
    """The picture in `path`, without its alpha channel, which has to be opaque."""
    if not path.is_file():
        raise refuse(path, "no such file", KINDS)
    if path.stat().st_size == 0:
        raise refuse(path, "an empty file", KINDS)
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise refuse(path, f"no readable picture ({_reason(oiio.geterror())})", KINDS)
    try:
        spec = file.spec()
        _check_header(path, file, spec)
        values = file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
        if values is None or file.has_error:
            reason = _reason(file.geterror())
            raise refuse(path, f"a damaged or unfinished picture ({reason})", "a whole one")
        if file.seek_subimage(1, 0):
            raise refuse(path, "several pictures (frames, pages or parts)", "a file with one")
    finally:
        file.close()
    values = _upright(values, spec.get_int_attribute("Orientation", 1))
    names = tuple(spec.channelnames)
    _check_finite(path, names, values)
    opaque = _opaque_channels(path, names, values)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    names = tuple(names[i] for i in opaque)
    is_float = spec.format.basetype in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
    return Picture(path, digest, names, values[:, :, opaque], is_float)


def _check_header(path: Path, file: oiio.ImageInput, spec: oiio.ImageSpec) -> None:
    """What can be refused before the pixels take memory."""
    size = f"{spec.width} x {spec.height} pixels of {spec.nchannels} channels"
    if spec.width * spec.height * spec.nchannels > MAX_VALUES:
        limit = f"at most {MAX_VALUES // 10**6} million values in all; reduce it first"
        raise refuse(path, size, limit)
    if spec.depth > 1:
        raise refuse(path, f"a volume of {spec.depth} layers", "a flat picture")
    for attribute in spec.extra_attribs:
        if attribute.name.endswith(":ColorSpace") and attribute.value == "CMYK":
            raise refuse(
                path,
                "CMYK inks, whose colours depend on a printer",
                "RGB; convert it to sRGB with its colour profile first",
            )


def _check_finite(path: Path, names: tuple[str, ...], values: np.ndarray) -> None:
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        row, column, channel = bad[0]
        place = f"column {column}, row {row} of channel {names[channel]}"
        raise refuse(path, f"{values[row, column, channel]} at {place}", "finite values")


def _opaque_channels(path: Path, names: tuple[str, ...], values: np.ndarray) -> list[int]:
    """Indices of all channels but alpha (A, or layer.A in EXR)."""
    kept = []
    for i, name in enumerate(names):
        if name.split(".")[-1] != "A":
            kept.append(i)
        elif (values[:, :, i] < 1).any():
            share = 100 * float((values[:, :, i] < 1).mean())
            raise refuse(
                path,
                f"pixels that are not opaque ({share:.3g} % of them)",
                "an opaque picture; crop it, or put it on a background of the same material",
            )
    return kept


def _upright(values: np.ndarray, orientation: int) -> np.ndarray:
    if orientation == 1:
        return values
    buffer = oiio.ImageBuf(values)
    buffer.orientation = orientation
    pixels = oiio.ImageBufAlgo.reorient(buffer).get_pixels(oiio.FLOAT)
    assert pixels is not None
    return pixels


def _reason(error: str) -> str:
    """The first line of a library's message; the rest repeats it."""
    lines = [line.strip() for line in error.splitlines() if line.strip()]
    return lines[0].rstrip(".") if lines else "unknown format"


def write_exr(path: Path, names: Sequence[str], values: np.ndarray) -> None:
    """Write float32 channels [row, column, channel] of the given names."""
    rows, columns, count = values.shape
    spec = oiio.ImageSpec(columns, rows, count, oiio.FLOAT)
    spec.channelnames = tuple(names)
    file = oiio.ImageOutput.create(str(path))
    if file is None or not file.open(str(path), spec):
        raise OSError(f"{path}: cannot write: {_reason(oiio.geterror())}")
    written = file.write_image(np.ascontiguousarray(values, np.float32))
    if not (file.close() and written):
        raise OSError(f"{path}: cannot write: {_reason(file.geterror())}")
