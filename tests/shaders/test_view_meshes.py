"""The page of solidtex-view reads meshes of the viewer's own, or says why not."""

import base64
import json
import struct
from typing import Any

import numpy as np
import pytest
from view_pages import FLAT, message, picture

CORNERS = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]], "<f4") + 7
ORDER = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]


def glb(
    corners: np.ndarray = CORNERS,
    order: list[int] = ORDER,
    normals: np.ndarray | None = None,
    mode: int = 4,
    nodes: Any = ({"mesh": 0, "scale": [2, 2, 2]},),
    required: tuple[str, ...] = (),
    uri: str = "",
) -> bytes:
    """A tetrahedron, or what the arguments make of it."""
    parts = [corners.astype("<f4"), np.array(order, "<u2")]
    kinds = [(5126, "VEC3"), (5123, "SCALAR")]
    attributes = {"POSITION": 0}
    if normals is not None:
        parts.append(normals.astype("<f4"))
        kinds.append((5126, "VEC3"))
        attributes["NORMAL"] = 2
    starts = np.cumsum([0, *(part.nbytes for part in parts)]).tolist()
    document = {
        "asset": {"version": "2.0"},
        "extensionsRequired": required,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 1, "mode": mode}]}],
        "accessors": [
            {"bufferView": i, "componentType": kind, "count": len(part), "type": shape}
            for i, (part, (kind, shape)) in enumerate(zip(parts, kinds, strict=True))
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": part.nbytes}
            for start, part in zip(starts, parts, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1], **({"uri": uri} if uri else {})}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", starts[-1], 0x004E4942) + b"".join(p.tobytes() for p in parts)
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def drop(page: Any, name: str, data: bytes) -> str:
    """Show a file as if it had been dropped; the message of the page."""
    code = """([name, data]) => solidtex.showFile(
        new File([Uint8Array.from(atob(data), (c) => c.charCodeAt(0))], name))"""
    page.evaluate(code, [name, base64.b64encode(data).decode()])
    return message(page)


def triangles(page: Any, data: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Positions and normals [triangle, corner, axis] that the page reads."""
    code = """(data) => {
      const { positions, normals } = readGlb(
        Uint8Array.from(atob(data), (c) => c.charCodeAt(0)).buffer, "own.glb");
      return [Array.from(positions), Array.from(normals)];
    }"""
    found = page.evaluate(code, base64.b64encode(data).decode())
    positions, normals = (np.array(values).reshape(-1, 3, 3) for values in found)
    return positions, normals


def facing(positions: np.ndarray) -> np.ndarray:
    a, b, c = positions.transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_a_mesh_of_ones_own(page: Any) -> None:
    """Without normals, and moved into view."""
    for _ in range(2):
        assert drop(page, "own.glb", glb()) == ""
    options = page.evaluate("[...document.getElementById('shape').options].map((o) => o.text)")
    assert options.count("own.glb") == 1
    found = picture(page, cut="", **FLAT)
    background = np.abs(found - 0.86).max(axis=-1) < 0.01
    assert 0.1 < 1 - background.mean() < 0.9


def test_strips_and_fans(page: Any) -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    for mode, order in ((5, [0, 1, 2, 3]), (6, [0, 1, 3, 2])):
        positions, _ = triangles(page, glb(square, order, mode=mode))
        assert len(positions) == 2
        assert np.allclose(facing(positions), [0, 0, 1])


def test_normals_that_are_zero_are_missing(page: Any) -> None:
    """Also single ones: their triangle stands for them."""
    given = np.zeros((12, 3))
    given[7] = [0, 0, 2]
    positions, normals = triangles(page, glb(CORNERS[ORDER], list(range(12)), given))
    expected = np.repeat(facing(positions)[:, None], 3, axis=1)
    expected[2, 1] = [0, 0, 1]
    assert np.allclose(normals, expected, atol=1e-5)


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, 2, 0.25]])
def test_nodes_that_mirror_or_stretch(page: Any, scale: list[float]) -> None:
    """Normals stay normal to the surface, and face outward."""
    flat = facing(CORNERS[np.array(ORDER)].reshape(-1, 3, 3))
    corners = CORNERS[ORDER]
    data = glb(
        corners, list(range(12)), np.repeat(flat, 3, axis=0), nodes=[{"mesh": 0, "scale": scale}]
    )
    positions, normals = triangles(page, data)
    outward = facing(positions)
    assert np.allclose(normals, outward[:, None], atol=1e-5)
    center = positions.mean(axis=(0, 1))
    assert ((positions.mean(axis=1) - center) * outward).sum(axis=1).min() > 0


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"solid x", "found no binary glTF, expected a .glb file"),
        (glb()[:-16], "found a file that ends before its vertices"),
        (glb().replace(b'"POSITION"', b'"POSITIVE"'), "found triangles without POSITION"),
        (glb().replace(b'"attributes"', b'"attribuded"'), "found a damaged file"),
        (glb().replace(b'"meshes"', b'"mashes"'), "found no meshes[0], expected it in the JSON"),
        (glb().replace(b'"accessors"', b'"axcessors"'), "found no accessors[0]"),
        (glb().replace(b'"bufferViews"', b'"bufferVoids"'), "found no bufferViews["),
        (glb().replace(b'"scenes"', b'"scents"'), "found no scenes[0]"),
        (glb(nodes=[{"children": [1]}]), "found no nodes[1]"),
        (glb(uri="other.bin"), "found vertices outside of its binary part, expected one .glb"),
        (glb(CORNERS * np.nan), "found points at one place, or not finite"),
        (glb(CORNERS * 0), "found points at one place, or not finite"),
        (glb(order=[0, 1, 9]), "found the vertex 9, expected one of 4"),
        (glb(mode=1), "found no triangles, expected a mesh"),
        (glb(nodes=[{"mesh": 0, "children": [0]}]), "found the node 0 in two places"),
        (glb(required=("KHR_draco_mesh_compression",)), "needs the extension KHR_draco"),
    ],
)
def test_refused_meshes(page: Any, data: bytes, told: str) -> None:
    assert drop(page, "bad.glb", data).startswith(f"bad.glb: {told}")
    options = page.evaluate("[...document.getElementById('shape').options].map((o) => o.text)")
    assert "bad.glb" not in options


def test_extensions_of_surfaces_are_ignored(page: Any) -> None:
    data = glb(required=("KHR_texture_transform", "KHR_materials_clearcoat"))
    assert drop(page, "own.glb", data) == ""
