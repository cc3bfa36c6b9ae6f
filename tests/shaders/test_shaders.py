"""solidtex-export-shader: the shader computes what the engine computes."""

from pathlib import Path

import numpy as np
import pytest
from shader_gpu import MAINS, Points, compiled, run_shader, run_wgpu

from solidtex_export.commands import export_shader
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.export.shader.emitter import Precision, Storage
from solidtex_export.export.shader.shader import BY_SUFFIX, shader
from solidtex_export.export.verification import noise

REPOSITORY = Path(__file__).resolve().parents[2]
STONE = model_file.read(REPOSITORY / "models" / "stone-grey.solidtex")
GRANITE = model_file.read(REPOSITORY / "models" / "granite-speckled.solidtex")
SMALL = random_models.sampler_model(octaves=6, hidden=3, width=10)
NAME = "solidtex_test"
FLOAT_BOUND = 1 / 1024
HALF_BOUND, HALF_SHARE = 1 / 255, 0.999


def check(points: Points, results: np.ndarray, precision: Precision) -> None:
    errors = points.errors(results)
    assert np.isfinite(results).all()
    if precision == "float":
        assert errors.max() <= FLOAT_BOUND
    else:
        assert np.mean(errors <= HALF_BOUND) >= HALF_SHARE
        # Halves are in use.
        assert errors.max() > 1e-5


STONE_POINTS, SMALL_POINTS = Points(STONE), Points(SMALL)

COMBINATIONS = [(s, p) for s in ("buffer", "texture") for p in ("float", "half")]


@pytest.mark.parametrize("suffix", MAINS)
@pytest.mark.parametrize(("storage", "precision"), COMBINATIONS)
def test_values(suffix: str, storage: Storage, precision: Precision) -> None:
    results = run_shader(STONE, STONE_POINTS, suffix, storage, precision)
    check(STONE_POINTS, results, precision)


@pytest.mark.parametrize("suffix", MAINS)
@pytest.mark.parametrize("precision", ["float", "half"])
def test_constants_in_the_source(suffix: str, precision: Precision) -> None:
    """A small network: a software GPU copies constants for every point."""
    results = run_shader(SMALL, SMALL_POINTS, suffix, "constant", precision)
    check(SMALL_POINTS, results, precision)


def test_64_octaves_and_a_seed() -> None:
    points = Points(GRANITE, 256, seed=2**63 + 5)
    results = run_shader(GRANITE, points, ".wgsl", "buffer", "float", 2**63 + 5)
    check(points, results, "float")


def test_a_model_of_other_channels() -> None:
    """The first channel is gray; it is no light, and is averaged as it is."""
    model = random_models.sampler_model(octaves=4, hidden=2, width=7)
    model.document["channels"] = ["height", "roughness", "porosity"]
    points = Points(model, 256)
    results = run_shader(model, points, ".wgsl", "buffer", "float")
    assert np.abs(results[:, :3] - points.values[:, :1]).max() <= FLOAT_BOUND


BITS = """
@group(1) @binding(0) var<storage, read> cells: array<vec4<u32>>;
@group(1) @binding(1) var<storage, read_write> results: array<vec4<u32>>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
  let i = id.x;
  if (i >= arrayLength(&cells)) { return; }
  let cell = cells[i];
  let first = i32(cell.w) * 37;
  let bits = solidtex_test_bits(cell.x, cell.y, cell.z, solidtex_test_word_at(first),
    solidtex_test_word_at(first + 1), solidtex_test_word_at(first + 2),
    solidtex_test_word_at(first + 3));
  results[i] = vec4<u32>(bits, 0u, 0u, 0u);
}
"""


@pytest.mark.parametrize(("storage", "precision"), COMBINATIONS)
def test_noise_bits(storage: Storage, precision: Precision) -> None:
    """The integers of the noise are those of the scheme, bit by bit."""
    cells = np.random.default_rng(2).integers(0, 2**32, (512, 4), np.uint32)
    made = shader(SMALL if precision == "float" else STONE, ".wgsl", NAME, storage, precision, 7)
    cells[:, 3] %= 6 if precision == "float" else 16
    found = run_wgpu(made.text + BITS, made.data, [cells], len(cells)).view(np.uint32)[:, 0]
    for level in np.unique(cells[:, 3]):
        x, y, z, _ = cells[cells[:, 3] == level].T
        expected = noise.solidtex_1_bits(7, int(level), 0, x, y, z)
        assert np.array_equal(found[cells[:, 3] == level], expected)


