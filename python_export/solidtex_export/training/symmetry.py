"""In which orientations a photograph looks just as right, where the user does not say.

Losses that see slices and photograph in random orientations keep a solid from leaning as one
photograph happens to. But a photograph that is lit from one side, or whose layers lie, looks wrong
turned, and its statistics averaged over all orientations belong to no picture: lit pebbles came out
as noise, and as pebbles in the photograph's own orientation.

Measured as the distance by our descriptor (losses/learned.py) of the photograph from itself flipped
and turned, at 144 and 256 pixels:

                        flipped      turned
    granites, marble    0.1 to 2.0   0.1
    rust, brick, pores  0.0 to 0.2   0.0 to 0.4
    lichen on rock      2.1, 0.5     4.6, 1.0
    slanting grain      4.8, 3.3     0.6, 0.9
    grass               3.3, 4.4     5.0, 6.6
    red-cracked rock    8.9, 3.3     1.2, 0.7
    slanting rock       11, 2.8      11, 4.1
    rock in layers      8.9, 2.2     22, 20
    lit pebbles         154, 67      0.8, 0.3
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from solidtex_export.training.axes import channel_axes, whiten
from solidtex_export.training.exemplar import Exemplar
from solidtex_export.training.outlines import LARGEST, SCALE, Distance

DIFFERENT = 10.0
DRAWS = 8  # the descriptor turns channels at random


class Symmetry(NamedTuple):
    """Orientations, named as for --symmetry, and what was found on the photograph."""

    name: str
    reason: str


def symmetry_of(exemplars: Sequence[Exemplar], turns: bool, distance: Distance) -> Symmetry:
    """Of all `exemplars` alike, the same in every call. Whether they may be turned by a quarter is
    asked only if one of them `turns` from direction to direction."""
    flipped = _difference(exemplars, distance, lambda i: [i.flip(1), i.flip(2)])
    if flipped >= DIFFERENT:
        return Symmetry("none", f"differs by {flipped:.1f} when flipped, at least {DIFFERENT:g}")
    if not turns:
        return Symmetry("flips", f"differs by {flipped:.1f} when flipped, below {DIFFERENT:g}")
    turned = _difference(exemplars, distance, lambda i: [i.transpose(1, 2)])
    if turned >= DIFFERENT:
        return Symmetry("flips", f"differs by {turned:.1f} when turned, at least {DIFFERENT:g}")
    return Symmetry("all", f"differs by {turned:.1f} when turned, below {DIFFERENT:g}")


def _difference(
    exemplars: Sequence[Exemplar], distance: Distance, moved: Callable[[Tensor], list[Tensor]]
) -> float:
    """The largest, over photographs and their moved copies."""
    images = [whiten(e.image, *channel_axes([e]))[:, :LARGEST, :LARGEST] for e in exemplars]
    with torch.random.fork_rng(devices=[]), torch.no_grad():
        torch.manual_seed(0)
        return max(
            SCALE * sum(float(distance(copy[None], image[None])) for _ in range(DRAWS)) / DRAWS
            for image in images
            for copy in moved(image)
        )
