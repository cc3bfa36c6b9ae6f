"""One material of a texture space or of an Alanov preset's result, as a model to measure."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from solidtex_export.bare_name import is_bare_name
from solidtex_export.export.file_format import model_file
from solidtex_export.measuring.voxels import VolumeError
from solidtex_export.spaces.alanov.result import read_alanov
from solidtex_export.spaces.result import read_config
from solidtex_export.spaces.space_file import SUFFIX
from solidtex_export.training.result import ResultError

if TYPE_CHECKING:
    import solidtex

MOST_NAMES = 12  # of a space's photographs that a message lists


@contextmanager
def model_of(path: Path, material: str | None) -> Iterator[Path]:
    """The path itself, or a temporary model of one material of a space or of a training.

    material: A training photograph of the space, or a material of an Alanov preset. Without it a
        bare name that a model and a space share is the model's.
    """
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / f"{path.stem}.solidtex"
        if (path / "config.json").is_file():
            _write_of_result(path, material, model)
        elif space := _space(path, material):
            _write_of_space(space, path, material, model)
        elif material is not None:
            raise VolumeError(
                f"--material: found {material} of {path}, expected a texture space or the result"
                " of an Alanov preset; leave --material out"
            )
        else:
            model = path
        yield model


def _space(path: Path, material: str | None) -> solidtex.Space | None:
    """The space that the path is the file or the bare name of, if it is one."""
    is_file = path.suffix.lower() == SUFFIX
    if not is_file and (path.is_dir() or not is_bare_name(path)):
        return None
    import solidtex

    if material is None and str(path) in solidtex.models():
        return None
    try:
        return solidtex.Space(path)
    except solidtex.Error:
        if is_file:
            raise
        return None


def _write_of_space(space: solidtex.Space, path: Path, material: str | None, model: Path) -> None:
    names = space.photographs
    if material not in names:
        listed = ", ".join(names[:MOST_NAMES]) + (" ..." if len(names) > MOST_NAMES else "")
        raise VolumeError(
            f"{path}: found {f'no photograph {material}' if material else 'a texture space'},"
            f" expected --material NAME, one of its {len(names)} photographs ({listed}); for"
            f" another material: solidtex-encode PHOTOGRAPH --space {path} -o MODEL.solidtex"
        )
    space.write_model(space.photograph(names.index(material)), model, {"name": material})


def _write_of_result(folder: Path, material: str | None, model: Path) -> None:
    try:
        kind = read_config(folder / "config.json")["kind"]
    except ResultError:
        kind = "training"
    if kind != "alanov":
        remedies = {
            "training": f"write its model with solidtex-export {folder} -o MODEL.solidtex",
            "space": f"write it with solidtex-export-space {folder} -o NAME.solidtex-space",
            "start": "a learned start has no material; measure a model that began with it",
        }
        raise VolumeError(
            f"{folder}: found the result of a {kind}, expected a model, a volume or the result of"
            f" an Alanov preset; {remedies[kind]}"
        )
    try:
        result = read_alanov(folder)
        code = result.codes[result.index_of(material)]
    except ResultError as error:
        raise VolumeError(str(error)) from error
    written, _ = result.verifiable_model(material or folder.name, "", code, phases=0)
    model.write_bytes(model_file.serialize(written, str(model)))
