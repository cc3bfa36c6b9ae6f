"""Volumes of models."""

from __future__ import annotations

import hashlib
from pathlib import Path

from solidtex_export.bare_name import is_bare_name
from solidtex_export.measuring.volumes import Volume, three_axes
from solidtex_export.measuring.voxels import VolumeError


def is_model(path: Path) -> bool:
    """Whether it is a .solidtex file or the bare name of a shipped model. A folder is neither."""
    return path.suffix.lower() == ".solidtex" or (is_bare_name(path) and not path.is_dir())


def read_model(path: Path, size: int, seed: int, period: int) -> Volume:
    """Bake a cube of a model at the origin."""
    import solidtex

    try:
        opened = solidtex.Texture(path, seed=seed, period=period)
    except solidtex.InvalidArgument as error:
        if period:
            raise VolumeError(f"--periodic with --size {size}: {error}") from error
        raise
    with opened as texture:
        values = texture.eval_box((0, 0, 0), (size, size, size))
        channels = tuple(texture.channels)
        model = {
            "name": texture.name,
            "sha256": hashlib.sha256(Path(texture.path).read_bytes()).hexdigest(),
            "seed": seed,
            "origin": [0, 0, 0],
            "period": period,
        }
    return three_axes(path, Volume(values, channels=channels, model=model))
