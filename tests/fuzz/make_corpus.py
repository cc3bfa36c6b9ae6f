#!/usr/bin/env python3
"""Writes the small valid inputs of corpus/, which the fuzz targets start from.

From the repository: PYTHONPATH=python_export .venv/bin/python tests/fuzz/make_corpus.py
"""

from __future__ import annotations

import base64
import io
import json
import struct
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

HERE = Path(__file__).resolve().parent
sys.path += [str(HERE.parent / "hostile"), str(HERE.parent / "spaces")]

import base_files  # noqa: E402
import space_files  # noqa: E402

from solidtex_export.images.photographs import write_exr  # noqa: E402
from solidtex_export.spaces.random_space import random_space  # noqa: E402

CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]

PLY_HEADER = """ply
format {} 1.0
comment made by hand
element vertex 4
property float x
property float y
property float z
property uchar red
element face 4
property list uchar int vertex_indices
end_header
"""
OBJ = """o tetrahedron
v 0 0 0
v 1 0 0 0.5 0.5 0.5
v 0 1 0
v 0 0 1
vt 0 0
vt 1 0
vn 0 0 1
f 1/1/1 3/2/1 2/1/1
f -4 -3 -1
f 1//1 4//1 3//1 \\
  2//1
"""
OFF = "COFF\n4 4 0\n0 0 0 1 0 0\n1 0 0 1 0 0\n0 1 0 1 0 0\n0 0 1 1 0 0\n"
STL = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
QUERIES = {
    "volume": "granite.solidtex?size=64,32,16&seed=7&lod=2&origin=-5,0,9000000000&type=float",
    "atlas": "models/granite.solidtex?mesh=vase.obj&size=512&scale=2.5e-1&tile=16",
    "plain": "granite.solidtex",
}


def ascii_ply() -> bytes:
    vertices = "".join(f"{x} {y} {z} 7\n" for x, y, z in CORNERS)
    faces = "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES)
    return (PLY_HEADER.format("ascii") + vertices + faces).encode()


def binary_ply(order: str, name: str) -> bytes:
    body = b"".join(struct.pack(f"{order}3fB", *corner, 7) for corner in CORNERS)
    body += b"".join(struct.pack(f"{order}B3i", 3, *face) for face in FACES)
    return PLY_HEADER.format(name).encode() + body


def binary_stl() -> bytes:
    triangles = (struct.pack("<12fH", 0, 0, 1, *CORNERS[0], *CORNERS[1], *CORNERS[2], 0),)
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(triangles)


def gltf_document(uri: str | None) -> tuple[dict[str, object], bytes]:
    places = b"".join(struct.pack("<3f", *corner) for corner in CORNERS)
    data = places + b"".join(struct.pack("<3H", *face) for face in FACES)
    buffer: dict[str, object] = {"byteLength": len(data)}
    if uri is not None:
        buffer["uri"] = uri + base64.b64encode(data).decode()
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [1, 2, 3], "rotation": [0, 0, 0, 1]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(places)},
            {"buffer": 0, "byteOffset": len(places), "byteLength": len(data) - len(places)},
        ],
        "buffers": [buffer],
    }
    return document, data


def glb() -> bytes:
    document, data = gltf_document(None)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def scenes() -> dict[str, bytes]:
    floor = {"type": "principled", "color": [0.5, 0.4, 0.3], "roughness": 0.4}
    scene = {
        "version": 1,
        "render": {"size": [8, 4], "spp": 1},
        "camera": {"position": [0, 1, 4], "look_at": [0, 0, 0], "fov": 40},
        "materials": {"floor": floor, "glass": {"type": "dielectric", "ior": 1.5}},
        "objects": [],
        "lights": [{"position": [0, 2, 0], "sphere": 0.1, "radiance": [3, 3, 3]}],
        "environment": {"color": [0.2, 0.3, 0.4]},
    }
    moving = scene | {"animation": {"frames": 3, "tracks": {"/camera/fov": {"0": 40, "2": 20}}}}
    return {"plain": json.dumps(scene).encode(), "animated": json.dumps(moving).encode()}


def images() -> dict[str, bytes]:
    """One image in the formats of photographs and of textures."""
    pixels = np.random.default_rng(1).integers(0, 256, (5, 6, 3), np.uint8)
    files = {}
    for kind in ("PNG", "JPEG", "TIFF", "BMP", "PPM", "TGA", "WEBP"):
        buffer = io.BytesIO()
        Image.fromarray(pixels).save(buffer, kind)
        files[kind.lower()] = buffer.getvalue()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "a.exr"
        write_exr(file, ["R", "G", "B"], pixels / 255)
        files["exr"] = file.read_bytes()
    return files


def inputs() -> dict[str, dict[str, bytes]]:
    models = base_files.valid_files()
    gltf = json.dumps(gltf_document("data:application/octet-stream;base64,")[0]).encode()
    kinds = space_files.KINDS
    return {
        "model": {"lattice": models["field"], "sampler": models["sampler"]},
        "space": {kind: random_space(sizes).encode() for kind, sizes in kinds.items()},
        "ply": {
            "ascii": ascii_ply(),
            "little": binary_ply("<", "binary_little_endian"),
            "big": binary_ply(">", "binary_big_endian"),
        },
        "obj": {"tetrahedron": OBJ.encode()},
        "off": {"tetrahedron": (OFF + "".join(f"3 {a} {b} {c}\n" for a, b, c in FACES)).encode()},
        "stl": {
            "ascii": (STL + "endloop\nendfacet\nendsolid a\n").encode(),
            "binary": binary_stl(),
        },
        "gltf": {"text": gltf, "binary": glb()},
        "query": {name: text.encode() for name, text in QUERIES.items()},
        "scene": scenes(),
        "image": images(),
    }


def main() -> None:
    for target, files in inputs().items():
        folder = HERE / "corpus" / target
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            (folder / name).write_bytes(content)


if __name__ == "__main__":
    main()
