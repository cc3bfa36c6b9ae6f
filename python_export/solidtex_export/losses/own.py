"""Losses and discriminators of the user's own, by "module:name".

A loss is a function of two batches [batch, channel, side, side] on the device of the training:
slices of the solid, and crops of the photograph. It returns a number to minimize, differentiable
with respect to the slices. Values are whitened: mean 0 and covariance 1 over the photographs.

A discriminator is a torch.nn.Module that is constructed with the number of channels;
`Discriminator` in discriminators/critic.py is its interface. The table [critic] has the settings of
its training.
"""

from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from torch import Tensor, nn

from solidtex_export.settings import SettingsError, expected, show

METHODS = ("features", "score", "loss")
"""Methods of a discriminator."""


def is_own(kind: str) -> bool:
    return ":" in kind


def load(kind: str) -> Callable[..., Any]:
    """The function or class of "module:name". Modules of the current folder are found, too."""
    module, _, name = kind.partition(":")
    folder = str(Path.cwd())
    if folder not in sys.path:
        sys.path.append(folder)
    try:
        found = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        what = f"a module and a function in it, in the current folder or PYTHONPATH ({error})"
        raise expected(what) from error
    if not callable(found):
        raise expected(f"a function or class, not {type(found).__name__}")
    if inspect.isclass(found):
        _check_discriminator(found)
    return found  # type: ignore[no-any-return]


def _check_discriminator(found: type) -> None:
    if not issubclass(found, nn.Module):
        raise expected("a function, or a class derived from torch.nn.Module")
    if missing := [name for name in METHODS if not callable(getattr(found, name, None))]:
        raise expected(f"a class with the methods {', '.join(METHODS)}; {missing[0]} is missing")


def loss(name: str, kind: str, slices: Tensor, crops: Tensor) -> Tensor:
    """The value of the loss `name`, which is the function `kind`."""
    found = load(kind)(slices, crops)
    if not isinstance(found, Tensor):
        what = f"{type(found).__name__} {found!r:.80}"
    elif found.numel() != 1:
        what = f"a tensor of shape {list(found.shape)}"
    elif not found.requires_grad:
        what = "a tensor without a gradient"
    else:
        return found.reshape(())
    raise SettingsError(
        f"losses.{name}.kind: found {show(kind)}, which returned {what}, expected a tensor of one"
        " number that is computed from the slices, its first argument"
    )


def is_discriminator(kind: str) -> bool:
    return is_own(kind) and inspect.isclass(load(kind))
