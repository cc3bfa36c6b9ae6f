"""Exemplar photographs: reading, colour axes, random crops."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from PIL import Image, ImageOps, UnidentifiedImageError
from torch import Tensor

MIN_AXIS_RATIO = 0.15  # of the largest: keeps a grey stone's faint hues from being amplified

PICTURE_ERRORS = (
    UnidentifiedImageError,
    Image.DecompressionBombError,
    OSError,
    ValueError,
    SyntaxError,  # what PIL raises for some damaged PNG files
)


class ExemplarError(ValueError):
    """A photograph that cannot be trained on; the message names the file."""


@dataclass(frozen=True)
class Exemplar:
    """A photograph at training resolution: sRGB-encoded `image` [3, rows, columns] in 0 ... 1."""

    name: str
    sha256: str
    image: Tensor


def load_exemplar(
    path: Path, resolution: int, needed: int, crop: tuple[int, ...] | None = None
) -> Exemplar:
    """Read `path`, reduced so that its shorter side has at most `resolution` pixels.

    `needed` is the shortest side that training can use; `crop` is (x, y, width, height).
    """
    photo = _read(path)
    if crop:
        photo = _cropped(photo, crop, path)
    if min(photo.size) < needed:
        raise ExemplarError(
            f"{path}: found {photo.width} x {photo.height} pixels, expected at least"
            f" {needed} x {needed} (the size of a training slice; see --size)"
        )
    factor = resolution / min(photo.size)
    if factor < 1:
        size = (round(photo.width * factor), round(photo.height * factor))
        photo = photo.resize(size, Image.Resampling.LANCZOS)
    pixels = np.asarray(photo, dtype=np.float32) / 255
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return Exemplar(path.name, digest, torch.from_numpy(pixels.copy()).permute(2, 0, 1))


def _read(path: Path) -> Image.Image:
    """The picture, upright as its camera held it."""
    if not path.is_file():
        raise ExemplarError(f"{path}: found no such file, expected a photograph (PNG, JPEG ...)")
    try:
        with Image.open(path) as opened:
            if opened.mode[0] in "IF":  # PIL would clip these to 8 bits
                raise ValueError(f"mode {opened.mode}: more than 8 bits per channel")
            return ImageOps.exif_transpose(opened).convert("RGB")
    except PICTURE_ERRORS as error:
        raise ExemplarError(
            f"{path}: found no readable picture ({error}), expected PNG, JPEG ..."
        ) from error


def _cropped(photo: Image.Image, crop: tuple[int, ...], path: Path) -> Image.Image:
    x, y, width, height = crop
    if x < 0 or y < 0 or x + width > photo.width or y + height > photo.height:
        raise ExemplarError(
            f"{path}: --crop: found {x},{y},{width},{height}, expected a region of"
            f" {photo.width} x {photo.height} pixels"
        )
    return photo.crop((x, y, x + width, y + height))


def save_image(image: Tensor, path: Path) -> None:
    """Write colours [3, rows, columns] as an 8-bit PNG."""
    pixels = (image.clamp(0, 1) * 255).round().byte().permute(1, 2, 0).cpu().numpy()
    Image.fromarray(pixels).save(path)


def color_axes(exemplars: list[Exemplar]) -> tuple[Tensor, Tensor]:
    """Mean m [3] and axes B [3, 3] of all colours; colour = m + B y with y of unit variance."""
    colors = torch.cat([e.image.flatten(1) for e in exemplars], dim=1).double()
    mean = colors.mean(1)
    values, vectors = torch.linalg.eigh(torch.cov(colors))
    deviations = values.clamp_min(1e-8).sqrt()
    deviations = deviations.clamp_min(MIN_AXIS_RATIO * float(deviations.max()))
    return mean.float(), (vectors * deviations).float()


def whiten(image: Tensor, mean: Tensor, basis: Tensor) -> Tensor:
    """The inverse of the colour affine, for an image [3, rows, columns]."""
    centred = (image - mean[:, None, None]).flatten(1).double()
    return torch.linalg.solve(basis.double(), centred).float().view_as(image)


def grain_ratio(exemplar: Exemplar) -> float:
    """How much longer structures are along the columns of pixels than across them."""
    across = _correlation_length(exemplar.image)
    return _correlation_length(exemplar.image.transpose(1, 2)) / across


def _correlation_length(image: Tensor) -> float:
    """The distance, along rows, where the mean squared difference is half that of strangers."""
    half = float(image.var((1, 2)).mean())
    previous = 0.0
    for lag in range(1, image.shape[2] // 2):
        difference = float((image[:, :, lag:] - image[:, :, :-lag]).square().mean())
        if difference >= half:
            return lag - 1 + (half - previous) / max(difference - previous, 1e-12)
        previous = difference
    return image.shape[2] / 2


def random_symmetry(images: Tensor, symmetry: str) -> Tensor:
    """Images [batch, channel, rows, columns], all in a random orientation of `symmetry`."""
    if symmetry == "none":
        return images
    dims = [d for d in (2, 3) if torch.rand(()) < 0.5]
    images = images.flip(dims) if dims else images
    if symmetry == "all" and torch.rand(()) < 0.5:
        images = images.transpose(2, 3)
    return images


def random_crops(image: Tensor, count: int, rows: int, columns: int) -> Tensor:
    """`count` random crops [count, channel, rows, columns], smaller where the image is."""
    rows, columns = min(rows, image.shape[1]), min(columns, image.shape[2])
    crops = []
    for _ in range(count):
        r = int(torch.randint(image.shape[1] - rows + 1, ()))
        c = int(torch.randint(image.shape[2] - columns + 1, ()))
        crops.append(image[:, r : r + rows, c : c + columns])
    return torch.stack(crops)
