"""solidtex-measure: reports, files with and without units, refusals."""

import hashlib
import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
import torch
from analytic_volumes import ball, cylinder
from scipy import ndimage

import solidtex

pytest.importorskip("matplotlib")
nrrd = pytest.importorskip("nrrd")
tifffile = pytest.importorskip("tifffile")

from solidtex_export.commands.measure import main  # noqa: E402
from solidtex_export.commands.measure_exemplar import labels_of  # noqa: E402
from solidtex_export.export import random_models  # noqa: E402
from solidtex_export.export.file_format import model_file  # noqa: E402
from solidtex_export.measuring import geometry  # noqa: E402
from solidtex_export.measuring.phases import find_phases  # noqa: E402
from solidtex_export.measuring.voxels import VolumeError  # noqa: E402

QUICK = ["--without", "permeability", "--without", "diffusivity", "--representative", "none"]


def test_labels_are_told_from_grays() -> None:
    labels = find_phases(np.array([[0, 255], [255, 128]], np.uint8), None, "a")
    assert labels.names == (0, 128, 255)
    noise = np.random.default_rng(1).normal(0, 4, (30, 30, 30))
    grays = np.where(ball(10, 30), 60, 180) + noise
    for values in (grays, grays.round().astype(np.uint8)):
        phases = find_phases(values, None, "b")
        assert phases.names == (0, 1) and "by Otsu's method" in phases.note
        assert (phases.of(0) == ball(10, 30)).mean() > 0.999
    split = find_phases(grays, 175.0, "c")
    assert split.of(1).mean() == pytest.approx((grays >= 175).mean())
    with pytest.raises(VolumeError, match="found all values below the threshold 999"):
        find_phases(grays, 999, "d")
    assert not labels.warnings
    stray = np.zeros((20, 20, 20), np.uint8)
    stray[:10], stray[3, 4, 5] = 1, 9
    (warning,) = find_phases(stray, None, "s").warnings
    assert warning.startswith("warning: s: found the label 9 in 0.013 % of all values; if it is a")
    with pytest.raises(VolumeError, match="found one label, 3, in every voxel"):
        find_phases(np.full((4, 4, 4), 3), None, "e")


def measure(tmp_path: Path, volume: Path, *options: str) -> dict:
    report = tmp_path / "report.json"
    assert main([str(volume), "-o", str(report), "--force", *options]) == 0
    return json.loads(report.read_text())


def test_a_tube_measured_by_the_command(tmp_path: Path, capfd) -> None:
    labels = np.where(cylinder(12, 27), 0, 255).astype(np.uint8)[:, :, :4]
    np.save(tmp_path / "tube.npy", labels)
    found = measure(tmp_path, tmp_path / "tube.npy", "--voxel-size", "3um", "--axes", "xz",
                    "--boundary", "periodic", "--representative", "none")  # fmt: skip
    assert found["phase"] == 0 and set(found["phases"]) == {"0", "255"}
    assert "deviation expected among volumes of this size" in capfd.readouterr().out
    z = found["axes"]["z"]
    area = np.count_nonzero(labels[:, :, 0] == 0)
    exact = area**2 / (8 * math.pi) / 27**2 * 9e-12
    assert z["permeability_m2"] == pytest.approx(exact, rel=0.02)
    assert z["permeability_mD"] == pytest.approx(exact / 9.869233e-16, rel=0.02)
    assert z["relative_diffusivity"] == pytest.approx(area / 27**2)
    assert z["tortuosity"] == pytest.approx(1) and z["conducting_fraction"] == 1
    x = found["axes"]["x"]
    assert x["permeability_m2"] == 0 and x["tortuosity"] is None
    assert x["reason"].startswith("no path of phase 0 leads through the volume along x: perm")
    assert x["reason"].endswith("by --phase, another axis by --axes, or a larger volume")


