"""A device that is none: its tensors are those of the CPU, and say that they live elsewhere.

What mixes them with tensors of the CPU fails as it would on a GPU, so that a machine without one
finds a tensor that was made or left in the wrong place. The device has the name of torch's "lazy"
one, since autograd takes that for another device and yet asks nothing of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any
from unittest.mock import patch

import torch
from torch import Tensor
from torch.utils._python_dispatch import TorchDispatchMode, return_and_correct_aliasing
from torch.utils._pytree import tree_leaves, tree_map_only

DEVICE = torch.device("lazy:0")
CPU = torch.device("cpu")
CROSSINGS = {torch.ops.aten._to_copy.default, torch.ops.aten.copy_.default}


class PretendTensor(Tensor):
    """On `DEVICE`, with the values of `inner`, a tensor of the CPU."""

    inner: Tensor

    @staticmethod
    def __new__(cls, inner: Tensor) -> PretendTensor:
        made = torch.Tensor._make_wrapper_subclass(
            cls,
            inner.shape,
            strides=inner.stride(),
            storage_offset=inner.storage_offset(),
            dtype=inner.dtype,
            device=DEVICE,
            requires_grad=inner.requires_grad,
        )
        made.inner = inner
        return made

    def __reduce_ex__(self, protocol: Any) -> Any:
        """As what torch.load makes of a GPU's tensor with map_location="cpu"."""
        return self.inner.__reduce_ex__(protocol)

    @classmethod
    def __torch_dispatch__(
        cls, operator: Any, types: Any, args: Any = (), kwargs: dict[str, Any] | None = None
    ) -> Any:
        return computed(operator, args, kwargs or {})


class PretendMode(TorchDispatchMode):
    """Makes tensors on `DEVICE`, where they are asked for."""

    def __torch_dispatch__(
        self, operator: Any, types: Any, args: Any = (), kwargs: dict[str, Any] | None = None
    ) -> Any:
        return computed(operator, args, kwargs or {})


@contextmanager
def pretend_device() -> Iterator[torch.device]:
    """Within it, that device may be used like any other; autocast does nothing there."""
    torch._C._set_only_lift_cpu_tensors(True)  # torch.tensor(values, device=...) asks the mode, too
    try:
        with patch.object(torch, "autocast", lambda *_, **__: nullcontext()), PretendMode():
            yield DEVICE
    finally:
        torch._C._set_only_lift_cpu_tensors(False)


def computed(operator: Callable[..., Any], args: Any, kwargs: dict[str, Any]) -> Any:
    """What the operator gives on the CPU, on the device where it should be."""
    tensors = [leaf for leaf in tree_leaves((args, kwargs)) if isinstance(leaf, Tensor)]
    pretend = any(isinstance(t, PretendTensor) for t in tensors)
    # one number of the CPU is welcome on any device
    on_cpu = any(t.ndim > 0 for t in tensors if not isinstance(t, PretendTensor))
    if pretend and on_cpu and operator not in CROSSINGS:
        raise RuntimeError(f"{operator}: found tensors on {DEVICE} and on {CPU}, expected one")
    device = kwargs.get("device")
    wanted = pretend if device is None else torch.device(device).type == DEVICE.type
    inner_args, inner_kwargs = tree_map_only(PretendTensor, lambda t: t.inner, (args, kwargs))
    if device is not None:
        inner_kwargs = {**inner_kwargs, "device": CPU}
    result = operator(*inner_args, **inner_kwargs)
    if operator is torch.ops.aten.copy_.default:
        wanted = isinstance(args[0], PretendTensor)
    if wanted:
        result = tree_map_only(Tensor, PretendTensor, result)
    return return_and_correct_aliasing(operator, args, kwargs, result) if pretend else result
