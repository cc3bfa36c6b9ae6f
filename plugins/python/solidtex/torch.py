"""PyTorch: gradients through points of a texture, and the model as a module."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import torch

from solidtex.errors import InvalidArgument

if TYPE_CHECKING:
    from solidtex.texture import Texture


class EvalPoints(torch.autograd.Function):
    """Values of a texture at points. Their gradients are those of the exact jacobians."""

    @staticmethod
    def forward(ctx: Any, points: torch.Tensor, texture: Texture, query: dict[str, Any]) -> Any:
        values, jacobians = texture.eval_jacobian(points.detach().cpu(), **query)
        ctx.save_for_backward(points, torch.from_numpy(jacobians).to(points))
        return torch.from_numpy(values).to(points)

    @staticmethod
    def backward(ctx: Any, gradient: torch.Tensor) -> Any:
        return _Gradient.apply(gradient, *ctx.saved_tensors), None, None


class _Gradient(torch.autograd.Function):
    """Gradient of a loss at points. Takes the points so that its own derivative is refused, also
    where the gradient of the values is constant.
    """

    @staticmethod
    def forward(
        ctx: Any, gradient: torch.Tensor, points: torch.Tensor, jacobians: torch.Tensor
    ) -> torch.Tensor:
        return torch.einsum("...c,...cd->...d", gradient, jacobians)

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> Any:
        raise InvalidArgument(
            "eval_points: found a second derivative, expected first ones only: jacobians have no"
            " derivatives; take differences of eval_jacobian"
        )


def module_of(texture: Texture) -> torch.nn.Module:
    """Return the weights of a texture's file as a module."""
    try:
        model_file = import_module("solidtex_export.export.file_format.model_file")
        module = import_module("solidtex_export.export.torch_module")
    except ImportError as error:
        raise ImportError(
            f"to_torch: needs the package solidtex-export ({error}): pip install ./python_export"
        ) from error
    if not texture.path:
        raise InvalidArgument("to_torch: found a texture without a file, expected one of a path")
    if texture.period:
        raise InvalidArgument(
            f"to_torch: found the period {texture.period}, expected none: noise does not repeat"
        )
    made: torch.nn.Module = module.SolidTexture(model_file.read(texture.path), texture.seed)
    return made
