"""Reads state dicts of PyTorch models without executing anything in the file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from pickle import UnpicklingError
from typing import Any

import safetensors.torch
import torch


def reason(error: Exception) -> str:
    """Why torch did not load a file, in one line and without its advice to load it unsafely."""
    if isinstance(error, UnpicklingError):
        return "it is damaged, or holds more than tensors, which could run code"
    return (str(error) or type(error).__name__).splitlines()[0]


def read_state(path: Path, expected: str, error: type[ValueError]) -> dict[str, Any]:
    """State dict in a PyTorch or safetensors file; raises `error` for any other file."""
    if not path.is_file():
        raise error(f"{path}: found no such file, expected {expected}")
    try:
        if path.suffix == ".safetensors":
            return safetensors.torch.load_file(path)
        state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as cause:  # torch raises many kinds for a damaged or unsafe file
        raise error(f"{path}: found no state dict that loads safely ({reason(cause)})") from cause
    if not isinstance(state, Mapping):
        raise error(f"{path}: found {type(state).__name__}, expected a state dict")
    return dict(state)