def test_the_report_has_diagrams_and_the_reason(tmp_path: Path) -> None:
    from PIL import Image

    np.save(tmp_path / "ball.npy", ball(10, 32).astype(np.uint8))
    Image.fromarray(ball(10, 32)[:, :, 16].astype(np.uint8)).save(tmp_path / "cut.png")
    page = tmp_path / "report.html"
    options = ["--phase", "1", "--voxel-size", "1um", "--exemplar", str(tmp_path / "cut.png")]
    assert main([str(tmp_path / "ball.npy"), "-o", str(page), *options]) == 0
    text = page.read_text()
    assert text.count("data:image/png;base64,") == 4
    assert "no path of phase 1 leads through the volume along y" in text
    assert "Beside the picture" in text
    assert "voxels of 1.0 µm" in text
    assert "<li>ball.npy: labels 0, 1</li>" in text
    assert "<tr><td>32</td><td>32</td><td>1</td><td>0.1" in text  # the largest cube
    assert "Representative areas of the picture" in text
    assert "<tr><td>32</td><td>32</td><td>1</td><td>0.3" in text  # the largest square


def test_a_report_needs_no_picture_beside_it(tmp_path: Path) -> None:
    np.save(tmp_path / "ball.npy", ball(10, 32).astype(np.uint8))
    page = tmp_path / "report.html"
    options = ["--voxel-size", "1um", "-o", str(page), *QUICK]
    assert main([str(tmp_path / "ball.npy"), *options]) == 0
    text = page.read_text()
    assert "Beside the picture" not in text and text.count("data:image/png;base64,") == 2


def test_tortuosity_and_pore_sizes_are_those_of_taufactor_and_porespy() -> None:
    taufactor = pytest.importorskip("taufactor")
    porespy = pytest.importorskip("porespy")
    transport = pytest.importorskip("solidtex.transport")
    pores = porespy.generators.blobs(shape=[32, 32, 32], porosity=0.5, seed=3)
    fraction = transport.conducting_fraction(pores, 0)
    assert 0.9 < fraction <= 1
    solver = taufactor.Solver(pores.astype(np.uint8), device="cpu")
    solver.solve(verbose=False)
    relative = transport.diffusivity(pores, 0).value
    assert pores.mean() / relative == pytest.approx(float(np.squeeze(solver.tau)), rel=0.02)
    radii, covered = map(np.array, geometry.pore_sizes(pores))
    whole = [1, 2, 3]
    sizes = porespy.filters.local_thickness(pores, sizes=whole)
    for radius in whole:
        expected = np.count_nonzero(sizes >= radius) / np.count_nonzero(pores)
        assert np.interp(radius, radii, covered) == pytest.approx(expected, abs=0.05)


def test_labels_of_a_picture_count_by_their_order(tmp_path: Path, capfd) -> None:
    from PIL import Image

    np.save(tmp_path / "ball.npy", ball(10, 32).astype(np.uint8))
    options = ["--phase", "1", "--voxel-size", "1um", "--exemplar", str(tmp_path / "cut.png")]
    cut = ball(10, 32)[:, :, 16]
    Image.fromarray(np.where(cut, 255, 9).astype(np.uint8)).save(tmp_path / "cut.png")
    found = measure(tmp_path, tmp_path / "ball.npy", *options, *QUICK)
    assert found["exemplar"]["fraction"] == pytest.approx(cut.mean())
    Image.fromarray((cut + np.eye(32)).astype(np.uint8)).save(tmp_path / "cut.png")
    report = ["-o", str(tmp_path / "three.json")]
    out, error = capfd.readouterr()
    assert f"picture  0: {1 - cut.mean():.2%} ± " in out and f", 1: {cut.mean():.2%} ± " in out
    for title, key, solid, picture in (
        ("specific surface (1/µm)", "specific_surface_per_um", found["phases"]["1"],
         found["exemplar"]),
        ("mean chord (µm) along x", "mean_chord_um", found["axes"]["x"],
         found["exemplar"]["axes"]["x"]),
        ("mean pore radius (µm) in slices across z", "mean_pore_radius_um",
         found["exemplar"]["slices"], found["exemplar"]),
    ):  # fmt: skip
        expected = f"{solid[key]:.4g}, picture {picture[key]:.4g}"
        assert f"   {title} of phase 1: {expected}" in out
    assert "cut.png: labels 9, 255" in error
    assert main([str(tmp_path / "ball.npy"), *report, *options, *QUICK]) == 1
    error = capfd.readouterr().err
    assert "cut.png: found 3 labels 0, 1, 2, expected 2 as in the volume" in error
    assert "axis x" not in error  # refused before anything is measured


