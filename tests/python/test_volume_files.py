"""What solidtex-measure takes of odd, damaged and foreign files of volumes and sections."""

import json
import zlib
from pathlib import Path

import numpy as np
import pytest
from analytic_volumes import ball
from PIL import Image

pytest.importorskip("matplotlib")
nrrd = pytest.importorskip("nrrd")
tifffile = pytest.importorskip("tifffile")

from solidtex_export.commands.measure import main  # noqa: E402
from solidtex_export.commands.measure_exemplar import read_section  # noqa: E402
from solidtex_export.images.file_kinds import ExemplarError  # noqa: E402
from solidtex_export.measuring import geometry  # noqa: E402
from solidtex_export.measuring.phases import find_phases  # noqa: E402
from solidtex_export.measuring.volumes import read_volume  # noqa: E402
from solidtex_export.measuring.voxels import VolumeError  # noqa: E402

BALL = ball(4, 12).astype(np.uint8)


def test_sections_have_the_values_that_training_takes(tmp_path: Path) -> None:
    labels = np.zeros((20, 30), np.uint8)
    labels[:6] = 1
    tifffile.imwrite(tmp_path / "bits.tif", labels.astype(bool))
    tifffile.imwrite(tmp_path / "white.tif", labels, photometric="miniswhite")
    tifffile.imwrite(tmp_path / "plain.tif", labels)
    Image.fromarray(labels).save(tmp_path / "plain.png")
    palette = Image.fromarray(labels, mode="P")
    palette.putpalette([200, 30, 30, 30, 30, 200])
    palette.save(tmp_path / "palette.png")
    for path in sorted(tmp_path.iterdir()):
        section = read_section(path)
        assert section.shape == (30, 20)
        assert ((section != section[0, -1]) == (labels.T == 1)).all(), path.name
        assert section[0, 0] > section[0, -1], path.name


def test_64_bits_say_how_to_save(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "deep.tif", np.digitize(np.zeros((20, 20)), [0.5]))
    with pytest.raises(ExemplarError, match="save labels as uint8"):
        read_section(tmp_path / "deep.tif")


def test_a_larger_picture_has_longer_chords(tmp_path: Path, capfd) -> None:
    np.save(tmp_path / "v.npy", BALL)
    said = []
    for side in (12, 40):
        Image.fromarray(np.tile(BALL[6], (4, 4))[:side, :side]).save(tmp_path / "s.png")
        options = ["--voxel-size", "1um", "--without", "permeability", "--without", "diffusivity"]
        files = ["-o", str(tmp_path / "r.json"), "--force", "--exemplar", str(tmp_path / "s.png")]
        assert main([str(tmp_path / "v.npy"), *options, *files]) == 0
        said.append(json.loads((tmp_path / "r.json").read_text())["exemplar"]["note"])
    assert "Compare like sizes" not in said[0] and "Compare like sizes" in said[1]


@pytest.mark.parametrize("radius", [5, 6, 10, 12, 14])
def test_the_largest_pore_is_covered(radius: int) -> None:
    rows, columns = np.ogrid[-20:21, -20:21]
    disk = rows**2 + columns**2 <= radius**2
    radii, covered = geometry.pore_sizes(disk)
    assert covered[-1] > 0.9
    assert geometry.mean_radius(radii, covered) == pytest.approx(radius, rel=0.04)


@pytest.mark.parametrize("value", [1e30, 2.0**60])
def test_values_beyond_labels_are_refused(value: float) -> None:
    with pytest.raises(VolumeError, match=r"expected labels up to 2\^53"):
        find_phases(np.where(BALL > 0, value, 0.0), None, "v")


def compressed_then_cut(path: Path) -> None:
    tifffile.imwrite(path, BALL, compression="zlib")
    data = bytearray(path.read_bytes())
    start = data.index(zlib.compress(BALL[0].tobytes())[:2])
    data[start + 2 : start + 12] = b"\xff" * 10
    path.write_bytes(data)


def shape_without_voxels(path: Path) -> None:
    np.save(path, np.zeros((4, 4, 4, 0)))


def shape_beyond_memory(path: Path) -> None:
    np.save(path, BALL)
    path.write_bytes(path.read_bytes().replace(b"(12, 12, 12), ", b"(9999999999,),"))


def nothing(path: Path) -> None:
    path.write_bytes(b"")


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("a.tif", compressed_then_cut),
        ("b.npy", shape_without_voxels),
        ("c.npy", shape_beyond_memory),
        ("d.nrrd", nothing),
        ("e.nhdr", nothing),
    ],
)
def test_damaged_files_are_refused_in_a_line(tmp_path: Path, capfd, name: str, write) -> None:
    write(tmp_path / name)
    assert main([str(tmp_path / name), "-o", str(tmp_path / "r.json"), "--voxel-size", "1um"]) == 1
    (line,) = capfd.readouterr().err.splitlines()
    assert name in line and "expected" in line


def test_compression_without_its_package_is_named(tmp_path: Path, monkeypatch) -> None:
    tifffile.imwrite(tmp_path / "v.tif", BALL)

    def missing(*_args, **_kwargs):
        raise ValueError("<COMPRESSION.LZW: 5> requires the 'imagecodecs' package")

    monkeypatch.setattr(tifffile.TiffPageSeries, "asarray", missing)
    with pytest.raises(VolumeError, match="without compression; save it so, or pip install image"):
        read_volume(tmp_path / "v.tif")


def test_several_arrays_in_a_tiff(tmp_path: Path) -> None:
    with tifffile.TiffWriter(tmp_path / "pages.tif") as file:
        for page in BALL:
            file.write(page, metadata=None)
    with tifffile.TiffWriter(tmp_path / "loop.tif") as file:
        for page in BALL:
            file.write(page)
    for name in ("pages.tif", "loop.tif"):
        volume = read_volume(tmp_path / name)
        assert (volume.values == BALL.transpose(2, 1, 0)).all() and not volume.notes
    with tifffile.TiffWriter(tmp_path / "two.tif") as file:
        file.write(BALL)
        file.write(BALL[:5])
    two = read_volume(tmp_path / "two.tif")
    assert two.values.shape == (12, 12, 12)
    assert two.notes == ["two.tif: the first of 2 arrays in it: 12 x 12 x 12, 5 x 12 x 12"]


def test_oblique_axes_are_refused(tmp_path: Path) -> None:
    path = str(tmp_path / "v.nrrd")
    header = {"space": "left-posterior-superior"}
    turned = [[1.2, 1.6, 0], [-1.6, 1.2, 0], [0, 0, 2]]
    nrrd.write(path, BALL, header | {"space directions": np.array(turned)})
    voxel = read_volume(Path(path)).voxel
    assert voxel is not None
    nrrd.write(
        path, BALL, header | {"space directions": np.array([[2, 0, 0], [1.6, 1.2, 0], turned[2]])}
    )
    with pytest.raises(VolumeError, match="not at right angles"):
        read_volume(Path(path))


def test_channels_of_a_foreign_nrrd_come_first(tmp_path: Path) -> None:
    values = np.stack([BALL, BALL])
    kinds = ["vector", "domain", "domain", "domain"]
    nrrd.write(str(tmp_path / "v.nrrd"), values, {"kinds": kinds})
    assert (read_volume(tmp_path / "v.nrrd").values == BALL).all()
