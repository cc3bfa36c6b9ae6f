"""Voxels of solidtex-measure: values and sizes as files say them, sizes as an option."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
nrrd = pytest.importorskip("nrrd")
tifffile = pytest.importorskip("tifffile")

from solidtex_export.commands.measure import main  # noqa: E402
from solidtex_export.measuring.volumes import read_volume  # noqa: E402
from solidtex_export.measuring.voxels import VolumeError, parse_voxel_size  # noqa: E402

VALUES = np.arange(6 * 5 * 7).reshape(6, 5, 7).astype(np.uint8) % 2
QUICK = ["--without", "permeability", "--without", "diffusivity", "--representative", "none"]


@pytest.mark.parametrize(
    ("text", "meters"),
    [
        ("2.25um", 2.25e-6),
        ("2.25 µm", 2.25e-6),
        ("2.25 Micrometers", 2.25e-6),
        ("1e3nm", 1e-6),
        ("5mm,5mm,5mm", 5e-3),
        ("2,2,2 um", 2e-6),
    ],
)
def test_voxel_sizes(text: str, meters: float) -> None:
    assert parse_voxel_size(text).meters == pytest.approx(meters)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("2.25", "--voxel-size: found '2.25' without a unit, expected one of nm, um"),
        (
            "2 furlongs",
            "--voxel-size: found the unit 'furlongs', expected one of nm, um, mm, cm, m;"
            " convert the length",
        ),
        ("um", "--voxel-size: found 'um', expected a number and a unit"),
        ("0um", "--voxel-size: found 0, expected a number above 0"),
        ("-1um", "--voxel-size: found -1, expected a number above 0"),
        ("1,1,2um", "--voxel-size: found voxels of 1 x 1 x 2 um, expected cubes: resample"),
        ("1um,1um,2um", "--voxel-size: found voxels of 1 x 1 x 2 um, expected cubes: resample"),
        ("1um,2um", "--voxel-size: found 2 lengths in '1um,2um', expected 1"),
        ("1um,1mm,1um", "--voxel-size: found the units mm, um, expected one"),
    ],
)
def test_voxel_sizes_that_are_refused(text: str, message: str) -> None:
    with pytest.raises(VolumeError) as caught:
        parse_voxel_size(text)
    assert str(caught.value).startswith(message)


def measure(tmp_path: Path, volume: Path, *options: str) -> dict:
    report = tmp_path / "report.json"
    assert main([str(volume), "-o", str(report), "--force", *options]) == 0
    return json.loads(report.read_text())


def refused(path: Path, capfd) -> str:
    assert main([str(path), "-o", str(path.with_name("r.json")), *QUICK]) == 1
    return capfd.readouterr().err


def save_ome(path: Path, **metadata: object) -> None:
    tifffile.imwrite(path, VALUES, ome=True, metadata={"axes": "ZYX"} | metadata)


def save_nrrd(path: Path, **header: object) -> None:
    named = {name.replace("_", " "): value for name, value in header.items()}
    nrrd.write(str(path), VALUES, named, index_order="F")


SIZES = {"PhysicalSizeX": 2.0, "PhysicalSizeY": 2.0}
DIRECTIONS = {"space": "RAS", "space_directions": np.diag([2, 2, 0.002])}


@pytest.mark.parametrize(
    ("save", "name", "metadata"),
    [
        (save_ome, "v.ome.tif", SIZES | {"PhysicalSizeZ": 2000.0, "PhysicalSizeZUnit": "nm"}),
        (save_nrrd, "v.nrrd", {"spacings": [2, 0.002, 2], "units": ["um", "mm", "um"]}),
        (save_nrrd, "v.nrrd", {**DIRECTIONS, "space_units": ["microns", "um", "mm"]}),
    ],
)
def test_each_axis_of_a_file_has_its_own_unit(
    tmp_path: Path, save: Callable[..., None], name: str, metadata: dict
) -> None:
    save(tmp_path / name, **metadata)
    found = read_volume(tmp_path / name).voxel
    assert found is not None and found.unit == "um" and not found.is_z_assumed
    assert found.cubic(name).value == pytest.approx(2)


@pytest.mark.parametrize(
    ("save", "name", "metadata"),
    [
        (save_ome, "v.ome.tif", SIZES | {"PhysicalSizeZ": 2.0, "PhysicalSizeZUnit": "nm"}),
        (save_nrrd, "v.nrrd", {"spacings": [2, 2, 2], "units": ["um", "um", "nm"]}),
        (save_nrrd, "v.nrrd", {"space": "RAS", "space_directions": np.eye(3) * 2,
                               "space_units": ["um", "um", "nm"]}),
    ],
)  # fmt: skip
def test_equal_numbers_of_different_units_are_no_cubes(
    tmp_path: Path, capfd, save: Callable[..., None], name: str, metadata: dict
) -> None:
    save(tmp_path / name, **metadata)
    error = refused(tmp_path / name, capfd)
    assert "found voxels of 2 x 2 x 0.002 um, expected cubes" in error


def save_imagej(path: Path, **metadata: object) -> None:
    more = {"axes": "ZYX", "spacing": 2.25} | metadata
    tifffile.imwrite(path, VALUES, imagej=True, resolution=(4 / 9, 4 / 9), metadata=more)


def save_plain(path: Path, **options: object) -> None:
    tifffile.imwrite(path, VALUES, **options)


@pytest.mark.parametrize(
    "unit", [r"\u00B5m", "um", "micron", "microns", "micrometer", "micrometers", "Micrometres"]
)
def test_spellings_of_a_micrometer(tmp_path: Path, unit: str) -> None:
    save_imagej(tmp_path / "v.tif", unit=unit)
    found = read_volume(tmp_path / "v.tif").voxel
    assert found is not None and str(found.cubic("v")) == "2.25 um"


@pytest.mark.parametrize(
    ("save", "name", "metadata", "message"),
    [
        (save_imagej, "v.tif", {}, "2.25 without a unit"),
        (save_imagej, "v.tif", {"unit": "pixel"}, "2.25 in pixel"),
        (save_imagej, "v.tif", {"unit": "inch"}, "2.25 in inch"),
        (save_plain, "v.tif", {"resolution": (4000, 4000), "resolutionunit": "CENTIMETER"},
         "0.00025 in centimeters by ResolutionUnit"),
        (save_nrrd, "v.nrrd", {"spacings": [2.25, 2.25, 4]}, "2.25 x 2.25 x 4 without a unit"),
        (save_nrrd, "v.nrrd", {"spacings": [2, 2, 2], "units": ["um", "um", "furlong"]},
         "2 in um, um, furlong"),
        (save_nrrd, "v.nrrd", {"space": "LPS", "space_directions": np.eye(3) * 2},
         "2 without a unit"),
        (save_ome, "v.ome.tif", SIZES | {"PhysicalSizeXUnit": "pixel"}, "2 in pixel, um, pixel"),
    ],
)  # fmt: skip
def test_sizes_without_a_unit_of_length_are_named(
    tmp_path: Path, capfd, save: Callable[..., None], name: str, metadata: dict, message: str
) -> None:
    path = tmp_path / name
    save(path, **metadata)
    error = refused(path, capfd)
    assert f"{path}: found voxels of {message}, expected a unit of length" in error
    assert "LENGTH, such as --voxel-size 2" in error
    found = measure(tmp_path, path, *QUICK, "--voxel-size", "3um")
    assert f"voxel size: 3 um as given, the file says {message}" in found["notes"]


@pytest.mark.parametrize(
    ("save", "name", "metadata"),
    [
        (save_plain, "v.tif", {}),
        (save_plain, "v.tif", {"imagej": True, "metadata": {"axes": "ZYX", "unit": "pixel"}}),
        (save_nrrd, "v.nrrd", {"space": "LPS", "space_directions": np.eye(3)}),
        (save_nrrd, "v.nrrd", {}),
    ],
)
def test_edges_that_programs_write_for_unknown_ones_are_no_size(
    tmp_path: Path, capfd, save: Callable[..., None], name: str, metadata: dict
) -> None:
    save(tmp_path / name, **metadata)
    assert "found no voxel size in the file" in refused(tmp_path / name, capfd)


def test_a_report_says_that_z_is_taken_as_x(tmp_path: Path) -> None:
    note = "voxel size: the file says nothing of z: taken as x"
    save_ome(tmp_path / "v.ome.tif", **SIZES)
    imagej = {"imagej": True, "resolution": (0.5, 0.5)}
    tifffile.imwrite(tmp_path / "v.tif", VALUES, metadata={"axes": "ZYX", "unit": "um"}, **imagej)
    for name in ("v.ome.tif", "v.tif"):
        found = measure(tmp_path, tmp_path / name, *QUICK)
        assert found["voxel_size"] == {"value": 2, "unit": "um"}
        assert note in found["notes"]
        given = measure(tmp_path, tmp_path / name, *QUICK, "--voxel-size", "3um")
        assert note not in given["notes"]
    metadata = {"axes": "ZYX", "unit": "um", "zunit": "nm", "spacing": 2000}
    tifffile.imwrite(tmp_path / "v.tif", VALUES, metadata=metadata, **imagej)
    assert note not in measure(tmp_path, tmp_path / "v.tif", *QUICK)["notes"]


def test_sizes_and_axes_of_files(tmp_path: Path, capfd) -> None:
    volume = np.zeros((5, 6, 7), np.uint8)
    volume[0, 1, 2] = 1
    pages = volume.transpose(2, 1, 0)
    imagej = {"imagej": True, "resolution": (2, 2)}
    metadata = {"axes": "ZYX", "spacing": 0.5, "unit": "um"}
    tifffile.imwrite(tmp_path / "a.tif", pages, metadata=metadata, **imagej)
    ome = {"axes": "ZYX"} | {f"PhysicalSize{axis}": 0.5 for axis in "XYZ"}
    tifffile.imwrite(tmp_path / "b.ome.tif", pages, metadata=ome, ome=True)
    nrrd.write(str(tmp_path / "c.nrrd"), volume,
               {"space directions": np.eye(3) * 0.5, "space units": ["um"] * 3, "space": "RAS"},
               index_order="F")  # fmt: skip
    for name in ("a.tif", "b.ome.tif", "c.nrrd"):
        found = read_volume(tmp_path / name)
        assert (found.values == volume).all(), name
        assert found.voxel is not None, name
        assert found.voxel.cubic(name).meters == pytest.approx(5e-7), name
    flat = metadata | {"spacing": 2.0}
    tifffile.imwrite(tmp_path / "flat.tif", pages, metadata=flat, **imagej)
    options = ["-o", str(tmp_path / "r.json"), *QUICK]
    assert main([str(tmp_path / "flat.tif"), *options]) == 1
    assert "found voxels of 0.5 x 0.5 x 2 um, expected cubes" in capfd.readouterr().err
    assert main([str(tmp_path / "flat.tif"), "--voxel-size", "1um", *options]) == 0
    assert "1 um as given, the file says 0.5 x 0.5 x 2 um" in capfd.readouterr().err


@pytest.mark.parametrize("place", ["point_data", "cell_data"])
def test_vtk_images(tmp_path: Path, capfd, place: str) -> None:
    pyvista = pytest.importorskip("pyvista")
    volume = np.arange(5 * 6 * 7, dtype=np.uint8).reshape(5, 6, 7) % 3
    sides = np.array(volume.shape) + (place == "cell_data")
    image = pyvista.ImageData(dimensions=sides, spacing=(0.5, 0.5, 0.5))
    getattr(image, place)["first"] = volume.ravel(order="F")
    image.save(tmp_path / "v.vti")
    found = read_volume(tmp_path / "v.vti")
    assert (found.values == volume).all() and found.voxel is not None
    assert found.voxel.edges == (0.5, 0.5, 0.5)
    getattr(image, place)["second"] = volume.ravel(order="F")
    image.set_active_scalars(None)
    image.save(tmp_path / "two.vti")
    options = ["-o", str(tmp_path / "r.json"), "--voxel-size", "1um"]
    assert main([str(tmp_path / "two.vti"), *options]) == 1
    assert "found arrays first, second, expected one" in capfd.readouterr().err
    pyvista.Sphere().save(tmp_path / "s.vtp")
    (tmp_path / "s.vtp").rename(tmp_path / "s.vti")
    assert main([str(tmp_path / "s.vti"), *options]) == 1
    assert "cannot be read as .vti" in capfd.readouterr().err


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_ome_zarr_images(tmp_path: Path, version: str) -> None:
    zarr = pytest.importorskip("zarr", minversion="3")
    axes = [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]
    image = {
        "axes": [{"name": "t", "type": "time"}, *axes],
        "datasets": [{"path": "0", "coordinateTransformations": [scaled(1, 1, 1, 1)]}],
        "coordinateTransformations": [scaled(1, 0.5, 0.5, 0.5)],
    }
    group = zarr.open_group(tmp_path / "v.zarr", zarr_format=2 if version == "0.4" else 3)
    level = group.create_array("0", shape=(1, 7, 5, 6), chunks=(1, 4, 4, 4), dtype="uint8")
    level[0] = VALUES.T
    with pytest.raises(VolumeError, match=r"found no multiscales .* expected an OME-Zarr"):
        read_volume(tmp_path / "v.zarr")
    ome = {"multiscales": [image], "version": version}
    group.attrs.update(ome if version == "0.4" else {"ome": ome})
    found = read_volume(tmp_path / "v.zarr")
    assert (found.values == VALUES).all()
    assert found.voxel is not None and found.voxel.cubic("v").meters == pytest.approx(5e-7)
    assert found.channels == ()
    (tmp_path / "empty.zarr").mkdir()
    with pytest.raises(VolumeError, match="cannot be read as"):
        read_volume(tmp_path / "empty.zarr")


def scaled(*edges: float) -> dict[str, object]:
    return {"type": "scale", "scale": list(edges)}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"axes": [{"name": name} for name in "yx"]}, "no array 0 with 2 axes"),
        ({"axes": [{"name": name} for name in "tyx"]}, "axes: found 7 along t, 5 along y, 6 along"),
        ({"axes": [{"name": name} for name in "yyx"]}, "no array 0 with 2 axes"),
        ({"axes": 3}, "damaged attributes"),
        ({"datasets": []}, "damaged attributes"),
        ({"coordinateTransformations": [scaled(1, 2)]}, "found a scale of 2 numbers, expected 3"),
        ({"coordinateTransformations": [scaled(float("nan"), 1, 1)]}, ""),
    ],
)
def test_damaged_ome_zarr(tmp_path: Path, change: dict[str, object], message: str) -> None:
    zarr = pytest.importorskip("zarr", minversion="3")
    image = {
        "axes": [{"name": name} for name in "zyx"],
        "datasets": [{"path": "0", "coordinateTransformations": [{"type": "identity"}]}],
    }
    group = zarr.open_group(tmp_path / "v.zarr")
    group.create_array("0", data=np.ascontiguousarray(VALUES.T))
    group.attrs["ome"] = {"multiscales": [image | change]}
    if message:
        with pytest.raises(VolumeError, match=message):
            read_volume(tmp_path / "v.zarr")
    else:
        assert read_volume(tmp_path / "v.zarr").voxel is None


def test_channels_of_ome_zarr_without_labels_have_no_names(tmp_path: Path) -> None:
    zarr = pytest.importorskip("zarr", minversion="3")
    image = {
        "axes": [{"name": name} for name in "czyx"],
        "datasets": [{"path": "0", "coordinateTransformations": [scaled(1, 1, 1, 1)]}],
    }
    group = zarr.open_group(tmp_path / "v.zarr")
    group.create_array("0", data=np.stack([VALUES.T, 1 - VALUES.T]))
    colors = [{"color": "FF0000"}, {"color": "00FF00"}]
    group.attrs["ome"] = {"multiscales": [image], "omero": {"channels": colors}}
    with pytest.raises(VolumeError, match="whose 2 channels differ"):
        read_volume(tmp_path / "v.zarr")
