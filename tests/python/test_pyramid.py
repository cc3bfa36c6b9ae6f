"""The fully convolutional generator with multi-scale noise, before it has learned anything."""

import pytest
import torch

from solidtex_export.generators.lattice import Box
from solidtex_export.generators.pyramid import PyramidGenerator

BOX = Box((0, 0, 0), (1, 96, 96))


@pytest.mark.parametrize("levels", [1, 3, 5])
@torch.no_grad()
def test_every_level_of_noise_is_seen(levels: int) -> None:
    torch.manual_seed(1)
    generator = PyramidGenerator(levels)
    noise = generator.draw_noise(BOX)
    values = generator(noise, BOX)
    assert 0.5 < float(values.std()) < 1.5
    for level in range(levels):
        other = [torch.randn_like(z) if k == level else z for k, z in enumerate(noise)]
        share = (generator(other, BOX) - values).square().mean() / (2 * values.var())
        assert 0.3 / levels < float(share) < 3 / levels, level
