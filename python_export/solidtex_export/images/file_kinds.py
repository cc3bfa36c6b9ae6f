"""Refuses files that OpenImageIO would open as something other than a photograph."""

from __future__ import annotations

import re
from pathlib import Path

import OpenImageIO as oiio

PICTURE = "an image (PNG, JPEG, TIFF, EXR ...)"
MAX_VALUES = 1 << 29  # 2 GiB as float: 178 megapixels of color

RAW_SUFFIX = re.compile(
    "[.](3fr|arw|cr[23w]|dcr|dng|erf|fff|iiq|kdc|mef|mos|mrw|nef|nrw|orf|pef|raf|raw|rw[2l]|sr[2fw]|x3f)"
)
RAW_STARTS = (b"FUJIFILMCCD-RAW", b"IIRO", b"IIRS", b"MMOR", b"IIU\0", b"\0MRM", b"FOVb")
DEVELOP = "a developed image (for example darktable-cli {} {}.tif, then train on the .tif)"

DOWNLOAD = "download the file itself, not its page"
UNPACK = "unpack it first"
OTHER_CONTENTS = (
    (b"version https://git-lfs.github.com/spec/", "a Git LFS pointer", "run git lfs pull"),
    (b"<!doctype", "an HTML page", DOWNLOAD),
    (b"<html", "an HTML page", DOWNLOAD),
    (b"pk\3\4", "a ZIP archive", UNPACK),
    (b"\x1f\x8b", "a gzip archive", UNPACK),
)
"""First bytes, in small letters, of what is often found in place of an image."""

FORMATS = (
    (rb"\x89PNG\r\n\x1a\n", "png"),
    (rb"\xff\xd8\xff", "jpeg"),
    (rb"II[*+]\0|MM\0[*+]", "tiff"),
    (rb"\x76\x2f\x31\x01", "openexr"),
    (rb"#[?]", "hdr"),
    (rb"BM", "bmp"),
    (rb"RIFF....WEBP", "webp"),
    (rb"P[1-7Ff]\s", "pnm"),
    (rb"GIF8", "gif"),
    (rb"\xff\x4f\xff\x51|\0\0\0\x0cjP  ", "jpeg2000"),
)
"""How files begin, and OpenImageIO's name of their format."""

PHOTOMETRIC_RAW = (32803, 34892)  # color filter array, linear raw
PHOTOMETRIC_LAB = (8, 9, 10)
PHOTOMETRIC_MASK = 4
REDUCED_COPY = 1  # bit of NewSubfileType


class ExemplarError(ValueError):
    """An image that cannot be trained on; the message names the file, found and expected."""


def refuse(path: Path, found: str, expected: str) -> ExemplarError:
    return ExemplarError(f"{path}: found {found}, expected {expected}")


def check_file(path: Path) -> None:
    """Refuse raw camera data and files that are no images, by their first bytes and suffix."""
    if not path.is_file():
        raise refuse(path, "a folder" if path.is_dir() else "no such file", PICTURE)
    with path.open("rb") as file:
        start = file.read(64)
    if not start:
        raise refuse(path, "an empty file", PICTURE)
    for beginning, found, remedy in OTHER_CONTENTS:
        if start.lstrip().lower().startswith(beginning):
            raise refuse(path, found, f"{PICTURE}: {remedy}")
    brand = start[8:12] if start[4:8] == b"ftyp" else b""
    if brand == b"avif":
        raise refuse(path, "an AVIF image", "PNG or TIFF (for example avifdec a.avif a.png)")
    if brand in (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1"):
        raise refuse(path, "a HEIC image", "PNG or TIFF (for example heif-convert a.heic a.png)")
    is_canon = start[8:10] == b"CR" and start[:2] in (b"II", b"MM")
    if RAW_SUFFIX.fullmatch(path.suffix.lower()) or start.startswith(RAW_STARTS) or is_canon:
        raise refuse_raw(path, "a camera's raw file, of which only its thumbnail could be read")


def refuse_raw(path: Path, found: str) -> ExemplarError:
    return refuse(path, found, DEVELOP.format(path.name, path.stem))


def open_image(path: Path) -> oiio.ImageInput:
    """Open an image that begins like one of FORMATS, or is named like a TGA.

    OpenImageIO would try some twenty readers more on a file that begins like none of them.
    """
    with path.open("rb") as file:
        start = file.read(64)
    names = [name for pattern, name in FORMATS if re.match(pattern, start, re.DOTALL)]
    if not names and path.suffix.lower() != ".tga":
        known = ", ".join([name for _, name in FORMATS] + ["targa"])
        raise refuse(path, f"no readable image (it begins like none of {known})", PICTURE)
    image = oiio.ImageInput.open(str(path))
    if image is None:
        reason = first_line(oiio.geterror())
        deep = "for 64 bits" in reason  # such as numpy's own integers
        expected = f"{PICTURE} of 8 or 16 bits: save labels as uint8" if deep else PICTURE
        raise refuse(path, f"no readable image ({reason})", expected)
    return image


def first_line(error: str) -> str:
    """First line of a library's message, which may quote bytes of a file; the rest repeats it."""
    lines = [line.strip() for line in error.splitlines() if line.strip()]
    line = lines[0].rstrip(".") if lines else "unknown format"
    return "".join(letter if letter.isprintable() else "?" for letter in line)


def check_header(path: Path, spec: oiio.ImageSpec) -> None:
    """Refuse by the header, before pixels are allocated."""
    size = f"{spec.width} x {spec.height} pixels of {spec.nchannels} channels"
    if spec.width * spec.height * spec.nchannels > MAX_VALUES:
        limit = f"at most {MAX_VALUES // 10**6} million values in all; reduce it first"
        raise refuse(path, size, limit)
    if spec.depth > 1:
        raise refuse(path, f"a volume of {spec.depth} layers", "a flat image")
    if spec.deep:
        raise refuse(path, "a deep image (several samples a pixel)", "a flattened one")
    photometric = spec.get_int_attribute("tiff:PhotometricInterpretation", -1)
    if photometric in PHOTOMETRIC_RAW:
        raise refuse_raw(path, "a camera's raw data")
    if spec.get_int_attribute("tiff:subfiletype", 0) & REDUCED_COPY:
        raise refuse_raw(path, f"a thumbnail of {size}, marked as a reduced copy of another image")
    if photometric == PHOTOMETRIC_MASK:
        raise refuse(path, "a transparency mask", "an image")
    if photometric in PHOTOMETRIC_LAB:
        raise refuse(path, "CIE L*a*b* values", "RGB; convert it to sRGB first")
    if any(a.name.endswith(":ColorSpace") and a.value == "CMYK" for a in spec.extra_attribs):
        raise refuse(
            path,
            "CMYK inks, whose colors depend on a printer",
            "RGB; convert it to sRGB with its color profile first",
        )
