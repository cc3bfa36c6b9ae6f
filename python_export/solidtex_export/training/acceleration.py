"""torch.compile for the repeated parts of a generator, and bfloat16."""

from __future__ import annotations

import torch
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


def fast_autocast(device: torch.device) -> torch.autocast:
    """bfloat16 where the processor supports it, for speed."""
    if device.type == "cuda":
        fast = torch.cuda.is_bf16_supported()
    else:
        fast = getattr(torch.cpu, "_is_avx512_bf16_supported", lambda: False)()
    return torch.autocast(device.type, torch.bfloat16, enabled=fast)
