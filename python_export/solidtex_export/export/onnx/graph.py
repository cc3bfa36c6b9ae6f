"""Builds one ONNX graph with unique value names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from onnx import GraphProto, NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

Shape = Sequence[int | str]
"""Dimensions of a value; a string names a dynamic dimension."""


class GraphBuilder:
    """Collects nodes and constants. Values are referred to by name, as in ONNX itself."""

    def __init__(self, output: str) -> None:
        self._output = output
        self._names = {output}
        self._nodes: list[NodeProto] = []
        self._constants: list[TensorProto] = []
        self._inputs: list[ValueInfoProto] = []

    def input(self, name: str, shape: Shape) -> str:
        """Add an input to the graph, named `name` or with a suffix."""
        name = self._fresh(name)
        self._inputs.append(float_value(name, shape))
        return name

    def constant(self, name: str, values: np.ndarray) -> str:
        name = self._fresh(name)
        self._constants.append(numpy_helper.from_array(np.ascontiguousarray(values), name))
        return name

    def apply(self, operation: str, inputs: Sequence[str], name: str, **attributes: Any) -> str:
        """Add a node; returns its only output, named `name` or with a suffix."""
        (output,) = self.apply_many(operation, inputs, [name], **attributes)
        return output

    def apply_many(
        self, operation: str, inputs: Sequence[str], names: Sequence[str], **attributes: Any
    ) -> list[str]:
        outputs = [self._fresh(name) for name in names]
        self._nodes.append(helper.make_node(operation, inputs, outputs, outputs[0], **attributes))
        return outputs

    def graph(self, name: str, value: str, shape: Shape) -> GraphProto:
        """The graph whose output is `value`."""
        self._nodes.append(helper.make_node("Identity", [value], [self._output], self._output))
        outputs = [float_value(self._output, shape)]
        return helper.make_graph(self._nodes, name, self._inputs, outputs, self._constants)

    def _fresh(self, name: str) -> str:
        unique, count = name, 1
        while unique in self._names:
            count += 1
            unique = f"{name}_{count}"
        self._names.add(unique)
        return unique


def float_value(name: str, shape: Shape) -> ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
