"""Converts integer pixels in a color space other than sRGB to sRGB."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from PIL import Image, ImageCms

from solidtex_export.images.file_kinds import refuse

SRGB = "srgb_rec709_scene"
LIKE_SRGB = ("", SRGB, "g22_rec709_scene", "sRGB", "Gamma2.2")
"""Names that are read as sRGB. Many programs write a gamma of 2.2 for sRGB."""
TOLERANCE = 6  # of 255: profiles of sRGB by other makers, and gray of gamma 2.2, are this near
RELATIVE = ImageCms.Intent.RELATIVE_COLORIMETRIC

Converted = tuple[np.ndarray, list[str]]
"""Pixels, and a note on their conversion."""


def to_srgb(path: Path, pixels: np.ndarray, spec: oiio.ImageSpec) -> Converted:
    """Convert from the file's ICC profile or named color space; pixels near sRGB stay unchanged."""
    profile = spec.getattribute("ICCProfile")
    if profile is not None:
        return _from_profile(path, pixels, bytes(np.asarray(profile, np.uint8)))
    space = spec.get_string_attribute("oiio:ColorSpace")
    if pixels.dtype.kind == "f" or space in LIKE_SRGB or pixels.shape[2] not in (1, 3):
        return pixels, []
    white = np.iinfo(pixels.dtype).max
    buffer = oiio.ImageBuf(np.repeat(pixels / np.float32(white), 3 // pixels.shape[2], axis=2))
    result = oiio.ImageBufAlgo.colorconvert(buffer, space, SRGB)
    values = None if result.has_error else result.get_pixels(oiio.FLOAT)
    if values is None:
        raise refuse(path, f"the color space {space}", "sRGB; convert it first")
    encoded = np.clip(values, 0, 1)[:, :, : pixels.shape[2]]
    return np.rint(encoded * white).astype(pixels.dtype), [f"converted from {space} to sRGB"]


def _from_profile(path: Path, pixels: np.ndarray, data: bytes) -> Converted:
    try:
        profile = ImageCms.ImageCmsProfile(io.BytesIO(data))
        name = ImageCms.getProfileDescription(profile).strip()
        space = profile.profile.xcolor_space.strip()
        mode, channels = {"RGB": ("RGB", 3), "GRAY": ("L", 1)}.get(space, ("", 0))
        if channels != pixels.shape[2]:
            return pixels, [f"ignores its ICC profile {name!r}, which is for {space}"]
        srgb = ImageCms.createProfile("sRGB")
        transform = ImageCms.buildTransform(profile, srgb, mode, "RGB", RELATIVE)
        is_srgb = _is_near_identity(transform, mode)
    except (ImageCms.PyCMSError, OSError, ValueError) as error:
        raise refuse(path, f"an ICC profile that cannot be used ({error})", "sRGB") from error
    if is_srgb:
        return pixels, []
    if pixels.dtype.kind == "f":
        return pixels, [f"ignores its ICC profile {name!r}: floats are taken as linear sRGB"]
    if pixels.dtype != np.uint8:
        found = f"the ICC profile {name!r} and more than 8 bits"
        raise refuse(path, found, "sRGB; convert it first (for example in darktable or GIMP)")
    image = Image.fromarray(pixels if channels == 3 else pixels[:, :, 0])
    converted = np.asarray(ImageCms.applyTransform(image, transform))[:, :, :channels]
    return converted, [f"converted from its ICC profile {name!r} to sRGB"]


def _is_near_identity(transform: ImageCms.ImageCmsTransform, mode: str) -> bool:
    steps = np.linspace(0, 255, 18).round().astype(np.uint8)
    if mode == "L":
        grid = steps[None]
        expected = np.repeat(grid[:, :, None], 3, axis=2)
    else:
        grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(len(steps), -1, 3)
        expected = grid
    result = np.asarray(ImageCms.applyTransform(Image.fromarray(grid), transform))
    return bool(np.abs(result.astype(int) - expected.astype(int)).max() <= TOLERANCE)
