"""Reads the stacks of rocks that benchmarks measure."""

import zipfile
from pathlib import Path

import numpy as np


def read_stack(path: Path) -> np.ndarray:
    """Values [page, row, column] of a TIFF stack, or of the one in a .zip."""
    import tifffile

    if path.suffix != ".zip":
        return tifffile.imread(path)
    with zipfile.ZipFile(path) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(f"{path.stem}.tif"))
        with archive.open(name) as file:
            return tifffile.imread(file)
