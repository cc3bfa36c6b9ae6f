"""The texture space that a short training starts from if the user names none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from solidtex_export.commands.cli import say
from solidtex_export.images.channels import RGB
from solidtex_export.images.photographs import read_picture
from solidtex_export.spaces.space_reader import SpaceError
from solidtex_export.spaces.start import SpaceStart, space_start
from solidtex_export.training.resolve import Request
from solidtex_export.training.result import ResultFolder

SPACE = Path("stones")
NO_SPACE = Path("none")  # --space none: random weights
SHORT_MINUTES = 1.0
"""Length of a training up to which this space is nearer to the photograph than random weights:
docs/experiments/spaces-curves.md.
"""


def default_start(request: Request, result: Path) -> SpaceStart | None:
    """The space, if it is there and fits the photograph, and the training is short.

    A training that has begun in the folder `result` keeps its start, however long it goes on.
    """
    begun = ResultFolder(result).begun
    if begun is None:
        wanted, reason = _is_short(request), f"--minutes at most {SHORT_MINUTES:g}"
    else:
        space = begun.get("space")
        wanted = isinstance(space, dict) and space.get("name") == SPACE.name
        reason = "as it began"
    if not (wanted and _is_plain(request)):
        return None
    if request.directions == "xy":
        say("in so short a time --space woods comes nearer to wood with vertical grain")
        return None
    try:
        start = space_start(SPACE)
    except SpaceError as error:
        say(f"starting from random weights, not from the space {SPACE}: {error}")
        return None
    return replace(start, reason=reason) if _fits(request, start.smallest) else None


def _is_short(request: Request) -> bool:
    return request.minutes is not None and request.minutes <= SHORT_MINUTES


def _is_plain(request: Request) -> bool:
    """Whether the user chose length and scale only."""
    plain = request.is_open and not any(request.maps)
    return plain and request.color_space == "srgb" and not request.features


def _fits(request: Request, patch: int) -> bool:
    """Whether the photograph has colors, or grays, and at least a patch of the space."""
    picture = read_picture(request.photos[0], request.reading.layer)
    side = min(request.crop[2:] if request.crop else picture.size)
    return picture.names in (RGB, ("Y",)) and min(side, request.resolution or side) >= patch
