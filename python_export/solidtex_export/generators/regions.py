"""Receptive fields: the box of every tensor of a lattice graph that an output box needs.

Boxes are in absolute integer coordinates of their level. The float64 oracle
(export/verification/reference.py) implements the same rules independently and checks these.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from solidtex_export.generators.planes import Axes

Node = dict[str, Any]
"""Node of the graph in a model's document."""


@dataclass(frozen=True)
class Box:
    """A region of one level in absolute integer coordinates: `lo` inclusive, `hi` exclusive."""

    lo: tuple[int, ...]
    hi: tuple[int, ...]

    @property
    def size(self) -> tuple[int, ...]:
        return tuple(b - a for a, b in zip(self.lo, self.hi, strict=True))

    def grown(self, margin: int) -> Box:
        return Box(tuple(v - margin for v in self.lo), tuple(v + margin for v in self.hi))

    def coarser(self) -> Box:
        """Smallest region of the next level whose upsampling covers this one."""
        return Box(tuple(v // 2 for v in self.lo), tuple((v - 1) // 2 + 1 for v in self.hi))

    def of_transpose(self, kernel: int, padding: int) -> Box:
        """Input box of a transposed convolution: o = 2i + t - padding for taps t.

        It has at least one i, also where kernel 1 leaves only the bias.
        """
        lo = tuple((l + padding - kernel + 1) // 2 for l in self.lo)
        return Box(lo, tuple((h - 1 + padding) // 2 + 1 for h in self.hi))

    def permuted(self, axes: Axes) -> Box:
        return Box(tuple(self.lo[a] for a in axes), tuple(self.hi[a] for a in axes))


def needed(node: Node, box: Box) -> Box:
    """Box of each input that `node` needs in order to fill `box`."""
    if node["op"] == "conv3d":
        return box.grown(node["kernel"] // 2)
    if node["op"] == "upsample":
        return box.coarser()
    if node["op"] == "conv_transpose3d":
        return box.of_transpose(node["kernel"], node["padding"])
    return box


def regions(nodes: list[Node], box: Box) -> dict[str, Box]:
    """Box that each node needs, by name; a tensor with several readers gets the hull of theirs."""
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
    """Coarsest pitch: origins that differ by multiples of it have equal regions."""
    return 1 << max(node["level"] for node in nodes if "inputs" not in node)
