"""Writes a model after comparing the engine's output with the network's."""

from __future__ import annotations

from pathlib import Path

from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.verification.networks import Network
from solidtex_export.export.verification.verify import BOUND, Differences, differences
from solidtex_export.whole_file import replacing


class OutputError(ValueError):
    """A file was not written; the message says why."""


def check_output(path: Path, force: bool, suffix: str = ".solidtex") -> None:
    """Refuse an output path that cannot be written, before anything is computed."""
    if path.suffix.lower() != suffix:
        raise OutputError(f"{path}: found extension {path.suffix!r}, expected {suffix}")
    if not path.parent.is_dir():
        raise OutputError(f"{path}: found no folder {path.parent}, expected one to write into")
    if path.exists() and not force:
        raise OutputError(f"{path}: found an existing file, expected none (--force replaces it)")


def write_verified(
    path: Path, model: ModelFile, network: Network, bound: float = BOUND
) -> Differences:
    """Write under a temporary name, compare with the engine, then rename or refuse."""
    with replacing(path) as unverified:
        unverified.write_bytes(model_file.serialize(model, str(path)))
        found = differences(unverified, network)
        if not found.largest <= bound:
            raise OutputError(
                f"{path}: found the C++ engine {found.largest:.3g} away from the float64 network"
                f" (boxes {found.boxes:.3g}, points {found.points:.3g}, network"
                f" {found.network:.3g}), expected at most {bound:g}; nothing was written"
            )
    return found


def summary(path: Path, model: ModelFile, found: Differences) -> str:
    """What the user is told of the file that was written."""
    parameters = sum(values.size for values in model.tensors.values())
    return (
        f"{path.stat().st_size} bytes, {parameters} parameters; the C++ engine is within"
        f" {found.largest:.2g} of the float64 network"
    )
