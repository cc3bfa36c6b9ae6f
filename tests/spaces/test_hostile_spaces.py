"""Every hostile space is refused with a sentence that names the file, what was found and what was
expected; nothing is written.
"""

import copy
import json
import os
import struct
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper
from PIL import Image
from space_files import KINDS

import solidtex
from solidtex_export.spaces.random_space import RandomSpace, random_space

BUILD = Path(os.environ["SOLIDTEX_BUILD"])
BASE = {kind: random_space(sizes) for kind, sizes in KINDS.items()}

Words = tuple[str, ...]
Change = Callable[[RandomSpace], None]


def put(path: str, value: Any) -> Change:
    def change(space: RandomSpace) -> None:
        *parents, key = path.split(".")
        target = space.document
        for parent in parents:
            target = target[parent]
        target[key] = value

    return change


def drop(key: str) -> Change:
    return lambda space: space.document.pop(key)


def alone(kept: str = "", **changed: str) -> Change:
    """An encoder alone, but for one key of a generator's."""

    def change(space: RandomSpace) -> None:
        for key in {"lattice", "sampler", "noise", "style"} - {kept}:
            space.document.pop(key, None)
        space.document |= {"family": "none", "colors": "network"} | changed

    return change


def tensor(name: str, value: np.ndarray | None) -> Change:
    def change(space: RandomSpace) -> None:
        if value is None:
            del space.tensors[name]
        else:
            space.tensors[name] = value

    return change


def poison(name: str, value: float) -> Change:
    def change(space: RandomSpace) -> None:
        space.tensors[name].flat[-1] = value

    return change


def f32(*shape: int) -> np.ndarray:
    return np.zeros(shape, np.float32)


