"""Evaluates an exported graph eagerly, one torch function for each node."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F
from onnx import ModelProto, NodeProto, helper, numpy_helper
from torch import Tensor

Attributes = dict[str, Any]


class TorchGraph:
    """Callable with the inputs by name."""

    def __init__(
        self,
        model: ModelProto,
        layout: torch.memory_format,
        to: Callable[[Tensor], Tensor] = lambda tensor: tensor,
    ) -> None:
        """`to` moves weights to a device or a precision."""
        self._nodes = [(node, _attributes(node)) for node in model.graph.node]
        self._constants = {
            constant.name: in_layout(numpy_helper.to_array(constant), layout)
            for constant in model.graph.initializer
        }
        self._constants = {
            name: to(tensor) if tensor.is_floating_point() else tensor
            for name, tensor in self._constants.items()
        }
        self._output = model.graph.output[0].name
        self._last_use = {
            name: index for index, (node, _) in enumerate(self._nodes) for name in node.input
        }

    @torch.inference_mode()
    def __call__(self, inputs: Mapping[str, Tensor]) -> Tensor:
        values = dict(inputs)
        for index, (node, attributes) in enumerate(self._nodes):
            sources = [self._value(values, name) for name in node.input]
            results = _OPERATIONS[node.op_type](attributes, *sources)
            values.update(zip(node.output, results, strict=True))
            for name in node.input:  # a block's tensors together would fill the memory
                if self._last_use[name] == index:
                    values.pop(name, None)
        return values[self._output]

    def _value(self, values: Mapping[str, Tensor], name: str) -> Tensor | None:
        return values.get(name, self._constants.get(name))


def in_layout(array: np.ndarray, layout: torch.memory_format) -> Tensor:
    """Convert a tensor of a volume to the chosen memory layout."""
    tensor = torch.from_numpy(array.copy())
    return tensor.to(memory_format=layout) if tensor.ndim == 5 else tensor


def _attributes(node: NodeProto) -> Attributes:
    return {a.name: helper.get_attribute_value(a) for a in node.attribute}


def _slice(_: Attributes, x: Tensor, starts: Tensor, ends: Tensor, axes: Tensor) -> Tensor:
    for axis, start, end in zip(axes.tolist(), starts.tolist(), ends.tolist(), strict=True):
        x = x.narrow(axis, start, end - start)
    return x


def _conv_transpose(a: Attributes, x: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
    return F.conv_transpose3d(x, weight, bias, a["strides"], output_padding=a["output_padding"])


def _one(function: Callable[..., Tensor]) -> Callable[..., tuple[Tensor, ...]]:
    return lambda attributes, *inputs: (function(attributes, *inputs),)


_OPERATIONS: dict[str, Callable[..., tuple[Tensor, ...]]] = {
    "Add": _one(lambda _, x, y: x + y),
    "Concat": _one(lambda a, *inputs: torch.cat(inputs, a["axis"])),
    "Conv": _one(lambda _, *inputs: F.conv3d(*inputs)),
    "ConvTranspose": _one(_conv_transpose),
    "Expand": _one(lambda _, x, shape: x.expand(torch.broadcast_shapes(x.shape, shape.tolist()))),
    "Gemm": _one(lambda _, x, weight, bias: F.linear(x, weight, bias)),
    "Identity": _one(lambda _, x: x),
    "LeakyRelu": _one(lambda a, x: F.leaky_relu(x, a["alpha"])),
    "Mul": _one(lambda _, x, y: x * y),
    "Reshape": _one(lambda _, x, shape: x.reshape(shape.tolist())),
    "Sigmoid": _one(lambda _, x: torch.sigmoid(x)),
    "Slice": _one(_slice),
    "Softmax": _one(lambda a, x: torch.softmax(x, a["axis"])),
    "Split": lambda a, x, sizes: torch.split(x, sizes.tolist(), a["axis"]),
    "Tanh": _one(lambda _, x: torch.tanh(x)),
}