def test_every_phase_of_a_picture_has_its_fraction_beside_the_solids(tmp_path: Path) -> None:
    from PIL import Image

    rng = np.random.default_rng(4)
    np.save(tmp_path / "three.npy", rng.choice(3, (24, 24, 24), p=[0.5, 0.3, 0.2]))
    cut = rng.choice([7, 40, 255], (60, 50), p=[0.6, 0.3, 0.1]).astype(np.uint8)
    Image.fromarray(cut).save(tmp_path / "cut.png")
    options = ["--voxel-size", "1um", "--exemplar", str(tmp_path / "cut.png"), "--phase", "1"]
    found = measure(tmp_path, tmp_path / "three.npy", *options, *QUICK)
    phases = found["exemplar"]["phases"]
    assert list(phases) == ["0", "1", "2"]
    for label, own in (("0", 7), ("1", 40), ("2", 255)):
        share = (cut == own).mean()
        assert phases[label]["fraction"] == pytest.approx(share)
        independent = np.sqrt(share * (1 - share) / cut.size)
        assert phases[label]["fraction_deviation"] == pytest.approx(independent, rel=0.7)
    for key in ("fraction", "fraction_deviation"):
        assert found["exemplar"][key] == phases["1"][key]
    page = tmp_path / "r.html"
    assert main([str(tmp_path / "three.npy"), "-o", str(page), *options, *QUICK]) == 0
    text = page.read_text()
    for label, figures in phases.items():
        solid = found["phases"][label]
        cells = "".join(
            f"<td>{f['fraction']:.4g} ± {f['fraction_deviation']:.4g}</td>"
            for f in (solid, figures)
        )
        difference = f"<td>{100 * (solid['fraction'] / figures['fraction'] - 1):+.1f} %</td>"
        assert f"<tr><td>fraction of phase {label}</td>{cells}{difference}</tr>" in text
    key = "euler_density_per_um2"
    solid, figures = found["exemplar"]["slices"], found["exemplar"]
    cells = f"<td>{solid[key]:.4g}</td><td>{figures[key]:.4g}</td>"
    assert f"<tr><td>euler density (1/µm²) in slices across z of phase 1</td>{cells}" in text
    assert "<td>specific surface (1/µm) of phase 1</td>" in text


@pytest.mark.parametrize("channels", ["albedo.r albedo.g albedo.b", "phase.a phase.b wear"])
def test_a_picture_has_the_scale_of_the_solid(channels: str, tmp_path: Path, capfd) -> None:
    from PIL import Image

    picture = tmp_path / "bands.png"
    bands = np.arange(64) // 8 % 2 * 120
    Image.fromarray(np.broadcast_to(bands, (72, 64)).astype(np.uint8)).save(picture)
    model = random_models.sampler_model(4, 3, 7)
    model.document["channels"] = channels.split()
    record = {"file": "bands.png", "sha256": hashlib.sha256(picture.read_bytes()).hexdigest()}
    training = {"resolution": 32, "crop": [0, 0, 64, 64], "exemplars": [record]}
    options = ["--size", "16", "--exemplar", str(picture), "--voxel-size", "2um", *QUICK]
    for known, size, note in (
        (training, [32, 32], "as in the training of model.solidtex, 32 x 32 pixels"),
        ({}, [64, 72], "a pixel is taken to be as large as a voxel, 2 um"),
    ):
        model.document["training"] = known
        model_file.write(tmp_path / "model.solidtex", model)
        found = measure(tmp_path, tmp_path / "model.solidtex", *options)["exemplar"]
        assert found["size"] == size
        chord = found["axes"]["x"]["mean_chord_um"]
        assert chord == pytest.approx(8 * size[0] / 64 * 2)  # bands of 8 pixels
        assert f"bands.png: {note}" in capfd.readouterr().err