DOCUMENTS: dict[str, tuple[str, Change, Words]] = {
    "version": ("lattice", put("version", 2), ("version", "found 2")),
    "name_control": ("lattice", put("name", "a\nb"), ("name", "control characters")),
    "family_unknown": ("lattice", put("family", "field"), ("family", '"field"', '"lattice"')),
    "family_other": ("lattice", put("family", "sampler"), ("lattice", "only sampler")),
    "family_none": ("lattice", put("family", "none"), ("lattice", "this key", '"none"')),
    "none_lattice": ("lattice", alone("lattice"), ("lattice", "this key", '"none"')),
    "none_sampler": ("bounded", alone("sampler"), ("sampler", "this key", '"none"')),
    "none_noise": ("lattice", alone("noise"), ("noise", "this key", '"none"')),
    "none_style": ("lattice", alone("style"), ("style", "this key", '"none"')),
    "none_colors": ("lattice", alone(colors="linear"), ("colors", '"linear"', '"network"')),
    "key_unknown": ("lattice", put("period", 3), ("period", "unknown key")),
    "key_missing": ("lattice", drop("patch"), ("patch", "nothing")),
    "channels": ("lattice", put("channels", ["albedo.r"]), ("channels", "albedo.g")),
    "color_space": ("lattice", put("color_space", "linear"), ("color_space", "srgb")),
    "noise": ("lattice", put("noise.scheme", "solidtexturenets"), ("noise.scheme", "solidtex-1")),
    "patch_huge": ("lattice", put("patch", 10**9), ("patch", "1000000000")),
    "resolution_small": ("lattice", put("resolution", 16), ("resolution", "from 32")),
    "code_huge": ("lattice", put("code", 2**62), ("code", "1 to 1024")),
    "code_mismatch": ("lattice", put("code", 5), ("tensor", "[6, 4]", "[6, 5]")),
    "style_width": ("lattice", put("style.width", 0), ("style.width", "found 0")),
    "levels_huge": ("lattice", put("lattice.levels", 13), ("lattice.levels", "2 to 12")),
    "levels_more": ("lattice", put("lattice.levels", 4), ("tensor", "expected")),
    "steps_huge": ("lattice", put("lattice.step_channels", 257), ("step_channels", "257")),
    "octaves": ("bounded", put("sampler.octaves", 5), ("octaves", "multiple of 2")),
    "width_huge": ("bounded", put("sampler.width", 4097), ("width", "4097")),
    "transforms": ("bounded", put("sampler.transforms", "free"), ("transforms", '"free"')),
    "transforms_other": ("bounded", put("sampler.transforms", "linear"), ("transforms.1",)),
    "photographs_none": ("lattice", put("photographs", []), ("photographs", "0 entries")),
    "photographs_less": ("lattice", put("photographs", [{"name": "a"}]), ("codes", "[5, 4]")),
    "photograph_key": ("lattice", put("photographs", [{"url": "a"}]), ("photographs[0].url",)),
}
TENSORS: dict[str, tuple[str, Change, Words]] = {
    "missing": ("lattice", tensor("style.0.bias", None), ("style.0.bias", "nothing", "[6]")),
    "extra": ("lattice", tensor("momentum", f32(3)), ("momentum", "no such tensor")),
    "colors_missing": ("lattice", tensor("colors", None), ("colors", "nothing", "[5, 3, 4]")),
    "colors_extra": ("linear", tensor("colors", f32(5, 3, 4)), ("colors", "no such tensor")),
    "none_more": ("lattice", alone(), ("no such tensor",)),
    "base_missing": ("bounded", tensor("base", None), ("base", "nothing")),
    "base_extra": ("linear", tensor("base", f32(4, 3, 3)), ("base", "no such tensor")),
    "shape": ("bounded", tensor("scales", f32(4, 1)), ("scales", "[4, 1]", "[4]")),
    "condition": ("lattice", tensor("condition.cb1_1.conv1.bias", f32(2)), ("[2]", "[4]")),
    "nan": ("lattice", poison("last_conv.weight", np.nan), ("last_conv.weight", "nan", "finite")),
    "infinity": ("bounded", poison("codes", np.inf), ("codes", "inf", "finite")),
    "half": ("lattice", tensor("scales", np.zeros(4, np.float16)), ("scales", '"F16"')),
    "bytes": ("lattice", tensor("codes", np.zeros((5, 4), np.uint8)), ("codes", "U8", "F32")),
    "encoder_missing": ("lattice", tensor("encoder", None), ("encoder", "nothing", "U8")),
    "encoder_float": ("lattice", tensor("encoder", f32(9)), ("encoder", "F32", "U8")),
    "encoder_matrix": ("lattice", tensor("encoder", np.zeros((3, 3), np.uint8)), ("encoder", "U8")),
}


def onnx_bytes(
    nodes: list[Any],
    inputs: Any = ("n", 3, 32, 32),
    outputs: Any = ("n", 4),
    names: tuple[str, str] = ("patches", "codes"),
    **graph: Any,
) -> np.ndarray:
    value = helper.make_tensor_value_info
    made = helper.make_graph(
        nodes,
        "encoder",
        [value(names[0], TensorProto.FLOAT, list(inputs))],
        [value(names[1], TensorProto.FLOAT, list(outputs))],
        **graph,
    )
    opset = [helper.make_opsetid("", 18), helper.make_opsetid("com.microsoft", 1)]
    model = helper.make_model(made, opset_imports=opset, ir_version=8)
    return np.frombuffer(model.SerializeToString(), np.uint8).copy()


def weights(**arrays: np.ndarray) -> list[TensorProto]:
    return [numpy_helper.from_array(a, n) for n, a in arrays.items()]


def node(op: str, inputs: list[str], outputs: list[str], **attributes: Any) -> Any:
    return helper.make_node(op, inputs, outputs, **attributes)


def external() -> TensorProto:
    found = weights(w=f32(3))[0]
    found.ClearField("raw_data")
    found.data_location = TensorProto.EXTERNAL
    entry = found.external_data.add()
    entry.key, entry.value = "location", "/etc/passwd"
    return found


