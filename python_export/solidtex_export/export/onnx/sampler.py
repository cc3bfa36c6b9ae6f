"""Sampler family as an ONNX graph: the bare network, octave noise in, any number of points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from onnx import GraphProto

from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.onnx.graph import GraphBuilder

INPUT, OUTPUT = "noise", "values"
POINTS = "points"  # the name of the free size

Tensors = Mapping[str, np.ndarray]


def sampler_graph(model: ModelFile) -> tuple[GraphProto, dict[str, Any]]:
    """The graph, and metadata from which its user computes the noise."""
    sizes, tensors = model.document["sampler"], model.tensors
    builder = GraphBuilder(OUTPUT)
    builder.input(INPUT, (POINTS, sizes["octaves"]))
    bins = _bins(builder, sizes["octaves"], sizes["hidden_layers"] - 1)
    x: list[str] = []
    for l in range(sizes["hidden_layers"]):
        weight, bias = _first_layer(tensors) if l == 0 else _hidden_layer(tensors, l)
        y = _dense(builder, f"hidden.{l}", x + bins[l : l + 1], weight, bias)
        x = [builder.apply("LeakyRelu", [y], f"hidden.{l}.act", alpha=float(sizes["slope"]))]
    value = _dense(builder, "output", x, tensors["output.weight"], tensors["output.bias"])
    document = {
        "transforms": tensors["transforms"].astype(float).tolist(),
        "inputs": [{"name": INPUT, "octaves": sizes["octaves"], "distribution": "normal"}],
    }
    shape = (POINTS, len(model.document["channels"]))
    return builder.graph(model.document["name"], value, shape), document


def _bins(builder: GraphBuilder, octaves: int, layers: int) -> list[str]:
    """The octaves that enter each hidden layer but the last."""
    sizes = builder.constant("octaves", np.full(layers, octaves // layers, np.int64))
    names = [f"noise.{l}" for l in range(layers)]
    return builder.apply_many("Split", [INPUT, sizes], names, axis=1)


def _first_layer(tensors: Tensors) -> tuple[np.ndarray, np.ndarray]:
    """Weight and bias of the first hidden layer. Its network input is constant and folds into the
    bias.
    """
    weight, bias = (tensors[f"hidden.0.{part}"].astype(np.float64) for part in ("weight", "bias"))
    return tensors["hidden.0.noise"], (bias + weight @ tensors["constant"]).astype(np.float32)


def _hidden_layer(tensors: Tensors, l: int) -> tuple[np.ndarray, np.ndarray]:
    """Weight and bias of a hidden layer: columns of the previous layer, then of its octaves."""
    parts = [tensors[f"hidden.{l}.{part}"] for part in ("weight", "noise")
             if f"hidden.{l}.{part}" in tensors]  # fmt: skip
    return np.concatenate(parts, axis=1), tensors[f"hidden.{l}.bias"]


def _dense(
    builder: GraphBuilder, name: str, inputs: Sequence[str], weight: np.ndarray, bias: np.ndarray
) -> str:
    """One product over all inputs: OpenVINO is 15 % slower with two products and their sum."""
    joined = inputs[0]
    if len(inputs) > 1:
        joined = builder.apply("Concat", inputs, f"{name}.inputs", axis=1)
    parameters = [
        builder.constant(f"{name}.weight", weight),
        builder.constant(f"{name}.bias", bias),
    ]
    return builder.apply("Gemm", [joined, *parameters], name, transB=1)
