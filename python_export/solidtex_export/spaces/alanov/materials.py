"""Materials of a training: photographs in 2D, volumes of two phases in 3D."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.measuring.phases import find_phases
from solidtex_export.measuring.volumes import SUFFIXES, read_volume
from solidtex_export.measuring.voxels import SIDES_ALIKE, VolumeError, Voxel
from solidtex_export.spaces.alanov.settings import AlanovRecipe, Crops
from solidtex_export.spaces.photographs import Source, find_sources, load_materials

WINDOW = 1.1  # side of algorithm 1's window over that of a crop
CODE_CROPS = 3  # along an axis: those whose mean code is a material's


@dataclass(frozen=True)
class Texture:
    """Values of -1 ... 1 [channel, ...] of a photograph [row, column] or a volume [x, y, z].

    Those of a volume are integers, to save memory; crops are float.
    """

    name: str
    sha256: str
    source: Source
    values: Tensor
    voxel: Voxel | None = None
    notes: tuple[str, ...] = ()
    """What was made of the values, to be said."""

    def record(self) -> dict[str, str]:
        return {
            "name": self.name,
            "sha256": self.sha256,
            "license": self.source.license,
            "source": self.source.source,
        }

    def crops_for_code(self, size: int) -> Tensor:
        """Crops [crop, channel, ...] on a grid that reaches every border."""
        axes = []
        for extent in self.values.shape[1:]:
            span = extent - size
            axes.append(sorted({round(span * i / (CODE_CROPS - 1)) for i in range(CODE_CROPS)}))
        return torch.stack([crop(self.values, at, size) for at in itertools.product(*axes)])


def crop(values: Tensor, at: Sequence[int], size: int) -> Tensor:
    return values[(slice(None), *(slice(a, a + size) for a in at))].float()


def random_crop(values: Tensor, size: int) -> Tensor:
    at = [int(torch.randint(extent - size + 1, ())) for extent in values.shape[1:]]
    return crop(values, at, size)


def random_pair(values: Tensor, settings: Crops) -> tuple[Tensor, Tensor]:
    """Two crops of one texture."""
    if settings.pairs == "nearby":
        window = min(round(WINDOW * settings.size), *values.shape[1:])
        values = random_crop(values, window)
    return random_crop(values, settings.size), random_crop(values, settings.size)


def load_textures(
    paths: Sequence[Path],
    folder: Path | None,
    resolution: int,
    recipe: AlanovRecipe,
    learned: Sequence[Path] | None = None,
) -> list[Texture]:
    """Read the materials to learn, or those to hold out from the `learned` ones."""
    if recipe.dimensions == 3:
        sources = _volume_sources(paths, folder, learned)
        return [_load_volume(source, recipe.crops.size) for source in sources]
    sources = find_sources(paths, folder, learned=learned)
    found = load_materials(sources, resolution, recipe.crops.size, "network", (1.0,))
    return [Texture(m.name, m.sha256, m.source, m.image) for m in found]


def _volume_sources(
    paths: Sequence[Path], folder: Path | None, learned: Sequence[Path] | None
) -> list[Source]:
    """As photographs are found, but a folder's volumes."""
    found: list[Source] = []
    for path in paths:
        if path.is_dir():
            is_store = path.suffix.lower() in SUFFIXES  # refused below, where volumes are read
            inside = [path] if is_store else sorted(path.iterdir())
            files = [p for p in inside if p.suffix.lower() in SUFFIXES]
            if not files:
                raise ExemplarError(f"{path}: found no volume, expected some")
            found += [Source(p) for p in files]
        else:
            found += find_sources([path], folder, learned=learned)
    return found


def _load_volume(source: Source, crop_size: int) -> Texture:
    path = source.path
    if path.is_dir():
        raise ExemplarError(
            f"{path}: found a folder, expected the file of a volume; save the values [x, y, z] of a"
            " .zarr as .npy by numpy.save"
        )
    source.check()
    if path.suffix.lower() == ".solidtex":
        raise ExemplarError(f"{path}: found a model, expected a volume: bake it first")
    try:
        volume = read_volume(path)
        if volume.voxel:
            volume.voxel.check_cubic(str(path))
        phases = find_phases(volume.values, None, path.name, volume.phases)
    except VolumeError as error:
        raise ExemplarError(str(error)) from error
    if len(phases.names) != 2:
        labels = ", ".join(map(phases.title, phases.names))
        raise ExemplarError(
            f"{path}: found {len(phases.names)} phases with the labels {labels}, expected 2; merge"
            f" labels, for instance numpy.where(labels == {phases.names[0]}, 0, 1)"
        )
    upper = torch.from_numpy(phases.of(phases.names[1]))
    if min(upper.shape) < crop_size:
        sides = " x ".join(map(str, upper.shape))
        raise ExemplarError(
            f"{path}: found {sides} voxels, expected at least {crop_size} along each axis, the"
            " size of a crop"
        )
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    values = 2 * upper[None].to(torch.int8) - 1
    notes = (*volume.notes, *phases.notes)
    return Texture(path.stem, digest, source, values, volume.voxel, notes)


def notes_of(textures: Sequence[Texture]) -> list[str]:
    """Those of each, and one where voxels have different sizes."""
    notes = [note for texture in textures for note in texture.notes]
    known = [(t, t.voxel.cubic(t.name)) for t in textures if t.voxel and t.voxel.is_length]
    lengths = [size.meters for _, size in known]
    if known and max(lengths) > (1 + SIDES_ALIKE) * min(lengths):
        sizes = ", ".join(f"{texture.source.path.name} {size}" for texture, size in known)
        notes.append(
            f"volumes have voxels of different sizes: {sizes}; the model learns voxels, so give"
            " solidtex-bake the --voxel-size of each material"
        )
    return notes
