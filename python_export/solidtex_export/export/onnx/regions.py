"""Which box of every tensor of a lattice graph an output box needs, in absolute coordinates."""

from __future__ import annotations

from typing import Any

from solidtex_export.generators.lattice import Box

Node = dict[str, Any]


def needed(node: Node, box: Box) -> Box:
    """The box of each input that `node` needs in order to fill `box`."""
    if node["op"] == "conv3d":
        return box.grown(node["kernel"] // 2)
    if node["op"] == "upsample":
        return box.coarser()
    if node["op"] == "conv_transpose3d":
        return _needed_by_transpose(box, node["kernel"], node["padding"])
    return box


def _needed_by_transpose(box: Box, kernel: int, padding: int) -> Box:
    """o = 2i + t - padding for taps t; at least one i, also where kernel 1 leaves only bias."""
    lo = tuple((l + padding - kernel + 1) // 2 for l in box.lo)
    hi = tuple((h - 1 + padding) // 2 + 1 for h in box.hi)
    return Box(lo, hi)


def regions(nodes: list[Node], box: Box) -> dict[str, Box]:
    """By node name. A tensor that several nodes use gets the hull of what they need."""
    found = {nodes[-1]["name"]: box}
    for node in reversed(nodes):
        for source in node.get("inputs", []):
            need = needed(node, found[node["name"]])
            found[source] = hull(found[source], need) if source in found else need
    return found


def hull(a: Box, b: Box) -> Box:
    lo = tuple(min(pair) for pair in zip(a.lo, b.lo, strict=True))
    hi = tuple(max(pair) for pair in zip(a.hi, b.hi, strict=True))
    return Box(lo, hi)


def alignment(nodes: list[Node]) -> int:
    """Origins that differ by multiples of this have like regions: the coarsest pitch."""
    return 1 << max(node["level"] for node in nodes if node["op"] == "noise")
