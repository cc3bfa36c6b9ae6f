"""Lattice family as an ONNX graph: noise and waves in, the voxels of one box out.

All shapes are static.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from onnx import GraphProto

from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.onnx.graph import GraphBuilder
from solidtex_export.generators.regions import Box, Node, alignment, needed, regions

OUTPUT = "values"
SPATIAL_AXES = (2, 3, 4)


def lattice_graph(model: ModelFile, box: Box) -> tuple[GraphProto, dict[str, Any]]:
    """The graph, and metadata for its user: the box and the noise inputs."""
    nodes = model.document["field"]["nodes"]
    exporter = _Exporter(model, regions(nodes, box))
    for node in nodes:
        exporter.add(node)
    shape = (1, len(model.document["channels"]), *box.size)
    value = exporter.values[model.document["field"]["output"]]
    document = {
        "box": _box_document(box),
        "alignment": alignment(nodes),
        "inputs": [exporter.input(node) for node in nodes if "inputs" not in node],
    }
    return exporter.builder.graph(model.document["name"], value, shape), document


def _box_document(box: Box) -> dict[str, list[int]]:
    return {"lo": list(box.lo), "hi": list(box.hi)}


class _Exporter:
    """Adds the nodes in order; every tensor covers the box that `regions` gives it."""

    def __init__(self, model: ModelFile, regions: dict[str, Box]) -> None:
        self.builder = GraphBuilder(OUTPUT)
        self.regions = regions
        self.tensors = model.tensors
        self.values: dict[str, str] = {}

    def input(self, node: Node) -> dict[str, Any]:
        """Metadata of the input of a node of noise or waves."""
        known = ("level", "channels", "distribution", "waves")
        kept = {key: node[key] for key in known if key in node}
        name = node["name"]
        return {"name": self.values[name], **kept, **_box_document(self.regions[name])}

    def add(self, node: Node) -> None:
        self.values[node["name"]] = _OPERATIONS[node["op"]](self, node)

    def sources(self, node: Node) -> list[str]:
        """Inputs of `node`, cropped to its needs."""
        need = needed(node, self.regions[node["name"]])
        return [
            self.cropped(self.values[name], self.regions[name], need) for name in node["inputs"]
        ]

    def parameters(self, node: Node, *names: str) -> list[str]:
        full_names = [f"{node['name']}.{name}" for name in names]
        return [self.builder.constant(name, self.tensors[name]) for name in full_names]

    def per_channel(self, node: Node, name: str) -> str:
        values = self.tensors[f"{node['name']}.{name}"]
        return self.builder.constant(f"{node['name']}.{name}", values.reshape(1, -1, 1, 1, 1))

    def cropped(self, value: str, have: Box, want: Box) -> str:
        if have == want:
            return value
        starts = [w - h for w, h in zip(want.lo, have.lo, strict=True)]
        ends = [s + size for s, size in zip(starts, want.size, strict=True)]
        bounds = [
            self.builder.constant(f"{value}.{what}", np.array(numbers, np.int64))
            for what, numbers in (("starts", starts), ("ends", ends), ("axes", SPATIAL_AXES))
        ]
        return self.builder.apply("Slice", [value, *bounds], f"{value}.crop")


def _noise(exporter: _Exporter, node: Node) -> str:
    size = exporter.regions[node["name"]].size
    return exporter.builder.input(node["name"], (1, node["channels"], *size))


def _periodic(exporter: _Exporter, node: Node) -> str:
    """An input, as noise: floating-point angles would be inexact far from the origin."""
    size = exporter.regions[node["name"]].size
    return exporter.builder.input(node["name"], (1, len(node["waves"]), *size))


def _conv3d(exporter: _Exporter, node: Node) -> str:
    inputs = exporter.sources(node) + exporter.parameters(node, "weight", "bias")
    return exporter.builder.apply("Conv", inputs, node["name"], **_kernel(node))


def _conv_transpose3d(exporter: _Exporter, node: Node) -> str:
    """out[o] = b + sum of w[t] in[i] over o = 2i + t - padding.

    The crop applies the padding: ONNX's own would cut at the edges of the box, not of the lattice.
    The extra plane of output_padding is only bias: no tap reaches it when the kernel is 1.
    """
    box = exporter.regions[node["name"]]
    inputs = exporter.sources(node) + exporter.parameters(node, "weight", "bias")
    attributes = _kernel(node) | {"strides": [2] * 3, "output_padding": [1] * 3}
    value = exporter.builder.apply("ConvTranspose", inputs, node["name"], **attributes)
    source = needed(node, box)
    first = tuple(2 * l - node["padding"] for l in source.lo)
    size = [2 * (s - 1) + node["kernel"] + 1 for s in source.size]
    whole = Box(first, tuple(f + s for f, s in zip(first, size, strict=True)))
    return exporter.cropped(value, whole, box)


def _kernel(node: Node) -> dict[str, Sequence[int]]:
    return {"kernel_shape": [node["kernel"]] * 3}


def _upsample(exporter: _Exporter, node: Node) -> str:
    """out[i] = in[floor(i / 2)]; both indices start at an even voxel here.

    Reshape and Expand, axis by axis: some execution providers cannot Resize volumes.
    """
    box, name = exporter.regions[node["name"]], node["name"]
    source = needed(node, box)
    value = exporter.sources(node)[0]
    inner = 1
    for axis, size in reversed(list(zip("xyz", source.size, strict=True))):
        value = _shaped(exporter, "Reshape", value, (-1, size, 1, inner), f"{name}.{axis}")
        value = _shaped(exporter, "Expand", value, (1, 1, 2, 1), f"{name}.{axis}.twice")
        inner *= 2 * size
    value = _shaped(exporter, "Reshape", value, (1, -1, *(2 * s for s in source.size)), name)
    whole = Box(tuple(2 * l for l in source.lo), tuple(2 * h for h in source.hi))
    return exporter.cropped(value, whole, box)


def _shaped(
    exporter: _Exporter, operation: str, value: str, shape: Sequence[int], name: str
) -> str:
    constant = exporter.builder.constant(f"{name}.shape", np.array(shape, np.int64))
    return exporter.builder.apply(operation, [value, constant], name)


def _concat(exporter: _Exporter, node: Node) -> str:
    return exporter.builder.apply("Concat", exporter.sources(node), node["name"], axis=1)


def _affine(exporter: _Exporter, node: Node) -> str:
    scale, shift = (exporter.per_channel(node, name) for name in ("scale", "shift"))
    name = node["name"]
    scaled = exporter.builder.apply("Mul", [*exporter.sources(node), scale], f"{name}.scaled")
    return exporter.builder.apply("Add", [scaled, shift], name)


def _leaky_relu(exporter: _Exporter, node: Node) -> str:
    inputs = exporter.sources(node)
    return exporter.builder.apply("LeakyRelu", inputs, node["name"], alpha=float(node["slope"]))


def _tanh(exporter: _Exporter, node: Node) -> str:
    return exporter.builder.apply("Tanh", exporter.sources(node), node["name"])


def _sigmoid(exporter: _Exporter, node: Node) -> str:
    return exporter.builder.apply("Sigmoid", exporter.sources(node), node["name"])


def _softmax(exporter: _Exporter, node: Node) -> str:
    return exporter.builder.apply("Softmax", exporter.sources(node), node["name"], axis=1)


_OPERATIONS: dict[str, Callable[[_Exporter, Node], str]] = {
    "noise": _noise,
    "periodic": _periodic,
    "conv3d": _conv3d,
    "conv_transpose3d": _conv_transpose3d,
    "upsample": _upsample,
    "concat": _concat,
    "affine": _affine,
    "leaky_relu": _leaky_relu,
    "tanh": _tanh,
    "sigmoid": _sigmoid,
    "softmax": _softmax,
}
