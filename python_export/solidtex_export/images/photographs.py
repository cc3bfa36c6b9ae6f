"""Reads image files of any depth and kind. A file is understood or refused, never guessed at.

OpenImageIO decodes, as in the renderer: 16-bit PNG and TIFF, float TIFF and EXR keep their depth,
and EXR its channel names.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from solidtex_export.images.color_profile import to_srgb
from solidtex_export.images.file_kinds import (
    check_file,
    check_header,
    first_line,
    open_image,
    refuse,
)

PHOTOMETRIC_WHITE_IS_ZERO = 0


@dataclass(frozen=True)
class Picture:
    """An image file in upright orientation without its alpha channel.

    `pixels` [row, column, channel] are as stored, in the file's type; `names` are the file's own,
    one per channel: R, G, B, Y (gray) ... `notes` say what reading changed.
    """

    path: Path
    sha256: str
    format: str  # as OpenImageIO names it: "tiff", "openexr" ...
    names: tuple[str, ...]
    pixels: np.ndarray
    origin: tuple[int, int] = (0, 0)  # column and row of the first pixel, in the display window
    part: str = ""  # its name in an EXR of several parts
    white_is_zero: bool = False
    notes: tuple[str, ...] = ()

    @property
    def is_float(self) -> bool:
        return self.pixels.dtype.kind == "f"

    @property
    def full(self) -> float:
        """Value of white: the largest value of an integer type, 1 for floats."""
        return 1.0 if self.is_float else float(np.iinfo(self.pixels.dtype).max)

    @cached_property
    def values(self) -> np.ndarray:
        """float32 values: integers are scaled from 0 ... full to 0 ... 1, floats are not."""
        pixels = self.pixels
        if self.white_is_zero:
            pixels = self.full - pixels.astype(np.float64)
        return pixels.astype(np.float32) * np.float32(1 / self.full)

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        return self.pixels.shape[1], self.pixels.shape[0]

    def channel(self, name: str) -> np.ndarray:
        return self.values[:, :, self.names.index(name)]


def read_picture(path: Path, layer: str | None = None) -> Picture:
    """Read the image at `path`; its alpha channel has to be opaque.

    `layer` names a part of an EXR file that has several.
    """
    try:
        return _read_picture(path, layer)
    except UnicodeDecodeError as error:  # of names in it, or of a message that quotes them
        raise refuse(path, "names that are no text", "a whole image") from error


def _read_picture(path: Path, layer: str | None) -> Picture:
    check_file(path)
    file = open_image(path)
    try:
        part, notes = _part_with_color(path, layer)
        if part:
            file.seek_subimage(part, 0)
        spec = file.spec()
        check_header(path, spec)
        pixels = file.read_image(part, 0, 0, spec.nchannels, oiio.UNKNOWN)
        if pixels is None or file.has_error:
            reason = first_line(file.geterror())
            raise refuse(path, f"a damaged or unfinished image ({reason})", "a whole one")
        format = file.format_name()
    finally:
        file.close()
    names = tuple(spec.channelnames)
    _check_finite(path, names, pixels)
    opaque = _opaque_channels(path, names, pixels)
    names, pixels = tuple(names[i] for i in opaque), pixels[:, :, opaque]
    origin = (0, 0)
    if format == "openexr":
        pixels, origin, more = _within_display(pixels, spec)
        notes += more
    white_is_zero = (
        format == "tiff"
        and spec.get_int_attribute("tiff:PhotometricInterpretation", -1)
        == PHOTOMETRIC_WHITE_IS_ZERO
    )
    if white_is_zero:
        notes.append("white is zero in this file: inverted")
        if pixels.dtype == np.uint8:  # OpenImageIO inverts these, and no others
            pixels = 255 - pixels
    pixels, more = to_srgb(path, pixels, spec)
    notes += more
    pixels = _upright(pixels, spec.get_int_attribute("Orientation", 1))
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    name = spec.get_string_attribute("oiio:subimagename")
    return Picture(path, digest, format, names, pixels, origin, name, white_is_zero, tuple(notes))


def _part_with_color(path: Path, layer: str | None) -> tuple[int, list[str]]:
    """Select the image of a file: its only one, or the part of an EXR with the color.

    Opens the file again, because some formats cannot seek back.
    """
    file = open_image(path)
    if not file.seek_subimage(1, 0):
        file.geterror()  # that there is no second one
        return 0, []
    if file.format_name() != "openexr":
        found = "several images (frames, pages or parts)"
        raise refuse(path, found, f"a file with one (for example magick {path.name}[0] one.png)")
    parts: list[tuple[str, Sequence[str]]] = []
    while file.seek_subimage(len(parts), 0):
        spec = file.spec()
        parts.append((spec.get_string_attribute("oiio:subimagename"), spec.channelnames))
    file.geterror()
    named = [i for i, (name, _) in enumerate(parts) if name == layer]
    colored = [i for i, (_, channels) in enumerate(parts) if _has_color(channels)]
    chosen = named or colored
    texts = [f"{name or 'without a name'} ({', '.join(c)})" for name, c in parts]
    if len(chosen) != 1:
        raise refuse(path, f"the parts {'; '.join(texts)}", "one with color; choose it by --layer")
    return chosen[0], [f"reads the part {texts[chosen[0]]}, 1 of {len(parts)}"]


def _has_color(channels: Sequence[str]) -> bool:
    last = {name.rpartition(".")[2].lower() for name in channels}
    return last >= {"r", "g", "b"} or last >= {"red", "green", "blue"}


def _within_display(
    pixels: np.ndarray, spec: oiio.ImageSpec
) -> tuple[np.ndarray, tuple[int, int], list[str]]:
    """Crop an EXR's data window to its display window; also returns the crop's origin."""
    left, top = max(spec.x, spec.full_x), max(spec.y, spec.full_y)
    right = min(spec.x + spec.width, spec.full_x + spec.full_width)
    bottom = min(spec.y + spec.height, spec.full_y + spec.full_height)
    if left >= right or top >= bottom:  # nothing is shown: the data are all there is
        left, top = spec.x, spec.y
        right, bottom = spec.x + spec.width, spec.y + spec.height
    origin = (left - spec.full_x, top - spec.full_y)
    if (spec.width, spec.height) == (spec.full_width, spec.full_height) and origin == (0, 0):
        return pixels, origin, []
    shown = pixels[top - spec.y : bottom - spec.y, left - spec.x : right - spec.x]
    note = (
        f"the data window has {spec.width} x {spec.height} pixels, the display window"
        f" {spec.full_width} x {spec.full_height}: reads the {right - left} x {bottom - top}"
        " that both have"
    )
    return shown, origin, [note]


def _check_finite(path: Path, names: tuple[str, ...], pixels: np.ndarray) -> None:
    bad = np.argwhere(~np.isfinite(pixels))
    if len(bad):
        row, column, channel = bad[0]
        place = f"column {column}, row {row} of channel {names[channel]}"
        raise refuse(path, f"{pixels[row, column, channel]} at {place}", "finite values")


def _opaque_channels(path: Path, names: tuple[str, ...], pixels: np.ndarray) -> list[int]:
    """Indices of all channels but alpha (A, or layer.A in EXR)."""
    kept = []
    opaque = 1 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max
    for i, name in enumerate(names):
        if name.split(".")[-1] != "A":
            kept.append(i)
        elif (pixels[:, :, i] < opaque).any():
            share = 100 * float((pixels[:, :, i] < opaque).mean())
            raise refuse(
                path,
                f"pixels that are not opaque ({share:.3g} % of them)",
                "an opaque image; crop it, or put it on a background of the same material",
            )
    return kept


def _upright(pixels: np.ndarray, orientation: int) -> np.ndarray:
    """Turn and flip as the EXIF orientation says."""
    if orientation in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    return np.ascontiguousarray(pixels)


def write_exr(path: Path, names: Sequence[str], values: np.ndarray) -> None:
    """Write float32 channels [row, column, channel] of the given names."""
    rows, columns, count = values.shape
    spec = oiio.ImageSpec(columns, rows, count, oiio.FLOAT)
    spec.channelnames = tuple(names)
    file = oiio.ImageOutput.create(str(path))
    if file is None or not file.open(str(path), spec):
        raise OSError(f"{path}: cannot write: {first_line(oiio.geterror())}")
    written = file.write_image(np.ascontiguousarray(values, np.float32))
    if not (file.close() and written):
        raise OSError(f"{path}: cannot write: {first_line(file.geterror())}")
    check = oiio.ImageInput.open(str(path))  # OpenEXR hides a full disk
    read = check.read_image(oiio.FLOAT) if check else None
    if read is None or read.size != values.size:
        raise OSError(f"{path}: cannot write: found a damaged file afterwards; is the disk full?")
