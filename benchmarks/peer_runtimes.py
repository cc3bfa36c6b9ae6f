"""Runtimes to compare with: each peer makes a callable from an exported graph and its noise."""

from __future__ import annotations

import importlib.metadata
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from onnx import ModelProto

Inputs = Mapping[str, np.ndarray]
Work = Callable[[], np.ndarray]


@dataclass(frozen=True)
class Peer:
    name: str
    package: str
    load: Callable[[ModelProto, Inputs, int], Work]
    """Makes a callable from a graph, its noise and a number of threads."""
    families: tuple[str, ...] = ("lattice", "sampler")

    @property
    def version(self) -> str | None:
        """Version of the installed runtime, or None."""
        try:
            return importlib.metadata.version(self.package)
        except importlib.metadata.PackageNotFoundError:
            return None


def _openvino(model: ModelProto, inputs: Inputs, threads: int) -> Work:
    import openvino

    core = openvino.Core()
    network = core.read_model(model.SerializeToString())
    network.reshape({name: values.shape for name, values in inputs.items()})
    settings = {
        "INFERENCE_PRECISION_HINT": "f32",
        "PERFORMANCE_HINT": "LATENCY",
        "INFERENCE_NUM_THREADS": threads,
        "ENABLE_CPU_PINNING": False,  # would tie this process, and what it starts, to one core
    }
    request = core.compile_model(network, "CPU", settings).create_infer_request()
    feed = dict(inputs)
    return lambda: request.infer(feed, share_inputs=True, share_outputs=True)[0]


def _onnx_runtime(model: ModelProto, inputs: Inputs, threads: int) -> Work:
    os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    providers = ["CPUExecutionProvider"]
    data = model.SerializeToString()
    session = onnxruntime.InferenceSession(data, options, providers=providers)
    return lambda: session.run(None, dict(inputs))[0]


def _torch(layout: str) -> Callable[[ModelProto, Inputs, int], Work]:
    def load(model: ModelProto, inputs: Inputs, threads: int) -> Work:
        import torch
        from torch_graph import TorchGraph, in_layout

        memory_format = getattr(torch, layout)
        graph = TorchGraph(model, memory_format)
        feed = {name: in_layout(values, memory_format) for name, values in inputs.items()}

        def work() -> np.ndarray:
            torch.set_num_threads(threads)  # one setting for the process
            return graph(feed).numpy()

        return work

    return load


PEERS = (
    Peer("OpenVINO f32", "openvino", _openvino),
    Peer("ONNX Runtime", "onnxruntime", _onnx_runtime),
    Peer("PyTorch", "torch", _torch("contiguous_format")),
    # Not what a network gets unasked, but convolutions are twice as fast: 122 instead of
    # 57 GFLOP/s for 24 to 24 channels on 66^3 voxels, one core with AVX-512.
    Peer("PyTorch, channels last", "torch", _torch("channels_last_3d"), ("lattice",)),
)
