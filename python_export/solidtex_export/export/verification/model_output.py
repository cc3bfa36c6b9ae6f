"""Writes a model that the C++ engine has been shown to evaluate as its network does, or nothing."""

from __future__ import annotations

import os
from pathlib import Path

from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.verification.networks import Network
from solidtex_export.export.verification.verify import BOUND, Differences, differences


class OutputError(ValueError):
    """Why a file was not written."""


def check_output(path: Path, force: bool, suffix: str = ".solidtex") -> None:
    """Refuses what could not be written, before anything is computed."""
    if path.suffix != suffix:
        raise OutputError(f"{path}: found extension {path.suffix!r}, expected {suffix}")
    if not path.parent.is_dir():
        raise OutputError(f"{path}: found no folder {path.parent}, expected one to write into")
    if path.exists() and not force:
        raise OutputError(f"{path}: found an existing file, expected none (--force replaces it)")


def write_verified(
    path: Path, model: ModelFile, network: Network, bound: float = BOUND
) -> Differences:
    """Writes under a temporary name, compares with the engine, then renames, or refuses."""
    unverified = path.with_name(f".{path.stem}.unverified.{os.getpid()}.solidtex")
    try:
        model_file.write(unverified, model)
        found = differences(unverified, network)
        if not found.largest <= bound:
            raise OutputError(
                f"{path}: found the C++ engine {found.largest:.3g} away from the float64 network"
                f" (boxes {found.boxes:.3g}, points {found.points:.3g}, network"
                f" {found.network:.3g}), expected at most {bound:g}; nothing was written"
            )
        os.replace(unverified, path)
    finally:
        unverified.unlink(missing_ok=True)
    return found


def summary(path: Path, model: ModelFile, found: Differences) -> str:
    """One line for the user."""
    parameters = sum(values.size for values in model.tensors.values())
    return (
        f"{path}: {path.stat().st_size} bytes, {parameters} parameters; the C++ engine is within"
        f" {found.largest:.2g} of the float64 network"
    )
