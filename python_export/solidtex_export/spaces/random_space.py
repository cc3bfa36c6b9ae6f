"""Untrained texture spaces with typical values, for tests.

python -m solidtex_export.spaces.random_space OUT.solidtex-space --family sampler
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from onnx import TensorProto, helper, numpy_helper
from safetensors.numpy import save

METADATA_KEY = "solidtex-space"
Tensors = dict[str, np.ndarray]


@dataclass(frozen=True)
class Sizes:
    """Sizes of a random space; the defaults are tiny."""

    family: Literal["lattice", "sampler"] = "lattice"
    colors: Literal["photograph", "network"] = "photograph"
    transforms: Literal["bounded", "linear"] = "bounded"
    name: str = "random"
    patch: int = 32
    resolution: int = 64
    code: int = 4
    style_width: int = 6
    photographs: int = 5
    levels: int = 3
    noise_channels: int = 2
    step_channels: int = 2
    octaves: int = 4
    hidden_layers: int = 3
    width: int = 8


@dataclass
class RandomSpace:
    """JSON document and tensors of a space; `encoder` is the ONNX file as bytes of uint8."""

    document: dict[str, Any]
    tensors: Tensors

    def encode(self) -> bytes:
        """Bytes of the file."""
        document = json.dumps(self.document, separators=(",", ":"))
        return save(self.tensors, {METADATA_KEY: document})


def random_space(sizes: Sizes = Sizes(), seed: int = 0) -> RandomSpace:
    rng = np.random.default_rng(seed)
    tensors = _style(rng, sizes)
    if sizes.family == "lattice":
        tensors |= _lattice(rng, sizes)
        architecture: dict[str, Any] = {
            "levels": sizes.levels,
            "noise_channels": sizes.noise_channels,
            "step_channels": sizes.step_channels,
            "slope": 0.2,
        }
    else:
        tensors |= _sampler(rng, sizes)
        architecture = {
            "octaves": sizes.octaves,
            "hidden_layers": sizes.hidden_layers,
            "width": sizes.width,
            "slope": 0.2,
            "transforms": sizes.transforms,
        }
    tensors["codes"] = rng.normal(size=(sizes.photographs, sizes.code))
    if sizes.colors == "photograph":
        colors = rng.normal(0, 0.1, (sizes.photographs, 3, 4))
        colors[:, :, 3] += 0.5
        tensors["colors"] = colors
    arrays: Tensors = {n: np.ascontiguousarray(t, np.float32) for n, t in tensors.items()}
    encoder = random_encoder(rng, sizes.patch, sizes.code)
    arrays["encoder"] = np.frombuffer(encoder, np.uint8).copy()
    document = {
        "version": 1,
        "name": sizes.name,
        "family": sizes.family,
        "channels": ["albedo.r", "albedo.g", "albedo.b"],
        "color_space": "srgb",
        "colors": sizes.colors,
        "patch": sizes.patch,
        "resolution": sizes.resolution,
        "code": sizes.code,
        "directions": "xyz",
        "noise": {"scheme": "solidtex-1"},
        sizes.family: architecture,
        "style": {"width": sizes.style_width, "slope": 0.2},
        "photographs": [
            {"name": f"stone-{i}", "sha256": f"{i:064x}", "license": "CC0-1.0", "source": "random"}
            for i in range(sizes.photographs)
        ],
        "license": "CC0-1.0",
        "training": {"seed": seed},
    }
    return RandomSpace(document, arrays)


def _layer(rng: np.random.Generator, name: str, outputs: int, inputs: int) -> Tensors:
    """A dense layer whose outputs have the variance of its inputs."""
    return {
        f"{name}.weight": rng.normal(size=(outputs, inputs)) / np.sqrt(inputs),
        f"{name}.bias": rng.normal(0, 0.3, outputs),
    }


def _two_layers(rng: np.random.Generator, name: str, sizes: Sizes, outputs: int) -> Tensors:
    first = _layer(rng, f"{name}.0", sizes.style_width, sizes.code)
    return first | _layer(rng, f"{name}.1", outputs, sizes.style_width)


def _style(rng: np.random.Generator, sizes: Sizes) -> Tensors:
    return _two_layers(rng, "style", sizes, sizes.style_width)


def _condition(rng: np.random.Generator, name: str, sizes: Sizes, channels: int) -> Tensors:
    layer = _layer(rng, f"condition.{name}", 2 * channels, sizes.style_width)
    return {key: 0.3 * values for key, values in layer.items()}


def _lattice(rng: np.random.Generator, sizes: Sizes) -> Tensors:
    tensors: Tensors = {}

    def convolution(name: str, inputs: int, outputs: int, kernel: int) -> None:
        shape = (outputs, inputs, kernel, kernel, kernel)
        tensors[f"{name}.weight"] = rng.normal(size=shape) / np.sqrt(inputs * kernel**3)
        tensors[f"{name}.bias"] = rng.normal(0, 0.3, outputs)

    step = sizes.step_channels
    for stage in range(1, sizes.levels + 1):
        blocks = {f"cb{stage}_1": (sizes.noise_channels, step)}
        if stage > 1:
            blocks[f"cb{stage}_2"] = (stage * step, stage * step)
        for block, (inputs, outputs) in blocks.items():
            for i, kernel in ((1, 3), (2, 3), (3, 1)):
                name = f"{block}.conv{i}"
                convolution(name, inputs if i == 1 else outputs, outputs, kernel)
                tensors |= _condition(rng, name, sizes, outputs)
    convolution("last_conv", sizes.levels * step, 3, 1)
    return tensors


def _sampler(rng: np.random.Generator, sizes: Sizes) -> Tensors:
    n, m, bins = sizes.octaves, sizes.width, sizes.hidden_layers - 1
    numbers = 11 if sizes.transforms == "bounded" else 9
    tensors = _two_layers(rng, "transforms", sizes, numbers * n)
    tensors["scales"] = np.geomspace(1 / 24, 1, n)
    if sizes.transforms == "bounded":
        tensors["base"] = rng.normal(0, 0.6, (n, 3, 3))
    tensors["constant"] = rng.normal(size=m)
    for layer in range(sizes.hidden_layers):
        name = f"hidden.{layer}"
        tensors |= _layer(rng, name, m, m) | _condition(rng, name, sizes, m)
        if layer < bins:
            tensors[f"{name}.noise"] = rng.normal(size=(m, n // bins)) / np.sqrt(n // bins)
    return tensors | _layer(rng, "output", 3, m)


def random_encoder(rng: np.random.Generator, patch: int, code: int, features: int = 6) -> bytes:
    """ONNX file: strided convolution, leaky ReLU, mean, dense layer."""
    weights = {
        "conv.weight": rng.normal(size=(features, 3, 5, 5)) / np.sqrt(75),
        "conv.bias": rng.normal(0, 0.3, features),
        "dense.weight": rng.normal(size=(code, features)),
        "dense.bias": rng.normal(0, 0.3, code),
    }
    initializers = [numpy_helper.from_array(v.astype(np.float32), k) for k, v in weights.items()]
    node = helper.make_node
    nodes = [
        node("Conv", ["patches", "conv.weight", "conv.bias"], ["a"], strides=[4, 4]),
        node("LeakyRelu", ["a"], ["b"], alpha=0.2),
        node("GlobalAveragePool", ["b"], ["c"]),
        node("Flatten", ["c"], ["d"]),
        node("Gemm", ["d", "dense.weight", "dense.bias"], ["codes"], transB=1),
    ]
    value = helper.make_tensor_value_info
    graph = helper.make_graph(
        nodes,
        "encoder",
        [value("patches", TensorProto.FLOAT, ["n", 3, patch, patch])],
        [value("codes", TensorProto.FLOAT, ["n", code])],
        initializers,
    )
    opset = [helper.make_opsetid("", 18)]
    model = helper.make_model(graph, producer_name="solidtex", opset_imports=opset, ir_version=8)
    return bytes(model.SerializeToString(deterministic=True))


def main() -> None:
    parser = argparse.ArgumentParser(description="Writes an untrained texture space for tests.")
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("--family", choices=("lattice", "sampler"), default="lattice")
    parser.add_argument("--colors", choices=("photograph", "network"), default="photograph")
    parser.add_argument("--transforms", choices=("bounded", "linear"), default="bounded")
    parser.add_argument("--patch", type=int, default=Sizes.patch)
    parser.add_argument("--resolution", type=int, default=Sizes.resolution)
    parser.add_argument("--seed", type=int, default=0)
    options = vars(parser.parse_args())
    out, seed = options.pop("out"), options.pop("seed")
    out.write_bytes(random_space(Sizes(name=out.stem, **options), seed).encode())


if __name__ == "__main__":
    main()
