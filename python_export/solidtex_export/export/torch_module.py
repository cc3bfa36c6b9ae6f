"""An exported model as a PyTorch module, for adapting it or building on it."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.places import check_box, check_seed
from solidtex_export.export.verification.reference import torch_box


class SolidTexture(nn.Module):
    """The weights of a model file, under their names in the file, and the solid that they make.

    Noise is that of the engine: a module in float64 has the engine's values but for rounding.
    """

    def __init__(self, model: ModelFile, seed: int = 0) -> None:
        super().__init__()
        self.document = model.document
        self.seed = check_seed(seed)
        for name, values in model.tensors.items():
            *folders, last = name.split(".")
            owner: nn.Module = self
            for folder in folders:
                if folder not in owner._modules:
                    owner.add_module(folder, nn.Module())
                owner = owner.get_submodule(folder)
            # The transforms of octaves decide where noise is looked up, which has no gradient.
            is_fixed = name == "transforms"
            owner.register_parameter(
                last, nn.Parameter(torch.from_numpy(values.copy()), requires_grad=not is_fixed)
            )

    def forward(self, origin: Sequence[int], size: Sequence[int]) -> Tensor:
        """The voxels [origin, origin + size) at their centers: [x, y, z, channel]."""
        lo, extent = check_box(origin, size)
        return torch_box(self.document, dict(self.named_parameters()), lo, extent, self.seed)