def test_glsl_compiles_for_vulkan_and_the_web() -> None:
    for version, storage in (
        ("450", "buffer"),
        ("310 es", "buffer"),
        ("300 es", "texture"),
    ):
        made = shader(STONE, ".glsl", NAME, storage, "half")
        main = "out vec4 c;\nvoid main() { c = vec4(solidtex_test(vec3(0.5), 1.0), 1.0); }\n"
        command = ["glslangValidator", "-S", "frag", "{source}"]
        if version == "450":
            command += ["-V", "-o", "{output}"]
            main = "layout(location = 0) " + main
        source = f"#version {version}\n{made.text}{main}"
        compiled(command, source, ".frag")


def export(*arguments: object) -> int:
    return export_shader.main([str(a) for a in arguments])


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = REPOSITORY / "models" / "stone-grey.solidtex"
    assert export(model, "-o", tmp_path / "my stone.glsl", "--precision", "half") == 0
    made = shader(STONE, ".glsl", "solidtex_my_stone", "texture", "half")
    assert (tmp_path / "my stone.glsl").read_text() == made.text
    assert (tmp_path / "my stone.weights.bin").read_bytes() == made.data.tobytes()
    printed = capsys.readouterr().out
    assert "function solidtex_my_stone" in printed
    assert f"128 x {made.data.shape[0]} texels, RGBA16F, {made.data.nbytes} bytes" in printed
    oiio = pytest.importorskip("OpenImageIO")
    pixels = oiio.ImageBuf(str(tmp_path / "my stone.weights.exr")).get_pixels(oiio.FLOAT)
    assert np.array_equal(pixels, made.data.astype(np.float32))


def test_the_license_of_a_space_is_not_called_that_of_the_material() -> None:
    space = {"name": "stones", "license": "CC0-1.0"}
    for training, owner in (({}, "material"), ({"space": space}, "texture space, not of the")):
        document = SMALL.document | {"license": "CC0-1.0", "training": training}
        made = shader(
            model_file.ModelFile(document, SMALL.tensors), ".glsl", NAME, "buffer", "float"
        )
        assert f"License of the {owner}" in made.text


@pytest.mark.parametrize("suffix", BY_SUFFIX)
def test_no_text_of_a_model_becomes_code(suffix: str) -> None:
    breaks = "\n\r\v\f\u0085\u2028\u2029"
    document = SMALL.document | {"name": f"a{breaks[-2:]}evil", "license": f"CC0{breaks}evil"}
    model = model_file.ModelFile(document, SMALL.tensors)
    storage = BY_SUFFIX[suffix].storages[0]
    lines = shader(model, suffix, NAME, storage, "float").text.splitlines()
    assert [line[:2] for line in lines if "evil" in line] == ["//", "//"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("marble.solidtex", "-o", "m.glsl"), "found a model of the lattice family"),
        (
            ("marble.solidtex", "-o", "m.wgsl", "--precision", "half"),
            "expected float for a lattice",
        ),
        (("marble.solidtex", "-o", "m.wgsl", "--size", "48"), "expected a multiple of 32"),
        (("stone-grey.solidtex", "-o", "m.wgsl", "--size", "32"), "--size: found 32 with"),
        (
            ("stone-grey.solidtex", "-o", "m.cg"),
            "found the suffix '.cg', expected one of .wgsl",
        ),
        (("stone-grey.solidtex", "-o", "m.wgsl", "--seed", "-1"), "--seed: found -1"),
        (("stone-grey.solidtex", "-o", "none/m.wgsl"), "found no folder"),
    ],
)
def test_refused(
    arguments: tuple[str, ...],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    model, *rest = arguments
    assert export(REPOSITORY / "models" / model, *rest) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_transforms_out_of_range_are_refused() -> None:
    model = random_models.sampler_model(octaves=4, hidden=2, width=4)
    model.tensors["transforms"][1, 0, 0] = 40000
    with pytest.raises(model_file.ModelFileError, match="transforms: found an entry of 40000"):
        shader(model, ".wgsl", NAME, "buffer", "float")