def refused_encoders() -> Iterator[tuple[str, np.ndarray, Words]]:
    """Encoders that are refused when the space is opened."""
    yield "empty", np.zeros(1, np.uint8), ("no readable ONNX file",)
    text = np.frombuffer(b"this is no ONNX file at all", np.uint8)
    yield "text", text, ("no readable ONNX file",)
    good = BASE["lattice"].tensors["encoder"]
    yield "cut", good[: len(good) // 2].copy(), ("no readable ONNX file",)
    branch = helper.make_graph([], "body", [], [])
    loop = node("Loop", ["m", "c"], ["codes"], body=branch)
    yield "loop", onnx_bytes([loop]), ("a graph inside a node",)
    yield "operator", onnx_bytes([node("Tile", ["patches", "r"], ["codes"])]), ('"Tile"', "Conv")
    foreign = node("Conv", ["patches"], ["codes"], domain="com.microsoft")
    yield "domain", onnx_bytes([foreign]), ('"com.microsoft.Conv"',)
    elsewhere = onnx_bytes([node("Relu", ["patches"], ["codes"])], initializer=[external()])
    yield "external", elsewhere, ("weights in another file",)


def failing_encoders() -> Iterator[tuple[str, np.ndarray, Words]]:
    """Encoders that are refused when a photograph is encoded."""
    mean = [node("GlobalAveragePool", ["patches"], ["a"]), node("Flatten", ["a"], ["b"])]
    dense = [*mean, node("Gemm", ["b", "w"], ["codes"])]
    four = {"initializer": weights(w=np.ones((3, 4), np.float32))}
    renamed = [node("GlobalAveragePool", ["x"], ["a"]), *dense[1:]]
    yield "input_name", onnx_bytes(renamed, names=("x", "codes"), **four), ('"x"', '"patches"')
    large = onnx_bytes(dense, inputs=("n", 3, 64, 64), **four)
    yield "input_shape", large, ("[n, 3, 64, 64]", "[n, 3, 32, 32]")
    fixed = onnx_bytes(dense, inputs=(1, 3, 32, 32), **four)
    yield "input_fixed", fixed, ("[1, 3, 32, 32]", "[n, 3, 32, 32]")
    five = {"initializer": weights(w=np.ones((3, 5), np.float32))}
    yield "output_shape", onnx_bytes(dense, outputs=("n", 5), **five), ("[n, 5]", "[n, 4]")
    lying = onnx_bytes(dense, outputs=("n", 4), **five)
    yield "output_lies", lying, ("encoder",)
    unknown = onnx_bytes([*mean, node("Gemm", ["b", "nothing"], ["codes"])])
    yield "input_missing", unknown, ("ONNX Runtime refuses it",)
    infinite = {"initializer": weights(w=np.full((3, 4), 3e38, np.float32), k=np.float32([3e38]))}
    scaled = [*mean, node("Mul", ["b", "k"], ["s"]), node("Gemm", ["s", "w"], ["codes"])]
    yield "not_finite", onnx_bytes(scaled, **infinite), ("not finite",)
    wide = node("Conv", ["patches", "c"], ["p"], pads=[9000] * 4)
    padded = [wide, node("GlobalAveragePool", ["p"], ["a"]), *dense[1:]]
    huge = {
        "initializer": weights(w=np.ones((3, 4), np.float32), c=np.ones((3, 3, 1, 1), np.float32))
    }
    yield "sizes", onnx_bytes(padded, **huge), ("ONNX Runtime refuses it",)


REFUSED, FAILING = list(refused_encoders()), list(failing_encoders())


def spoiled(kind: str, change: Change) -> bytes:
    space = copy.deepcopy(BASE[kind])
    change(space)
    return space.encode()


def encode(folder: Path, data: bytes) -> tuple[str, Path]:
    """Message of solidtex-encode for a space; it must fail and write nothing."""
    space, photo, out = (folder / n for n in ("bad.solidtex-space", "p.png", "out.solidtex"))
    space.write_bytes(data)
    rng = np.random.default_rng(0)
    Image.fromarray(rng.integers(0, 255, (40, 48, 3), np.uint8)).save(photo)
    command = [BUILD / "bin" / "solidtex-encode", photo, "--space", space, "-o", out]
    result = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert result.returncode == 1, result.stderr
    assert {p.name for p in folder.iterdir()} == {space.name, photo.name}
    assert result.stdout == ""
    return result.stderr, space


def check(message: str, path: Path, words: Words) -> None:
    missing = [word for word in (str(path), *words) if word not in message]
    assert not missing, f"no {missing} in: {message}"
    assert len(message.strip().splitlines()) == 1 and len(message) < 1000


CASES = {f"document_{n}": c for n, c in DOCUMENTS.items()} | {
    f"tensor_{n}": c for n, c in TENSORS.items()
}


@pytest.mark.parametrize("name", CASES)
def test_wrong_contents(name: str, tmp_path: Path) -> None:
    kind, change, words = CASES[name]
    path = tmp_path / "bad.solidtex-space"
    path.write_bytes(spoiled(kind, change))
    with pytest.raises(solidtex.ModelError) as caught:
        solidtex.Space(path)
    check(str(caught.value), path, words)


def test_every_truncation_is_refused(tmp_path: Path) -> None:
    data = BASE["bounded"].encode()
    path = tmp_path / "bad.solidtex-space"
    for size in [0, 1, 7, 8, 9, 100, *range(200, len(data), len(data) // 40), len(data) - 1]:
        path.write_bytes(data[:size])
        with pytest.raises(solidtex.ModelError) as caught:
            solidtex.Space(path)
        check(str(caught.value), path, ())


def test_random_damage_never_crashes(tmp_path: Path) -> None:
    data = BASE["lattice"].encode()
    rng = np.random.default_rng(5)
    path = tmp_path / "bad.solidtex-space"
    refused = 0
    for _ in range(300):
        bad = bytearray(data)
        for place in rng.integers(0, len(data), 3):
            bad[place] = rng.integers(256)
        path.write_bytes(bad)
        try:
            space = solidtex.Space(path)
            space.texture(space.photograph(0))
        except solidtex.Error:
            refused += 1
    assert refused > 30


def test_header_lies(tmp_path: Path) -> None:
    data = BASE["lattice"].encode()
    size = struct.unpack("<Q", data[:8])[0]
    path = tmp_path / "bad.solidtex-space"
    for lie in (size - 1, size + 1, 2**40, 2**64 - 1):
        path.write_bytes(struct.pack("<Q", lie & (2**64 - 1)) + data[8:])
        with pytest.raises(solidtex.ModelError):
            solidtex.Space(path)
    header = json.loads(data[8 : 8 + size])
    header["codes"]["data_offsets"][1] += 4
    text = json.dumps(header).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + data[8 + size :])
    with pytest.raises(solidtex.ModelError, match=r'"codes".data_offsets'):
        solidtex.Space(path)


@pytest.mark.parametrize(("name", "encoder", "words"), REFUSED, ids=[c[0] for c in REFUSED])
def test_encoder_is_refused_at_once(
    name: str, encoder: np.ndarray, words: Words, tmp_path: Path
) -> None:
    path = tmp_path / "bad.solidtex-space"
    path.write_bytes(spoiled("lattice", tensor("encoder", encoder)))
    with pytest.raises(solidtex.ModelError) as caught:
        solidtex.Space(path)
    check(str(caught.value), path, ("encoder", *words))


@pytest.mark.parametrize(("name", "encoder", "words"), FAILING, ids=[c[0] for c in FAILING])
def test_encoder_is_refused_by_the_program(
    name: str, encoder: np.ndarray, words: Words, tmp_path: Path
) -> None:
    message, path = encode(tmp_path, spoiled("lattice", tensor("encoder", encoder)))
    check(message, path, ("encoder", *words))


def test_info_refuses_too(tmp_path: Path) -> None:
    path = tmp_path / "bad.solidtex-space"
    path.write_bytes(spoiled("lattice", poison("codes", np.nan)))
    command = [BUILD / "bin" / "solidtex-info", path]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout) == (1, "")
    check(result.stderr, path, ("codes", "nan"))