def test_a_reduced_section_keeps_its_fractions() -> None:
    noise = ndimage.gaussian_filter(np.random.default_rng(2).normal(size=(128, 160)), 1.5)
    phases = np.digitize(noise, np.quantile(noise, [0.1, 0.4]))
    whole = torch.stack([torch.from_numpy(phases == label).float() for label in range(3)])
    assert np.array_equal(labels_of(whole), phases)
    half = torch.nn.functional.avg_pool2d(whole[None], 2)[0]  # shares of quarters: many are equal
    found = np.bincount(labels_of(half).reshape(-1)) / half[0].numel()
    assert found == pytest.approx([0.1, 0.3, 0.6], abs=2e-3)
    largest = np.bincount(half.argmax(0).flatten()) / half[0].numel()
    assert found != pytest.approx(largest, abs=5e-3)


def test_slices_of_the_solid_are_compared_across_the_axis_of_the_picture(
    tmp_path: Path, capfd
) -> None:
    from PIL import Image

    tube = cylinder(9, 30)  # along z
    np.save(tmp_path / "tube.npy", tube.astype(np.uint8))
    command = [str(tmp_path / "tube.npy"), "--phase", "1", "--voxel-size", "2um", *QUICK]
    for across, cut, radius in (("z", tube[:, :, 7], 18), ("y", tube[:, 15, :], 18)):
        Image.fromarray(cut.T.astype(np.uint8)).save(tmp_path / "cut.png")
        found = measure(
            tmp_path, Path(command[0]), *command[1:],
            "--exemplar", str(tmp_path / "cut.png"), "--across", across,
        )["exemplar"]  # fmt: skip
        assert found["across"] == across and list(found["axes"]) == list("xyz".replace(across, ""))
        assert found["mean_pore_radius_um"] == pytest.approx(radius, rel=0.1)
    assert found["axes"]["x"]["mean_chord_um"] == 36 and found["axes"]["z"]["mean_chord_um"] is None
    disks = found["slices"]
    assert disks["euler_density_per_um2"] == pytest.approx(18 / 30 / 60**2)  # 18 of 30 slices
    assert 9 < disks["mean_pore_radius_um"] < 18  # most slices miss the middle of the tube
    with pytest.raises(SystemExit):
        main([*command, "-o", str(tmp_path / "r.json"), "--across", "x"])
    assert "--across: found no --exemplar" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("directions", "before", "across"),
    [
        ("xyz", 0, "z"),
        ("xy", 0, "y"),
        ("x", 0, "x"),
        ("xyz", 1, "y"),
        ("xz", 1, "z"),
        ("x", 2, "z"),
    ],
)
def test_a_model_knows_what_its_picture_is_a_section_across(
    directions: str, before: int, across: str, tmp_path: Path
) -> None:
    from solidtex_export.commands.measure_exemplar import read_exemplar
    from solidtex_export.measuring.voxels import parse_voxel_size

    picture, model = tmp_path / "dots.tif", random_models.sampler_model(4, 3, 7)
    tifffile.imwrite(picture, (np.indices((40, 40)).sum(0) // 4 % 2 * 255).astype(np.uint8))
    record = {"file": "dots.tif", "sha256": hashlib.sha256(picture.read_bytes()).hexdigest()}
    model.document["training"] = {
        "resolution": 40, "directions": directions,
        "exemplars": [{"file": "other.tif", "sha256": "0"}] * before + [record],
    }  # fmt: skip
    model_file.write(tmp_path / "m.solidtex", model)
    size = parse_voxel_size("1um")
    for said, expected in ((None, across), ("z", "z")):
        found, _ = read_exemplar(picture, tmp_path / "m.solidtex", size, said)
        assert found.across == expected and "".join(found.axes) == "xyz".replace(expected, "")


def test_channels_without_names_are_no_gray_values(tmp_path: Path, capfd) -> None:
    first = np.where(ball(10, 32), 0.75, 0.25)
    options = ["-o", str(tmp_path / "r.json"), "--voxel-size", "1um", *QUICK]
    np.save(tmp_path / "v.npy", np.stack([first, 1 - first], 3))
    assert main([str(tmp_path / "v.npy"), *options]) == 1
    error = capfd.readouterr().err
    assert "shape (32, 32, 32, 2) whose 2 channels differ, expected one value a voxel" in error
    assert "bake a model of phases with --labels" in error
    np.save(tmp_path / "v.npy", np.stack([first, first, first], 3))
    assert main([str(tmp_path / "v.npy"), *options]) == 0


def test_names_of_baked_labels_are_in_the_report(tmp_path: Path, capfd) -> None:
    nrrd.write(str(tmp_path / "l.nrrd"), ball(10, 32).astype(np.uint8),
               {"solidtex_labels": "phase.grain phase.pore"}, index_order="F")  # fmt: skip
    report = tmp_path / "r.html"
    options = ["--voxel-size", "1um", "-o", str(report), *QUICK]
    assert main([str(tmp_path / "l.nrrd"), *options]) == 0
    assert "<th>phase pore (1)</th>" in report.read_text()
    assert "grain (0): 8" in capfd.readouterr().out


def test_a_model_is_baked_and_split(tmp_path: Path) -> None:
    model = Path(__file__).parents[2] / "models" / "granite-grey.solidtex"
    found = measure(tmp_path, model, "--size", "32", "--voxel-size", "5um", *QUICK, "--periodic")
    assert found["size"] == [32, 32, 32] and found["boundary"] == "periodic"
    assert any("by Otsu's method" in note for note in found["notes"])
    assert found["phases"]["0"]["fraction"] + found["phases"]["1"]["fraction"] == 1
    options = ["--size", "32", "--voxel-size", "5um", *QUICK, "--periodic"]
    assert measure(tmp_path, Path("granite-grey"), *options)["phases"] == found["phases"]
    assert found["model"] == {
        "name": "granite-grey", "sha256": hashlib.sha256(model.read_bytes()).hexdigest(),
        "seed": 0, "origin": [0, 0, 0], "period": 32,
    }  # fmt: skip


def test_a_material_of_a_space_is_measured(tmp_path: Path, capfd) -> None:
    space = Path(__file__).parents[2] / "models" / "stones.solidtex-space"
    name = solidtex.Space(space).photographs[3]
    options = ["--size", "32", "--voxel-size", "5um", *QUICK]
    found = measure(tmp_path, Path("stones"), "--material", name, *options)
    assert found["file"] == "stones" and found["model"]["name"] == name
    other = measure(tmp_path, space, "--material", name, *options)
    assert other["phases"] == found["phases"] and other["model"] == found["model"]
    ball_file = tmp_path / "v.npy"
    np.save(ball_file, ball(3, 9).astype(np.uint8))
    report = ["-o", str(tmp_path / "r.json"), "--force", *options]
    assert main([str(ball_file), "--material", "x", *report]) == 1
    assert "--material: found x of" in capfd.readouterr().err
    assert main(["stones", "--material", "x", *report]) == 1
    assert "stones: found no photograph x, expected --material NAME" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("stones", "stones: found a texture space, expected --material NAME, one of its 375"),
        (
            "stones",
            "for another material: solidtex-encode PHOTOGRAPH --space stones -o MODEL.sol",
        ),
        (
            "a.raw",
            "found .raw, expected .tif, .tiff, .npy, .nrrd, .nhdr, .vti, .zarr or .solidtex; name",
        ),
        ("a.npz", ".solidtex; save one array as .npy by numpy.save"),
        ("a.zarr", "a.zarr: found no such file, expected a folder; check the path"),
    ],
)
def test_other_files_say_what_to_do(tmp_path: Path, capfd, name: str, message: str) -> None:
    assert main([name, "-o", str(tmp_path / "r.json"), "--voxel-size", "1um"]) == 1
    assert message in capfd.readouterr().err


