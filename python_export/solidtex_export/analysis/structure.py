"""Structure score: how much of a photograph its color distribution and spectrum do not explain.

Outlines score high. docs/experiments/structure-score.md lists what else was tried.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import torch
from torch import Tensor

from solidtex_export.analysis.grain import channel_axes, whiten
from solidtex_export.analysis.surrogate import surrogate
from solidtex_export.images.exemplar import Exemplar

Distance = Callable[[Tensor, Tensor], Tensor]
"""Distance of two whitened images [1, channel, rows, columns]."""

SURROGATES = 8  # with 4, rock and tissue differed by 3 from seed to seed
LARGEST = 256  # pixels on a side are looked at
SCALE = 1000.0  # of the shipped descriptor's distances


class MeasuredImage:
    """A photograph, whitened, that the distance of other images is measured from.

    Draws at random, the same in every call, and leaves the global random generator unchanged.
    """

    def __init__(self, exemplar: Exemplar, distance: Distance) -> None:
        mean, basis = channel_axes([exemplar])
        self.pixels = whiten(exemplar.image, mean, basis)[:, :LARGEST, :LARGEST]
        self._distance = distance

    def farthest(self, pictures: Sequence[Tensor], draws: int) -> float:
        """Largest of the distances from whitened images, each a mean over `draws`."""
        with torch.random.fork_rng(devices=[]), torch.no_grad():
            torch.manual_seed(0)
            return max(self._mean([picture] * draws) for picture in pictures)

    @property
    def surrogate_distance(self) -> float:
        """Distance from images with the photograph's color distribution and spectrum alone."""
        return self._measured[0]

    @property
    def structure_score(self) -> float:
        """Distance of surrogates relative to the distance between the photograph's own halves.

        It is about 0 where there is no structure, and 30 for the crumbs of a brick.
        """
        far, state = self._measured
        with torch.random.fork_rng(devices=[]), torch.no_grad():
            torch.set_rng_state(state)
            return far - self._mean(self._halves())

    @cached_property
    def _measured(self) -> tuple[float, Tensor]:
        """Distance of the surrogates, and the state of the random generator after it."""
        with torch.random.fork_rng(devices=[]), torch.no_grad():
            generator = torch.manual_seed(0)
            pictures = [surrogate(self.pixels, generator) for _ in range(SURROGATES)]
            return self._mean(pictures), torch.get_rng_state()

    def _halves(self) -> list[Tensor]:
        image = self.pixels
        rows, columns = (side // 2 for side in image.shape[1:])
        return [image[:, :rows], image[:, -rows:], image[:, :, :columns], image[:, :, -columns:]]

    def _mean(self, pictures: Sequence[Tensor]) -> float:
        """Mean distance in thousandths."""
        distances = [float(self._distance(p[None], self.pixels[None])) for p in pictures]
        return SCALE * sum(distances) / len(pictures)
