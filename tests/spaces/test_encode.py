"""From a photograph to a model: the library, and the program solidtex-encode end to end."""

import getpass
import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import onnxruntime
import OpenImageIO as oiio
import pytest
import tifffile
from PIL import Image
from space_files import KINDS, axes, write

import solidtex
from solidtex_export.commands import train_options
from solidtex_export.images.srgb import srgb_decode
from solidtex_export.spaces.random_space import random_space

BUILD = Path(os.environ["SOLIDTEX_BUILD"])


def photograph(rows: int, columns: int, seed: int = 0) -> np.ndarray:
    """Smooth colors [row, column, 3] in 0 ... 1."""
    rng = np.random.default_rng(seed)
    coarse = Image.fromarray(rng.integers(40, 220, (9, 9, 3), np.uint8))
    return np.asarray(coarse.resize((columns, rows), Image.Resampling.BICUBIC)) / np.float32(255)


def run(*arguments: object, code: int = 0, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [str(BUILD / "bin" / "solidtex-encode"), *map(str, arguments)]
    result = subprocess.run(
        command, capture_output=True, text=True, check=False, env=os.environ | environment
    )
    assert result.returncode == code, result.stderr
    return result


def save(path: Path, image: np.ndarray, **options: object) -> Path:
    Image.fromarray(np.rint(255 * image).astype(np.uint8)).save(path, **options)
    return path


def grid(extent: int, side: int) -> list[int]:
    steps = -(-(extent - side) // (side // 2))
    return [(extent - side) * i // max(1, steps) for i in range(steps + 1)]


@pytest.mark.parametrize("reader", ["engine", "trainer"])
def test_nothing_is_reported_to_others(reader: str, tmp_path: Path) -> None:
    """ONNX Runtime would leave reports of its use in the home folder, and send them."""
    home = tmp_path / "home"
    home.mkdir()
    photo, space = save(tmp_path / "p.png", photograph(64, 64)), write(tmp_path, "lattice")
    program = BUILD / "bin" / "solidtex-encode"
    module = "from pathlib import Path; from solidtex_export.spaces.space_reader import *;"
    commands = {
        "engine": [program, photo, "--space", space, "-o", tmp_path / "a.solidtex"],
        "trainer": [sys.executable, "-c", f"{module} read_space_file(Path({str(space)!r}))"],
    }
    environment = os.environ | {"HOME": str(home), "TMPDIR": str(home)}
    for name in ("ORT_DISABLE_TELEMETRY", "CI", "XDG_CACHE_HOME"):
        environment.pop(name, None)
    subprocess.run(commands[reader], check=True, env=environment)
    left = {path.name for path in home.rglob("*")}
    assert left <= {f"torchinductor_{getpass.getuser()}"}  # PyTorch's, empty


@pytest.mark.parametrize("kind", ["lattice", "linear"])
def test_code_is_the_mean_over_the_grid_of_patches(kind: str, tmp_path: Path) -> None:
    space = solidtex.Space(write(tmp_path, kind))
    image = photograph(64, 71)
    found = space.encode(image)
    affine = axes(image)
    y = image if kind == "linear" else (image - affine[:, 3]) @ np.linalg.inv(affine[:, :3]).T
    patches = np.stack(
        [y[r : r + 32, c : c + 32].transpose(2, 0, 1) for r in grid(64, 32) for c in grid(71, 32)]
    )
    model = random_space(KINDS[kind]).tensors["encoder"].tobytes()
    session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
    codes = session.run(None, {"patches": patches.astype(np.float32)})[0]
    assert np.abs(found.code - codes.mean(0)).max() < 1e-4
    distances = np.linalg.norm(codes[:, None] - codes, axis=2).sum(1)
    medoid = space.encode(image, "medoid").code
    assert np.abs(medoid - codes[distances.argmin()]).max() < 1e-4
    if kind == "lattice":
        assert found.colors is not None and np.abs(found.colors - affine).max() < 1e-5


def test_a_large_photograph_is_reduced_as_in_training(tmp_path: Path) -> None:
    space = solidtex.Space(write(tmp_path, "lattice"))
    image = photograph(200, 260)
    planes = [
        np.asarray(Image.fromarray(image[:, :, c]).resize((83, 64), Image.Resampling.LANCZOS))
        for c in range(3)
    ]
    expected, found = space.encode(np.stack(planes, axis=2)), space.encode(image)
    assert np.abs(found.code - expected.code).max() < 1e-4
    assert found.colors is not None and expected.colors is not None
    assert np.abs(found.colors - expected.colors).max() < 1e-5


def test_grain_along_rows_is_turned_where_the_space_has_upright_grain(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    columns = rng.uniform(0, 1, (1, 64, 3)).astype(np.float32)
    upright = np.broadcast_to(columns, (64, 64, 3)) + rng.normal(0, 0.02, (64, 64, 3))
    lying = upright.transpose(1, 0, 2)
    made = random_space(KINDS["lattice"])
    for directions in ("xyz", "xy"):
        made.document["directions"] = directions
        space = solidtex.Space(write(tmp_path, directions, made))
        difference = space.encode(upright).code - space.encode(lying).code
        assert bool(np.abs(difference).max() < 1e-5) == (directions == "xy")


def test_program_writes_an_ordinary_model(tmp_path: Path) -> None:
    path = write(tmp_path, "bounded")
    photo, out = save(tmp_path / "rock.png", photograph(70, 90)), tmp_path / "mine.solidtex"
    result = run(photo, "--space", path, "-o", out, "--license", "MIT", "--source", "me")
    assert str(out) in result.stdout and "nearest material of the space: stone-" in result.stdout
    texture, space = solidtex.Texture(out), solidtex.Space(path)
    assert texture.name == "rock"
    document = texture.metadata
    digest = hashlib.sha256(photo.read_bytes()).hexdigest()
    wanted = {"file": "rock.png", "sha256": digest, "license": "MIT", "source": "me"}
    assert document["exemplar"] == wanted
    record = document["training"]["space"]
    assert record["sha256"] == space.sha256
    again = space.encode(np.asarray(Image.open(photo)))
    assert np.abs(np.float32(record["code"]) - again.code).max() < 1e-5
    baked = [BUILD / "bin" / "solidtex-info", out]
    said = subprocess.run(baked, capture_output=True, check=True, text=True).stdout
    assert (
        "The structure is valid" in said
        and "CC0-1.0, of the texture space; of the material: not st" in said
    )


def test_program_reads_all_kinds_of_files_alike(tmp_path: Path) -> None:
    path, image = write(tmp_path, "lattice"), photograph(66, 80)
    eight = np.rint(255 * image).astype(np.uint8)
    files = {"png": save(tmp_path / "a.png", image), "exr": tmp_path / "a.exr"}
    linear = srgb_decode(eight / np.float32(255))
    spec = oiio.ImageSpec(80, 66, 3, oiio.FLOAT)
    out = oiio.ImageOutput.create(str(files["exr"]))
    assert out.open(str(files["exr"]), spec) and out.write_image(linear) and out.close()
    turned = Image.Exif()
    turned[0x0112] = 6  # shown after a turn by 90 degrees
    files["turned"] = tmp_path / "t.png"
    Image.fromarray(np.rot90(eight)).save(files["turned"], exif=turned)
    opaque = np.dstack([eight, np.full((66, 80), 255, np.uint8)])
    files["opaque"] = tmp_path / "o.png"
    Image.fromarray(opaque).save(files["opaque"])
    records = {}
    for name, file in files.items():
        run(file, "--space", path, "-o", tmp_path / f"{name}.solidtex")
        training = solidtex.Texture(tmp_path / f"{name}.solidtex").metadata["training"]
        records[name] = np.float32(training["space"]["code"])
    for name in ("exr", "turned", "opaque"):
        assert np.abs(records[name] - records["png"]).max() < 1e-3, name


def test_program_refuses(tmp_path: Path) -> None:
    path, out = write(tmp_path, "lattice"), tmp_path / "m.solidtex"
    good, small = save(tmp_path / "g.png", photograph(64, 64)), tmp_path / "s.png"
    save(small, photograph(31, 90))
    found = run(small, "--space", path, "-o", out, code=1).stderr
    assert "found 90 x 31 pixels, expected at least 32 x 32" in found
    assert "use a larger photograph, or solidtex-train without --space" in found
    plain = save(tmp_path / "plain.png", np.full((64, 64, 3), 0.5, np.float32))
    assert "the same color everywhere" in run(plain, "--space", path, "-o", out, code=1).stderr
    clear = tmp_path / "clear.png"
    Image.fromarray(np.full((64, 64, 4), 128, np.uint8)).save(clear)
    assert "not opaque" in run(clear, "--space", path, "-o", out, code=1).stderr
    assert "cannot read" in run(tmp_path / "no.jpg", "--space", path, "-o", out, code=1).stderr
    (tmp_path / "bad.jpg").write_bytes(good.read_bytes()[:500])
    run(tmp_path / "bad.jpg", "--space", path, "-o", out, code=1)
    (tmp_path / "text.png").write_text("no image")
    assert (
        "no readable image" in run(tmp_path / "text.png", "--space", path, "-o", out, code=1).stderr
    )
    assert "ends in .solidtex" in run(good, "--space", path, "-o", tmp_path / "m", code=1).stderr
    assert "no texture space is named" in run(good, "--space", "none", "-o", out, code=1).stderr
    assert run(good, "--space", path, code=2).stderr
    assert not list(tmp_path.glob("*.solidtex"))
    out.write_text("mine")
    assert "--force" in run(good, "--space", path, "-o", out, code=1).stderr
    assert out.read_text() == "mine"
    named = good.rename(tmp_path / "photo.solidtex")
    found = run(named, "--space", path, "-o", named, "--force", code=1).stderr
    assert "never replaced" in found
    named.rename(good)
    run(good, "--space", path, "-o", out, "--force")
    assert solidtex.Texture(out).name == "g"


def test_program_refuses_damaged_and_huge_files(tmp_path: Path) -> None:
    path, out = write(tmp_path, "lattice"), tmp_path / "m.solidtex"
    whole = save(tmp_path / "whole.jpg", photograph(64, 64)).read_bytes()
    (tmp_path / "part.jpg").write_bytes(whole[: len(whole) // 2])
    frames = [Image.fromarray(np.full((64, 64), v, np.uint8)) for v in (0, 200)]
    frames[0].save(tmp_path / "frames.gif", save_all=True, append_images=frames[1:])
    (tmp_path / "wide.hdr").write_bytes(
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2000000000 +X 2000000000\n"
    )
    (tmp_path / "minus.ppm").write_bytes(b"P6 -5 5 255\n")
    (tmp_path / "long.ppm").write_bytes(b"P6 64 9999999 255\n")
    unknown = bytearray(784)  # one of OpenImageIO 2.4's readers ends the process here
    unknown[25] = unknown[665] = 3
    (tmp_path / "unknown").write_bytes(unknown)
    wrong = {
        "unknown": "found no readable image (it begins like none of PNG, JPEG",
        "part.jpg": "found a damaged or unfinished image",
        "frames.gif": "found several images (frames, pages or parts)",
        "wide.hdr": "2000000000 x 2000000000 pixels of 3 channels, expected at most 4294 million",
        "minus.ppm": "minus.ppm: found ",
        "long.ppm": "64 x 9999999 pixels, expected sides that differ by less than a factor of 64",
    }
    for name, message in wrong.items():
        refused = run(tmp_path / name, "--space", path, "-o", out, code=1).stderr
        assert f"{tmp_path / name}: " in refused and message in refused
    assert not out.exists()


def test_program_refuses_what_is_no_rgb_photograph(tmp_path: Path) -> None:
    path, out = write(tmp_path, "lattice"), tmp_path / "m.solidtex"
    pixels = np.full((64, 64, 3), 128, np.uint8)
    Image.new("CMYK", (64, 64)).save(tmp_path / "cmyk.jpg")
    tifffile.imwrite(tmp_path / "lab.tif", pixels, photometric="cielab")
    tifffile.imwrite(tmp_path / "thumbnail.tif", pixels, photometric="rgb", subfiletype=1)
    tifffile.imwrite(tmp_path / "raw.tif", pixels[:, :, 0], photometric="cfa")
    tifffile.imwrite(tmp_path / "mask.tif", pixels[:, :, 0], photometric="mask")
    for name, words in (
        ("cmyk.jpg", "found CMYK inks, whose colors depend on a printer, expected RGB; convert"),
        ("lab.tif", "found CIE L*a*b* values, expected RGB; convert it to sRGB first"),
        ("thumbnail.tif", "found a thumbnail, marked as a reduced copy of another image, expected"),
        ("raw.tif", "found a camera's raw data, expected a developed image (for example dark"),
        ("mask.tif", "found a transparency mask, expected an image"),
    ):
        found = run(tmp_path / name, "--space", path, "-o", out, code=1).stderr
        assert f"{tmp_path / name}: {words}" in found
        assert not out.exists()


def test_without_onnx_runtime_the_program_says_what_is_missing(tmp_path: Path) -> None:
    path, photo = write(tmp_path, "lattice"), save(tmp_path / "g.png", photograph(64, 64))
    out = tmp_path / "m.solidtex"
    found = run(
        photo, "--space", path, "-o", out, code=1, SOLIDTEX_ONNXRUNTIME="/none/lib.so"
    ).stderr
    assert "needs ONNX Runtime" in found and "pip install onnxruntime" in found
    assert len(found.splitlines()) == 1 and not out.exists()


@pytest.mark.parametrize("is_far", [False, True])
def test_a_training_is_advised_and_a_far_photograph_reported(is_far: bool, tmp_path: Path) -> None:
    made, photo = random_space(KINDS["lattice"]), save(tmp_path / "g.png", photograph(64, 64))
    path = write(tmp_path, "lattice", made)
    made.tensors["codes"][0] = solidtex.Space(path).encode(np.asarray(Image.open(photo))).code
    made.tensors["codes"] += np.float32(1000 * is_far)
    path = write(tmp_path, "lattice", made)
    found = run(photo, "--space", path, "-o", tmp_path / "m.solidtex").stderr
    assert ("has seen nothing like it" in found) == is_far
    train = f"solidtex-train {photo} --space {path} --minutes 1 -o results/g"
    assert f"A minute of training brings it closer: {train}\n" in found
    words = train.split()[1:]
    assert train_options.parser().parse_args(words).result == Path("results/g")


def test_help_and_version() -> None:
    assert "solidtex-encode photo.jpg --space stones -o mine.solidtex" in run("--help").stdout
    assert run("--version").stdout.strip() == f"solidtex-encode {solidtex.__version__}"


def test_info_prints_a_space(tmp_path: Path) -> None:
    path = write(tmp_path, "lattice")
    command = [BUILD / "bin" / "solidtex-info", path]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    for word in ("stone-4 (CC0-1.0)", "4 numbers", "levels: 3", solidtex.Space(path).sha256):
        assert word in text
    assert "The structure is valid." in text
    environment = os.environ | {"SOLIDTEX_MODEL_PATH": str(tmp_path)}
    command[1] = path.stem
    named = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    assert named.stdout == text
    command[1] = "no-such-name"
    none = subprocess.run(command, capture_output=True, text=True, check=False)
    assert none.returncode == 1 and 'no model is named "no-such-name"' in none.stderr
