"""solidtex-bake on meshes: colors of vertices, and the image of a UV atlas."""

import json
import os
import resource
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from meshes import cube_obj, cube_surface, read_ply

import solidtex

REPOSITORY = Path(__file__).resolve().parents[2]
BAKE = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-bake"
MODEL = "granite-speckled"
VASE = REPOSITORY / "scenes" / "meshes" / "vase.ply"
SCALE, ORIGIN = 20.0, (7, -3, 1000)
PLACED = ("--texels-per-unit", SCALE, "--origin", ",".join(map(str, ORIGIN)), "--seed", "4")
SIZE, MARGIN = 96, 3


def bake(*arguments: object, model: str = MODEL, **options) -> subprocess.CompletedProcess[str]:
    command = [str(BAKE), model, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


def baked(*arguments: object, model: str = MODEL) -> str:
    result = bake(*arguments, model=model)
    assert result.returncode == 0, result.stderr
    return result.stderr


def light(encoded: np.ndarray) -> np.ndarray:
    encoded = encoded.astype(np.float64)
    return np.where(encoded > 0.04045, ((encoded + 0.055) / 1.055) ** 2.4, encoded / 12.92)


def positions(vertices: np.ndarray) -> np.ndarray:
    return np.stack([vertices[name] for name in "xyz"], axis=-1)


def radii_of(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Half of the mean length of the edges at each vertex."""
    sums, counts = np.zeros(len(points)), np.zeros(len(points))
    for a, b in ((0, 1), (1, 2), (2, 0)):
        ends = triangles[:, [a, b]]
        lengths = np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1)
        for end in ends.T:
            np.add.at(sums, end, lengths)
            np.add.at(counts, end, 1)
    return sums / np.maximum(2 * counts, 1)


def test_vertices_have_the_means_of_their_neighborhoods(tmp_path: Path) -> None:
    out = tmp_path / "vase.ply"
    baked("--mesh", VASE, "--to", "vertex-color", "-o", out, *PLACED)
    (before, faces), (after, same_faces) = read_ply(VASE), read_ply(out)
    assert after.dtype.names == (*before.dtype.names, "red", "green", "blue")
    assert all((after[name] == before[name]).all() for name in before.dtype.names)
    assert (same_faces == faces).all()
    points, radii = SCALE * positions(before).astype(np.float64), radii_of(positions(before), faces)
    texture = solidtex.Texture(MODEL, seed=4)
    values = texture.eval_points(points, ORIGIN, radii=SCALE * radii)
    colors = np.stack([after[name] for name in ("red", "green", "blue")], axis=-1)
    assert np.abs(colors - 255 * values.clip(0, 1)).max() < 0.6 and colors.std() > 5


def test_float_colors_are_linear_and_other_channels_are_written_too(tmp_path: Path) -> None:
    cube, out = cube_obj(tmp_path / "cube.obj"), tmp_path / "cube.ply"
    arguments = ("--mesh", cube, "--to", "vertex-color", "--color-type", "float", "-o", out)
    said = baked(*arguments, model="paint-rusted")
    assert "--texels-per-unit 256" in said  # 512 texels for two units
    vertices, faces = read_ply(out)
    names = ("x", "y", "z", "s", "t", "red", "green", "blue", "roughness", "height")
    assert vertices.dtype.names == names and len(vertices) == 24 and len(faces) == 12
    radii = 256 * radii_of(positions(vertices), faces)
    texture = solidtex.Texture("paint-rusted")
    values = texture.eval_points(256 * positions(vertices), radii=radii)
    values[:, :3] = light(values[:, :3])
    assert np.allclose(np.stack([vertices[n] for n in names[5:]], axis=-1), values, atol=1e-5)


def texel_centers() -> np.ndarray:
    """(u, v) of each texel [y, x, 2]."""
    steps = (np.arange(SIZE) + 0.5) / SIZE
    u, v = np.meshgrid(steps, 1 - steps)
    return np.stack([u, v], axis=-1)


@pytest.fixture(scope="module")
def atlas(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    folder = tmp_path_factory.mktemp("atlas")
    cube, out = cube_obj(folder / "cube.obj"), folder / "cube.exr"
    arguments = ("--mesh", cube, "--to", "uv", "--size", SIZE, "--margin", MARGIN)
    said = baked(*arguments, "-o", out, *PLACED)
    assert "more than one triangle" not in said
    again = folder / "again.exr"
    baked(*arguments, "-o", again, *PLACED, "--threads", 1)
    assert out.read_bytes() == again.read_bytes()
    image = oiio.ImageBuf(str(out))
    assert image.spec().channelnames == ("R", "G", "B") and image.spec().format == "float"
    return image.get_pixels(oiio.FLOAT)


def test_texels_are_means_over_their_footprints(atlas: np.ndarray) -> None:
    inside, points, slopes = cube_surface(texel_centers())
    axes = np.zeros((inside.sum(), 3, 3))
    axes[:, :2] = slopes[inside] * SCALE / SIZE / 2
    texture = solidtex.Texture(MODEL, seed=4)
    values = texture.eval_points(SCALE * points[inside], ORIGIN, axes=axes)
    assert inside.mean() > 0.5 and values.std() > 0.01
    assert np.abs(atlas[inside] - light(values)).max() < 2e-5


def test_charts_are_dilated_by_the_margin(atlas: np.ndarray) -> None:
    inside, _, _ = cube_surface(texel_centers())
    places = np.argwhere(inside)
    near, far = 0, 0
    for y, x in np.argwhere(~inside):
        squares = np.square(places - (y, x)).sum(axis=1)
        if squares.min() > MARGIN**2:
            assert not atlas[y, x].any()
            far += 1
            continue
        candidates = places[squares == squares.min()]
        assert any((atlas[y, x] == atlas[tuple(place)]).all() for place in candidates)
        near += 1
    assert near > 1000 and far > 50


def test_overlapping_charts_are_reported(tmp_path: Path) -> None:
    cube = cube_obj(tmp_path / "cube.obj")
    cube.write_text(cube.read_text() + "v 0 0 5\nv 1 0 5\nv 0 1 5\nf -3/1 -2/2 -1/3\n")
    said = baked("--mesh", cube, "--to", "uv", "--size", 64, "-o", tmp_path / "a.exr")
    assert "texels lie in more than one triangle" in said


def wedge_ply(path: Path, obj: Path) -> Path:
    """The mesh of an OBJ as a PLY whose faces have texture coordinates of their own."""
    lines = [line.split() for line in obj.read_text().splitlines()]
    vertices = [" ".join(words[1:]) for words in lines if words[0] == "v"]
    uvs = [" ".join(words[1:]) for words in lines if words[0] == "vt"]
    faces = [[int(w.split("/")[0]) - 1 for w in words[1:]] for words in lines if words[0] == "f"]
    unique = list(dict.fromkeys(vertices))
    rows = [
        f"{len(face)} {' '.join(str(unique.index(vertices[i])) for i in face)} "
        f"{2 * len(face)} {' '.join(uvs[i] for i in face)} 0"
        for face in faces
    ]
    header = ["ply", "format ascii 1.0", f"element vertex {len(unique)}"]
    header += [f"property float {axis}" for axis in "xyz"]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    header += ["property list uchar float texcoord", "property int texnumber", "end_header"]
    path.write_text("\n".join([*header, *unique, *rows]) + "\n")
    return path


def test_texture_coordinates_of_corners_give_the_same_atlas(
    tmp_path: Path, atlas: np.ndarray
) -> None:
    wedge = wedge_ply(tmp_path / "CUBE.PLY", cube_obj(tmp_path / "cube.obj"))
    out = tmp_path / "wedge.exr"
    arguments = ("--mesh", wedge, "--to", "uv", "--size", SIZE, "--margin", MARGIN)
    baked(*arguments, "-o", out, *PLACED)
    assert (oiio.ImageBuf(str(out)).get_pixels(oiio.FLOAT) == atlas).all()


def test_missing_parts_of_a_file_are_named(tmp_path: Path) -> None:
    mesh = wedge_ply(tmp_path / "cube.ply", cube_obj(tmp_path / "cube.obj"))
    text = mesh.read_text()
    mesh.write_text(text.replace("element face 6", "element face 7") + "0 0 0\n")
    said = baked("--mesh", mesh, "--to", "uv", "--size", 64, "-o", tmp_path / "a.exr")
    assert "1 face with fewer than three different vertices left out" in said
    mesh.write_text(text.replace("element face 6", "element face 9"))
    result = bake("--mesh", mesh, "--to", "uv", "--size", 64, "-o", tmp_path / "b.exr")
    assert result.returncode == 1
    assert "found 6 of the 9 faces that the header promises" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--mesh", VASE, "--to", "uv", "-o", "a.exr"], 1, "found no texture coordinates"),
        (["--mesh", "wide.obj", "--to", "uv", "-o", "a.exr"], 1, "coordinates (2.5"),
        (["--mesh", "flat.obj", "--to", "uv", "-o", "a.exr"], 1, "without any area"),
        (["--mesh", "point.obj", "--to", "vertex-color", "-o", "a.ply"], 1, "all vertices at one"),
        (["--mesh", "none.obj", "--to", "uv", "-o", "a.exr"], 1, "none.obj: found no such file"),
        (["--mesh", "a.stl", "--to", "uv", "-o", "a.exr"], 1, "found no such file"),
        (["--mesh", VASE, "--to", "uv", "-o", "a.png"], 1, "-o a.png: expected a name that ends"),
        (["--mesh", VASE, "--to", "vertex-color", "-o", "a.exr"], 1, "ends in .ply"),
        (["--mesh", VASE, "--to", "vertex-color", "--size", 4, "-o", "a.ply"], 1, "--size: found"),
        (["--mesh", VASE, "--to", "uv", "--size", "4,4,5", "-o", "a.exr"], 1, "--size 4,4,5"),
        (["--mesh", VASE, "--to", "uv", "--size", 99999, "-o", "a.exr"], 1, "up to 16384"),
        (["--mesh", VASE, "--to", "color", "-o", "a.exr"], 2, "--to"),
        (["--mesh", VASE, "-o", "a.exr"], 2, "--to uv -o FILE.exr"),
        (["--mesh", VASE, "-o", "a.png"], 2, "found -o a.png, expected -o FILE.glb, --maps albedo"),
        (["--mesh", VASE, "--maps", "normal", "-o", "a"], 1, "no channel height"),
        (["--mesh", VASE, "--maps", "gloss", "-o", "a"], 1, "--maps gloss"),
        (["--mesh", VASE, "--maps", "albedo", "--to", "uv", "-o", "a"], 2, "--maps"),
        (["--mesh", VASE, "--maps", "albedo", "--format", "npy", "-o", "a"], 2, "png or exr"),
        (["--mesh", VASE, "--to", "uv", "--format", "exr", "-o", "a.exr"], 2, "with --to uv"),
        (["--mesh", VASE, "--format", "png", "-o", "a.glb"], 2, "none with a .glb"),
        (["--mesh", VASE, "--normal-map", "directx", "-o", "a.glb"], 2, "the normals of glTF"),
        (["--mesh", VASE, "--to", "uv", "--normal-map", "directx", "-o", "a.exr"], 2, "--maps"),
        (["--mesh", VASE, "-o", "a.glb", "--checkpoint", "c"], 1, "--checkpoint: found"),
        (["--to", "uv", "-o", "a.exr"], 2, "requires --mesh"),
        (["--margin", 4, "-o", "a.npy"], 2, "requires --mesh"),
        (["--mesh", VASE, "--to", "uv", "-o", "a.exr", "--texels-per-unit", 0], 2, "--texels-per"),
        (["--mesh", VASE, "--to", "uv", "-o", "there.exr"], 1, "exists already"),
    ],
)
def test_refusals(tmp_path: Path, arguments: list, code: int, message: str) -> None:
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    face = "f 1/1 2/2 3/3\n"
    (tmp_path / "wide.obj").write_text(corners + "vt 0 0\nvt 2.5 0\nvt 0 1\n" + face)
    (tmp_path / "flat.obj").write_text(corners + "vt 0 0\nvt 0.5 0.5\nvt 1 1\n" + face)
    (tmp_path / "point.obj").write_text("v 0 0 0\n" * 3 + "f 1 2 3\n")
    (tmp_path / "there.exr").write_text("old")
    before = sorted(os.listdir(tmp_path))
    result = bake(*arguments, cwd=tmp_path)
    assert result.returncode == code and message in result.stderr + result.stdout
    assert sorted(os.listdir(tmp_path)) == before
    assert (tmp_path / "there.exr").read_text() == "old"


def test_a_mesh_without_a_model_is_refused(tmp_path: Path) -> None:
    command = [BAKE, "--mesh", VASE, "--maps", "albedo", "-o", tmp_path / "maps"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 2 and not (tmp_path / "maps").exists()
    assert "MODEL: found none, expected the material of --mesh" in result.stderr


JOBS = [
    ["--mesh", VASE, "--to", "vertex-color", "--texels-per-unit", 600, "-o", "a.ply"],
    ["--mesh", "cube.obj", "--to", "uv", "--size", 8192, "-o", "a.exr"],
]


@pytest.mark.parametrize("job", JOBS, ids=["vertices", "atlas"])
def test_interruption_leaves_nothing(tmp_path: Path, job: list) -> None:
    cube_obj(tmp_path / "cube.obj")
    command = [str(BAKE), "granite-grey", "--threads", "1", *map(str, job)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        time.sleep(2)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 130
        assert "interrupted" in process.stderr.read()
    assert os.listdir(tmp_path) == ["cube.obj"]


@pytest.mark.parametrize("name", ["a.ply", "a.exr"])
def test_a_write_that_fails_is_reported(tmp_path: Path, name: str) -> None:
    def limit_files() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))

    mesh = cube_obj(tmp_path / "cube.obj")
    more = ["uv", "--size", 64] if name == "a.exr" else ["vertex-color"]
    arguments = ["--mesh", mesh, "--to", *more, "-o", tmp_path / name]
    result = bake(*arguments, preexec_fn=limit_files, restore_signals=False)
    assert result.returncode == 1
    assert f"{tmp_path / name}: cannot write: File too large" in result.stderr
    assert os.listdir(tmp_path) == ["cube.obj"]


MAPS = "paint-rusted"


def image(path: Path) -> np.ndarray:
    picture = oiio.ImageBuf(str(path))
    return np.asarray(picture.get_pixels(oiio.FLOAT)).astype(np.float64)


def relief_normals(size: int, depth: float) -> tuple[np.ndarray, np.ndarray]:
    """Normals of cube_obj's charts [y, x, 3] by exact jacobians, and where the charts are."""
    v, u = np.meshgrid(1 - (np.arange(size) + 0.5) / size, (np.arange(size) + 0.5) / size,
                       indexing="ij")  # fmt: skip
    inside, points, slopes = cube_surface(np.stack([u, v], axis=-1))
    paint = solidtex.Texture(MAPS, seed=4)
    height = paint.channels.index("height")
    _, jacobian = paint.eval_jacobian(SCALE * points, origin=ORIGIN)
    gradient = SCALE * depth * jacobian[:, :, height]
    along = slopes / np.maximum(np.linalg.norm(slopes, axis=-1, keepdims=True), 1e-9)
    normals = np.concatenate([-(along * gradient[:, :, None]).sum(-1), np.ones((size, size, 1))], 2)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True), inside


def color_space_of(png: bytes) -> list[bytes]:
    """The chunks of a PNG file that say its color space."""
    return [name for name in (b"sRGB", b"gAMA", b"iCCP", b"cHRM", b"cICP") if name in png[:256]]


def test_maps_have_the_names_and_values_that_engines_expect(tmp_path: Path) -> None:
    cube, size = cube_obj(tmp_path / "cube.obj"), 192
    where = ("--mesh", cube, "--size", size, *PLACED)
    atlas, png, exr = tmp_path / "a.exr", tmp_path / "png", tmp_path / "exr"
    baked(*where, "--to", "uv", "-o", atlas, model=MAPS)
    names = "albedo,roughness,height,normal"
    baked(*where, "--maps", names, "-o", png, "--normal-map", "directx", model=MAPS)
    baked(*where, "--maps", names, "-o", exr, "--format", "exr", model=MAPS)
    stems = ["BaseColor", "Height", "Normal", "Roughness"]
    assert sorted(p.name for p in png.iterdir()) == [f"cube_{s}.png" for s in stems]
    assert sorted(p.name for p in exr.iterdir()) == [f"cube_{s}.exr" for s in stems]
    spaces = {p.stem: color_space_of(p.read_bytes()) for p in png.iterdir()}
    assert spaces == {f"cube_{s}": [b"sRGB"] if s == "BaseColor" else [] for s in stems}

    expected = image(atlas)  # R, G, B, height, roughness in the file's order
    order = oiio.ImageInput.open(str(atlas)).spec().channelnames
    planes = {name: expected[..., i] for i, name in enumerate(order)}
    for i, name in enumerate("RGB"):
        assert (image(exr / "cube_BaseColor.exr")[..., i] == planes[name]).all()
        encoded = image(png / "cube_BaseColor.png")[..., i]
        assert np.abs(light(encoded) - np.clip(planes[name], 0, 1)).max() < 0.006
    for name in ("roughness", "height"):
        exact = image(exr / f"cube_{name.capitalize()}.exr")[..., 0]
        assert (exact == planes[name]).all()
        steps = 255 if name == "roughness" else 65535
        stored = image(png / f"cube_{name.capitalize()}.png")[..., 0]
        assert np.abs(stored - np.clip(exact, 0, 1)).max() <= 0.51 / steps

    up, down = (2 * image(f) - 1 for f in (exr / "cube_Normal.exr", png / "cube_Normal.png"))
    assert np.allclose(np.linalg.norm(up, axis=-1), 1, atol=1e-5)
    assert np.abs(up * (1, -1, 1) - down).max() < 1e-4
    normals, inside = relief_normals(size, depth=1.5 / SCALE)
    alike = [np.corrcoef(up[inside][:, i], normals[inside][:, i])[0, 1] for i in (0, 1)]
    assert min(alike) > 0.9  # footprints smooth; a wrong sign or axis gives -1 or 0
    assert up[inside][:, :2].std() > 0.05


def test_a_glb_holds_the_mesh_and_its_maps(tmp_path: Path) -> None:
    cube, out = cube_obj(tmp_path / "cube.obj"), tmp_path / "cube.glb"
    baked("--mesh", cube, "--size", 64, "-o", out, *PLACED, model=MAPS)
    data = out.read_bytes()
    assert data[:8] == b"glTF\x02\0\0\0" and int.from_bytes(data[8:12], "little") == len(data)
    length = int.from_bytes(data[12:16], "little")
    document = json.loads(data[20 : 20 + length])
    binary = data[28 + length :]
    views = [
        binary[v["byteOffset"] : v["byteOffset"] + v["byteLength"]] for v in document["bufferViews"]
    ]
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    uvs = np.frombuffer(views[document["accessors"][attributes["TEXCOORD_0"]]["bufferView"]],
                        np.float32).reshape(-1, 2)  # fmt: skip
    rows = [line.split()[1:] for line in cube.read_text().splitlines() if line.startswith("vt")]
    known = {(round(float(u), 4), round(1 - float(v), 4)) for u, v in rows}
    assert {(round(float(u), 4), round(float(v), 4)) for u, v in uvs} == known
    material = document["materials"][0]
    surface = material["pbrMetallicRoughness"]
    assert surface["metallicFactor"] == 0 and surface["roughnessFactor"] == 1
    used = [surface["baseColorTexture"], surface["metallicRoughnessTexture"],
            material["normalTexture"]]  # fmt: skip
    for number, texture in enumerate(used):
        source = document["textures"][texture["index"]]["source"]
        png = views[document["images"][source]["bufferView"]]
        (tmp_path / "map.png").write_bytes(png)
        assert image(tmp_path / "map.png").shape == (64, 64, 3), number
        assert color_space_of(png) == ([b"sRGB"] if number == 0 else []), number
    # The mesh reader of this project reads it, texture coordinates included.
    again = tmp_path / "again.exr"
    baked("--mesh", out, "--to", "uv", "--size", 64, "-o", again, *PLACED, model=MAPS)
    first = tmp_path / "first.exr"
    baked("--mesh", cube, "--to", "uv", "--size", 64, "-o", first, *PLACED, model=MAPS)
    assert np.abs(image(again) - image(first)).max() < 1e-3
