"""Writes a space's encoder as an ONNX file."""

from __future__ import annotations

import numpy as np
from onnx import TensorProto, checker, helper
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from solidtex_export.export.onnx.graph import GraphBuilder
from solidtex_export.losses.descriptor.network import UNPADDED_SCALES
from solidtex_export.spaces.alanov.networks import Encoder
from solidtex_export.spaces.encoder import EPSILON, SLOPE, ConvolutionEncoder, DescriptorEncoder
from solidtex_export.spaces.photographs import NETWORK_MEAN, NETWORK_SCALE


def encoder_onnx(encoder: DescriptorEncoder | ConvolutionEncoder, side: int, colors: bool) -> bytes:
    """Bytes of a graph from "patches" [n, 3, side, side] to "codes" [n, code].

    `colors`: patches are colors of 0 ... 1, otherwise what the encoder was trained on.
    """
    if isinstance(encoder, DescriptorEncoder):
        return _descriptor_graph(encoder, side, colors)
    return _convolution_graph(encoder, side, colors)


def alanov_encoder_onnx(encoder: Encoder, side: int, code: int) -> bytes:
    """The same graph for an encoder of images of Alanov et al.: the mean of q(z | x)."""
    graph, x = _input(side, colors=True)
    for i, layer in enumerate(encoder.convolutions):
        assert isinstance(layer, nn.Conv2d)
        if i > 0:
            norm = encoder.norms[i - 1]
            assert isinstance(norm, nn.BatchNorm2d)
            layer = fuse_conv_bn_eval(layer, norm)
        x = _convolution(graph, f"conv{i}", layer, x)
        x = graph.apply("LeakyRelu", [x], f"conv{i}.act", alpha=encoder.slope)
    x = _convolution(graph, "last", encoder.last, x, code)
    axes = graph.constant("axes", np.array([2, 3], np.int64))
    x = graph.apply("ReduceMean", [x, axes], "mean", keepdims=0)
    return _serialized(graph, x, code)


def _descriptor_graph(encoder: DescriptorEncoder, side: int, colors: bool) -> bytes:
    graph, x = _input(side, colors)
    parts = []
    for scale, widths in enumerate(encoder.network.widths):
        if scale:
            x = graph.apply("AveragePool", [x], f"pool{scale}", kernel_shape=[2, 2], strides=[2, 2])
        for place in range(len(widths)):
            name = f"conv{scale + 1}_{place + 1}"
            layer = encoder.network.get_submodule(name)
            assert isinstance(layer, nn.Conv2d) and layer.bias is not None
            if scale >= UNPADDED_SCALES:
                pads = graph.constant(f"{name}.pads", np.array([0, 0, 1, 1] * 2, np.int64))
                x = graph.apply("Pad", [x, pads], f"{name}.padded", mode="reflect")
            weight = _bytes(graph, f"{name}.weight", layer.weight)
            bias = graph.constant(f"{name}.bias", _array(layer.bias))
            x = graph.apply("Conv", [x, weight, bias], name)
            x = graph.apply("Relu", [x], f"{name}.relu")
            unit = graph.constant(f"{name}.unit", _array(encoder.units[name]))
            axes = graph.constant(f"{name}.axes", np.array([2, 3], np.int64))
            mean = graph.apply("ReduceMean", [x, axes], f"{name}.mean", keepdims=0)
            squares = graph.apply("Mul", [x, x], f"{name}.squares")
            square = graph.apply("ReduceMean", [squares, axes], f"{name}.square", keepdims=0)
            epsilon = graph.constant(f"{name}.epsilon", np.array(EPSILON, np.float32))
            root = graph.apply(
                "Sqrt", [graph.apply("Add", [square, epsilon], f"{name}.sum")], f"{name}.root"
            )
            parts += [graph.apply("Div", [v, unit], f"{name}.scaled") for v in (mean, root)]
    x = graph.apply("Concat", parts, "summary", axis=1)
    x = _dense(graph, "first", encoder.first, x)
    x = graph.apply("LeakyRelu", [x], "first.act", alpha=SLOPE)
    x = _dense(graph, "last", encoder.last, x)
    if encoder.unit_codes:
        x = graph.apply("LpNormalization", [x], "unit", axis=1, p=2)
        size = graph.constant("size", np.array(encoder.last.out_features**0.5, np.float32))
        x = graph.apply("Mul", [x, size], "sized")
    return _serialized(graph, x, encoder.last.out_features)


