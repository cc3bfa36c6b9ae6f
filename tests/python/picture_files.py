"""Images for the tests of reading: all show the same tones, stored in another way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile

from solidtex_export.images.channels import Reading
from solidtex_export.images.exemplar import Exemplar, load_exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.srgb import srgb_decode
from solidtex_export.images.value_range import Range

SIDE = 24
TONES = np.random.default_rng(7).integers(20, 236, (SIDE, SIDE)).astype(np.uint8)
UNIT = TONES / np.float32(255)
LABELS = np.random.default_rng(8).integers(0, 3, (SIDE, SIDE)).astype(np.uint8)


def load(path: Path, asked: Range | None = None, layer: str | None = None, **more) -> Exemplar:
    ranges = {} if asked is None else {"": asked}
    return load_exemplar(path, 1000, 8, reading=Reading(ranges, layer), **more)


def gray(exemplar: Exemplar) -> np.ndarray:
    assert exemplar.channels[:3] == ("albedo.r", "albedo.g", "albedo.b")
    assert (exemplar.image[0] == exemplar.image[2]).all()
    return exemplar.image[0].numpy()


def refusal(path: Path, *args, **more) -> str:
    with pytest.raises(ExemplarError) as error:
        load(path, *args, **more)
    message = str(error.value)
    assert message.startswith(str(path)) and ": found " in message and ", expected " in message
    assert "\n" not in message
    return message


def write_tiff(path: Path, values: np.ndarray, **options: object) -> Path:
    tifffile.imwrite(path, values, **{"photometric": "minisblack", **options})
    return path


def write(path: Path, values: np.ndarray, names: list[str], **attributes: object) -> Path:
    """A float EXR; attributes of the specification go by their names."""
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], len(names), oiio.HALF)
    spec.channelnames = tuple(names)
    for name, value in attributes.items():
        setattr(spec, name, value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(values.astype(np.float32))
    assert file.close()
    return path


def color(values: np.ndarray = UNIT, count: int = 3) -> np.ndarray:
    return np.repeat(srgb_decode(values)[:, :, None], count, axis=2)
