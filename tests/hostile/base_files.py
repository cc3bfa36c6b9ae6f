"""Small valid models of both families, and their encoding to bytes, independent of the readers."""

import copy
import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Document = dict[str, Any]
Tensors = dict[str, np.ndarray]
Header = dict[str, Any]


@dataclass
class Draft:
    """A model on its way to bytes; every stage can be spoiled."""

    document: Document
    tensors: Tensors
    metadata: dict[str, Any] = field(default_factory=dict)

    def copy(self) -> "Draft":
        return copy.deepcopy(self)

    def header_and_data(self) -> tuple[Header, bytes]:
        header: Header = {"__metadata__": {"solidtex": json.dumps(self.document), **self.metadata}}
        data = b""
        for name, values in self.tensors.items():
            raw = values.astype("<f4").tobytes()
            offsets = [len(data), len(data) + len(raw)]
            header[name] = {"dtype": "F32", "shape": list(values.shape), "data_offsets": offsets}
            data += raw
        return header, data

    def encode(self) -> bytes:
        header, data = self.header_and_data()
        return pack(json.dumps(header).encode(), data)


def pack(header: bytes, data: bytes) -> bytes:
    return struct.pack("<Q", len(header)) + header + data


def _document(family: str, channels: list[str], architecture: Document) -> Document:
    return {
        "version": 1,
        "name": f"tiny-{family}",
        "family": family,
        "channels": channels,
        "color_space": "srgb",
        "noise": {"scheme": "solidtex-1"},
        family: architecture,
        "exemplar": {"file": "none.png", "sha256": "0" * 64, "license": "CC0-1.0", "source": "-"},
        "training": {"steps": 0},
        "license": "Apache-2.0",
    }


def _random(shapes: dict[str, tuple[int, ...]]) -> Tensors:
    generator = np.random.default_rng(0)
    return {k: generator.normal(0, 0.3, v).astype(np.float32) for k, v in shapes.items()}


def field_draft() -> Draft:
    """Every operation of the lattice family once."""
    nodes: list[Document] = [
        {"name": "z1", "op": "noise", "level": 1, "channels": 2, "distribution": "uniform"},
        {"name": "z0", "op": "noise", "level": 0, "channels": 2, "distribution": "normal"},
        {"name": "up", "op": "upsample", "inputs": ["z1"]},
        {"name": "deconv", "op": "conv_transpose3d", "inputs": ["z1"]}
        | {"out_channels": 2, "kernel": 4, "padding": 1},
        {"name": "joined", "op": "concat", "inputs": ["up", "deconv", "z0"]},
        {"name": "conv", "op": "conv3d", "inputs": ["joined"], "out_channels": 3, "kernel": 3},
        {"name": "scaled", "op": "affine", "inputs": ["conv"]},
        {"name": "active", "op": "leaky_relu", "inputs": ["scaled"], "slope": 0.01},
        {"name": "bounded", "op": "tanh", "inputs": ["active"]},
        {"name": "color", "op": "sigmoid", "inputs": ["bounded"]},
    ]
    channels = ["albedo.r", "albedo.g", "albedo.b"]
    tensors = _random(
        {
            "deconv.weight": (2, 2, 4, 4, 4),
            "deconv.bias": (2,),
            "conv.weight": (3, 6, 3, 3, 3),
            "conv.bias": (3,),
            "scaled.scale": (3,),
            "scaled.shift": (3,),
        }
    )
    return Draft(_document("field", channels, {"nodes": nodes, "output": "color"}), tensors)


def sampler_draft() -> Draft:
    sizes = {"octaves": 4, "hidden_layers": 3, "width": 5, "slope": 0.2}
    tensors = _random(
        {
            "transforms": (4, 3, 3),
            "constant": (5,),
            "hidden.0.weight": (5, 5),
            "hidden.0.bias": (5,),
            "hidden.0.noise": (5, 2),
            "hidden.1.weight": (5, 5),
            "hidden.1.bias": (5,),
            "hidden.1.noise": (5, 2),
            "hidden.2.weight": (5, 5),
            "hidden.2.bias": (5,),
            "output.weight": (2, 5),
            "output.bias": (2,),
        }
    )
    return Draft(_document("sampler", ["albedo.r", "roughness"], sizes), tensors)


def valid_files() -> dict[str, bytes]:
    """Files that are unusual but right: a reader must not be stricter than the format."""
    reordered = field_draft()
    reordered.tensors = dict(reversed(reordered.tensors.items()))
    foreign_metadata = sampler_draft()
    foreign_metadata.metadata["format"] = "pt"
    bare = field_draft()
    for key in ("exemplar", "training", "license"):
        del bare.document[key]
    several = sampler_draft()
    several.document["exemplar"] = [several.document["exemplar"]] * 3
    deepest = sampler_draft()
    deepest.document["training"]["deep"] = nested(30)  # document and training are two more
    header, data = field_draft().header_and_data()
    return {
        "field": field_draft().encode(),
        "sampler": sampler_draft().encode(),
        "tensors_in_another_order": reordered.encode(),
        "foreign_metadata": foreign_metadata.encode(),
        "only_required_keys": bare.encode(),
        "three_exemplars": several.encode(),
        "deepest_json": deepest.encode(),
        "padded_header": pack(json.dumps(header).encode() + b" " * 5, data),
    }


def chain_draft(length: int, width: int, kernel: int) -> Draft:
    """A chain of convolutions: each is legal, but the region of one voxel grows with each."""
    noise = {"op": "noise", "level": 0, "channels": width, "distribution": "uniform"}
    nodes: list[Document] = [{"name": "n0", **noise}]
    shapes: dict[str, tuple[int, ...]] = {}
    for i in range(1, length + 1):
        conv = {"op": "conv3d", "inputs": [f"n{i - 1}"], "out_channels": width, "kernel": kernel}
        nodes.append({"name": f"n{i}", **conv})
        shapes |= {f"n{i}.weight": (width, width, *[kernel] * 3), f"n{i}.bias": (width,)}
    channels = [f"c{i}" for i in range(width)]
    graph = {"nodes": nodes, "output": f"n{length}"}
    return Draft(_document("field", channels, graph), _random(shapes))


def nested(depth: int) -> Any:
    """`depth` arrays inside one another."""
    return json.loads("[" * depth + "]" * depth)
