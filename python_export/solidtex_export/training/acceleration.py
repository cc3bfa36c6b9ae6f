"""torch.compile for the repeated parts of a generator."""

from __future__ import annotations

from torch import nn

from solidtex_export.generators.lattice import ConvBlock
from solidtex_export.generators.planes import PlaneConvolution
from solidtex_export.generators.sampler import HiddenLayer


def compile_generator(generator: nn.Module) -> None:
    """Compile blocks in place, for any shape; keys of the state dict stay.

    The whole network is not compiled: its boxes depend on the slice's offset, and each would be
    compiled anew. Critics are not compiled: WGAN-GP differentiates twice, which torch.compile does
    not support.
    """
    compiled: set[nn.Module] = set()
    for module in generator.modules():
        inside = any(module in outer.modules() for outer in compiled)
        if isinstance(module, ConvBlock | PlaneConvolution | HiddenLayer) and not inside:
            module.compile(dynamic=True)
            compiled.add(module)
