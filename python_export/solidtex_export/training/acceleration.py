"""torch.compile for the parts of a generator that are called again and again."""

from __future__ import annotations

from torch import nn

from solidtex_export.generators.lattice import ConvBlock
from solidtex_export.generators.planes import PlaneConvolution
from solidtex_export.generators.sampler import HiddenLayer


def compile_generator(generator: nn.Module) -> None:
    """Compiles blocks in place, for any shape; keys of the state dict stay.

    Not the whole network: its boxes differ by the slice's offset, and each would be compiled anew.
    Not the critics: WGAN-GP differentiates twice, which torch.compile cannot.
    """
    compiled: set[nn.Module] = set()
    for module in generator.modules():
        inside = any(module in outer.modules() for outer in compiled)
        if isinstance(module, ConvBlock | PlaneConvolution | HiddenLayer) and not inside:
            module.compile(dynamic=True)
            compiled.add(module)
