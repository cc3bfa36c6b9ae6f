"""Fields of settings with their limits."""

from __future__ import annotations

import dataclasses
from dataclasses import field
from typing import Any


def choice(*values: str, default: str | None = None) -> Any:
    """A string field with few possible values."""
    metadata = {"choices": values}
    return (
        field(metadata=metadata) if default is None else field(default=default, metadata=metadata)
    )


def number(low: float, high: float, default: Any = dataclasses.MISSING) -> Any:
    """A number, or an array of them, within bounds."""
    return field(default=default, metadata={"range": (low, high)})
