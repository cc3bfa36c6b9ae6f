"""Photographs of a space's training: a folder, a list of files, or a CSV with their licences."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.analysis.grain import grain_ratio
from solidtex_export.images.exemplar import load_exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.spaces.colors import color_axes

SUFFIXES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".exr")
COLUMNS = ("file", "licence")
NETWORK_MEAN = NETWORK_SCALE = 0.5  # colors of 0 ... 1 as values of -1 ... 1


@dataclass(frozen=True)
class Source:
    """File of a photograph, its licence and its source."""

    path: Path
    license: str = ""
    source: str = ""
    direction: str = ""
    listed_in: Path | None = None
    """CSV that names the file."""

    def check(self) -> None:
        """Refuse a file that a CSV names and that is missing."""
        if self.listed_in is not None and not self.path.is_file():
            raise ExemplarError(
                f"{self.listed_in}: file: found no {self.path}, expected a photograph there"
                " (--folder FOLDER names the folder of the files)"
            )


@dataclass
class Material:
    """Photograph as the network sees it: `image` [3, row, column] = basis^-1 (colors - mean)."""

    name: str
    sha256: str
    source: Source
    image: Tensor
    mean: Tensor
    basis: Tensor

    @property
    def colors(self) -> Tensor:
        """Basis and mean [3, 4], as the space file has them."""
        return torch.cat([self.basis, self.mean[:, None]], dim=1)

    def record(self) -> dict[str, str]:
        """For the file of what was learned."""
        source = self.source
        return {"name": self.name, "sha256": self.sha256, "license": source.license,
                "source": source.source}  # fmt: skip

    def restored(self, y: Tensor) -> Tensor:
        """Colors of values y [3, ...]."""
        return torch.einsum("ij,j...->i...", self.basis, y) + self.mean.view(
            -1, *[1] * (y.ndim - 1)
        )


def find_sources(
    paths: Iterable[Path],
    folder: Path | None = None,
    split: str = "train",
    learned: Iterable[Path] | None = None,
) -> list[Source]:
    """Sources of the given files, of all images in the folders, and of all rows of the CSV files.

    A CSV has the columns file and licence, and optionally source or attribution, split and
    direction. Rows of other splits are left out. Files are relative to `folder`, or to the CSV's
    own. Photographs that are held out have any split, but are none of the `learned` ones.
    """
    found: list[Source] = []
    for path in paths:
        if path.suffix.lower() == ".csv":
            found += _csv_sources(path, folder or path.parent, split if learned is None else None)
        elif path.is_dir():
            files = (p for p in sorted(path.iterdir()) if p.suffix.lower() in SUFFIXES)
            found += [Source(p) for p in files]
        else:
            found.append(Source(path))
    if learned is not None:
        learned = set(learned)
        found = [source for source in found if source.path not in learned]
    if not found:
        of_csv = f"some (of a CSV, rows whose split is {split} or empty)"
        which = of_csv if learned is None else "some that are not learned"
        raise ExemplarError(f"PHOTO: found no photograph in the given folders, expected {which}")
    return found


def _csv_sources(path: Path, folder: Path, split: str | None) -> list[Source]:
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        rows, columns = list(reader), reader.fieldnames or []
    for column in COLUMNS:
        if column not in columns:
            raise ExemplarError(
                f"{path}: {column}: found no such column, but {', '.join(columns) or 'none'},"
                f" expected {' and '.join(COLUMNS)}"
            )
    return [
        Source(
            folder / row["file"],
            row["licence"],
            row.get("attribution") or row.get("source") or "",
            row.get("direction") or "",
            path,
        )
        for row in rows
        if split is None or (row.get("split") or split) == split
    ]


def load_materials(
    sources: Sequence[Source],
    resolution: int,
    patch: int,
    colors: str,
    scales: Sequence[float],
    upright: bool = False,
) -> list[Material]:
    """Read the photographs at each scale at which they still hold a patch.

    `upright` turns photographs whose grain runs along rows and whose direction is not given.
    """
    materials = []
    for source in sources:
        source.check()
        exemplar = load_exemplar(source.path, resolution, 1)
        rows, columns = exemplar.image.shape[1:]
        if min(rows, columns) < patch:
            raise ExemplarError(
                f"{source.path}: found {columns} x {rows} pixels, expected at least"
                f" {patch} x {patch}, the size of a patch: use a larger photograph, or leave"
                " it out"
            )
        if len(exemplar.channels) != 3:
            names = ", ".join(exemplar.channels)
            raise ExemplarError(f"{source.path}: found the channels {names}, expected a color")
        turn = upright and not source.direction and grain_ratio(exemplar) < 1
        original = exemplar.image.transpose(1, 2) if turn else exemplar.image
        for scale in scales:
            image = _scaled(original, scale)
            if min(image.shape[1:]) < patch:
                continue
            mean, basis = torch.full((3,), NETWORK_MEAN), NETWORK_SCALE * torch.eye(3)
            if colors == "photograph":
                mean, basis = color_axes(image)
            name = Path(exemplar.name).stem + ("" if scale == 1 else f"@{scale:g}")
            y = torch.linalg.solve(basis, (image - mean[:, None, None]).flatten(1))
            material = Material(name, exemplar.sha256, source, y.view_as(image), mean, basis)
            materials.append(material)
    return materials


def _scaled(image: Tensor, scale: float) -> Tensor:
    if scale == 1:
        return image
    small = F.interpolate(image[None], scale_factor=scale, mode="bicubic", antialias=True)
    return small[0].clamp(0, 1)


def patches(image: Tensor, side: int, count: int) -> Tensor:
    """Patches [count, 3, side, side] on a grid that reaches every border."""
    rows, columns = (extent - side for extent in image.shape[1:])
    across = max(1, round((count * (columns + side) / (rows + side)) ** 0.5))
    down = -(-count // across)
    places = [
        (
            round(rows * (i // across) / max(1, down - 1)),
            round(columns * (i % across) / max(1, across - 1)),
        )
        for i in range(count)
    ]
    return torch.stack([image[:, r : r + side, c : c + side] for r, c in places])