def test_a_result_of_a_training_says_how_its_model_is_written(tmp_path: Path, capfd) -> None:
    (tmp_path / "rocks").mkdir()
    (tmp_path / "rocks" / "config.json").touch()
    arguments = [str(tmp_path / "rocks"), "-o", str(tmp_path / "r.json"), "--voxel-size", "1um"]
    assert main(arguments) == 1
    assert "rocks -o MODEL.solidtex" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (lambda p: np.save(p, np.eye(8)[None] * np.ones((8, 1, 1))), [],
         "found no voxel size in the file, expected --voxel-size LENGTH"),
        (lambda p: np.save(p, np.eye(8)), ["--voxel-size", "1um"],
         "along three axes; stack slices to one array"),
        (lambda p: p.write_bytes(b"\x93NUMPY junk"), ["--voxel-size", "1um"],
         "found a file that cannot be read as .npy"),
        (lambda p: None, ["--voxel-size", "1um"], "found no such file, expected a volume (.tif"),
        (lambda p: np.save(p, np.full((4, 4, 4), np.nan)), ["--voxel-size", "1um"],
         "found values that are not finite"),
        (lambda p: np.save(p, ball(3, 9)), ["--voxel-size", "1um", "--phase", "7"],
         "--phase: found 7, expected one of the labels of the volume: 0, 1"),
        (lambda p: np.save(p, ball(3, 9)), ["--voxel-size", "1um", "--periodic"],
         "v.npy, expected a model; --boundary periodic repeats volumes"),
        (lambda p: np.save(p, ball(3, 9)), ["--voxel-size", "1"], "without a unit"),
    ],
)  # fmt: skip
def test_refusals(tmp_path: Path, capfd, make, options: list[str], message: str) -> None:
    path = tmp_path / "v.npy"
    make(path)
    assert main([str(path), "-o", str(tmp_path / "r.json"), *options]) == 1
    error = capfd.readouterr().err
    assert message in error and "Traceback" not in error
    assert not os.path.exists(tmp_path / "r.json")