def _convolution_graph(encoder: ConvolutionEncoder, side: int, colors: bool) -> bytes:
    graph, x = _input(side, colors)
    for i, layer in enumerate(encoder.convolutions):
        x = _convolution(graph, f"conv{i}", layer, x)
        x = graph.apply("LeakyRelu", [x], f"conv{i}.act", alpha=SLOPE)
    axes = graph.constant("axes", np.array([2, 3], np.int64))
    x = graph.apply("ReduceMean", [x, axes], "mean", keepdims=0)
    return _serialized(graph, _dense(graph, "last", encoder.last, x), encoder.last.out_features)


def _convolution(
    graph: GraphBuilder, name: str, layer: nn.Module, x: str, outputs: int | None = None
) -> str:
    """A convolution of stride 2, or its first `outputs` channels."""
    assert isinstance(layer, nn.Conv2d) and layer.bias is not None
    weight = graph.constant(f"{name}.weight", _array(layer.weight)[:outputs])
    bias = graph.constant(f"{name}.bias", _array(layer.bias)[:outputs])
    pads = [int(p) for p in layer.padding] * 2  # type: ignore[arg-type]
    return graph.apply("Conv", [x, weight, bias], name, strides=[2, 2], pads=pads)


def _input(side: int, colors: bool) -> tuple[GraphBuilder, str]:
    graph = GraphBuilder("codes")
    x = graph.input("patches", ("patch", 3, side, side))
    if colors:
        mean = graph.constant("mean", np.array(NETWORK_MEAN, np.float32))
        scale = graph.constant("scale", np.array(NETWORK_SCALE, np.float32))
        x = graph.apply("Div", [graph.apply("Sub", [x, mean], "centered"), scale], "scaled")
    return graph, x


def _array(tensor: Tensor) -> np.ndarray:
    return tensor.detach().float().cpu().numpy()


def _bytes(graph: GraphBuilder, name: str, tensor: Tensor) -> str:
    """A constant that is stored as 8-bit integers, with one scale for each output channel."""
    values = _array(tensor)
    scales = np.maximum(np.abs(values).max((1, 2, 3)) / 127, 1e-12)
    stored = np.rint(values / scales[:, None, None, None]).astype(np.int8)
    inputs = [graph.constant(f"{name}.stored", stored), graph.constant(f"{name}.scales", scales)]
    return graph.apply("DequantizeLinear", inputs, name, axis=0)


def _half(graph: GraphBuilder, name: str, tensor: Tensor) -> str:
    """A constant that is stored in float16."""
    stored = graph.constant(f"{name}.half", _array(tensor).astype(np.float16))
    return graph.apply("Cast", [stored], name, to=TensorProto.FLOAT)


def _dense(graph: GraphBuilder, name: str, layer: nn.Linear, x: str) -> str:
    weight = _half(graph, f"{name}.weight", layer.weight)
    bias = graph.constant(f"{name}.bias", _array(layer.bias))
    return graph.apply("Gemm", [x, weight, bias], name, transB=1)


def _serialized(graph: GraphBuilder, value: str, code: int) -> bytes:
    proto = graph.graph("encoder", value, ("patch", code))
    model = helper.make_model(
        proto, producer_name="solidtex", opset_imports=[helper.make_opsetid("", 18)], ir_version=8
    )
    checker.check_model(model, full_check=True)
    return bytes(model.SerializeToString(deterministic=True))