def test_a_picture_that_is_not_finite_is_refused(tmp_path: Path, capfd) -> None:
    np.save(tmp_path / "v.npy", ball(3, 9).astype(np.uint8))
    tifffile.imwrite(tmp_path / "nan.tif", np.full((9, 9), np.nan, np.float32))
    options = ["--voxel-size", "1um", "--exemplar", str(tmp_path / "nan.tif")]
    assert main([str(tmp_path / "v.npy"), "-o", str(tmp_path / "r.json"), *options]) == 1
    assert "nan.tif: found nan at column 0, row 0" in capfd.readouterr().err


def test_a_picture_that_is_missing_is_named(tmp_path: Path, capfd) -> None:
    np.save(tmp_path / "v.npy", ball(3, 9).astype(np.uint8))
    options = ["--voxel-size", "1um", "--exemplar", str(tmp_path / "nix.tif")]
    assert main([str(tmp_path / "v.npy"), "-o", str(tmp_path / "r.json"), *options]) == 1
    assert "nix.tif: found no such file, expected an image" in capfd.readouterr().err


@pytest.mark.parametrize("suffix", [".tif", ".nrrd", ".solidtex"])
def test_files_of_junk_are_refused(tmp_path: Path, capfd, suffix: str) -> None:
    path = tmp_path / f"junk{suffix}"
    for junk in (b"no such thing" * 40, b"II*\0\0\0\0\0"):
        path.write_bytes(junk)
        assert main([str(path), "-o", str(tmp_path / "r.json"), "--voxel-size", "1um"]) == 1
        assert str(path) in capfd.readouterr().err
