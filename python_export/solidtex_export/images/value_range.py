"""Range of an image's values, and the scaling of its pixels to 0 ... 1.

By default pixels are scaled by the full range of their type. Where that would give a useless image,
reading warns and names the option, or refuses.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solidtex_export.images.file_kinds import ExemplarError, refuse
from solidtex_export.images.photographs import Picture

Range = str | tuple[float, float]
"""Value of --range: "full", "auto", "labels", or the values of black and white."""

KINDS = ("full", "auto", "labels")
FEW = 8  # distinct values: more are tones, not labels
MOST_LABELS = 64
DARK = 1 / 4  # of the full range: an image that stays below is probably stored with fewer bits
NEARLY_BLACK = 1 / 16  # of the full range: 12 bits in 16
BLACK = 1.01 / 256  # of the full range: less than one step of an image of 8 bits
OVERSHOOT = 0.05  # below 0, as resampling leaves it
FLOAT_WHITES = (1.0, 255.0, 65535.0)
SCENE_LINEAR = ("openexr", "hdr")  # formats whose values are linear by convention, at any scale


def parse_range(text: str) -> Range:
    """Parse LOW,HIGH or a word."""
    if text in KINDS:
        return text
    number = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
    if re.fullmatch(f"{number},{number}", text):
        low, high = (float(v) for v in text.split(","))
        if low < high < np.inf:
            return low, high
    raise ExemplarError(f"found {text}, expected LOW,HIGH (such as 0,4095) or {', '.join(KINDS)}")


@dataclass(frozen=True)
class Scaled:
    """Channels in 0 ... 1; `notes` say what was done or is unusual."""

    values: np.ndarray
    is_linear: bool
    notes: list[str]


class FoundRange:
    """Values that occur in some channels of an image, in the units of the file."""

    def __init__(self, picture: Picture, pixels: np.ndarray) -> None:
        self.picture, self.pixels = picture, pixels
        self.low, self.high = float(pixels.min()), float(pixels.max())

    @cached_property
    def labels(self) -> np.ndarray | None:
        """The distinct values in order; None for color, or if there are too many for labels."""
        if np.any(self.pixels != self.pixels[:, :, :1]):
            return None
        values = np.unique(self.pixels[:, :, 0])
        return values if len(values) <= MOST_LABELS else None

    @property
    def color_count(self) -> int:
        """How many distinct colors there are, at most FEW + 1."""
        rest = self.pixels.reshape(-1, self.pixels.shape[2])
        count = 0
        while len(rest) and count <= FEW:
            rest = rest[(rest != rest[0]).any(axis=1)]
            count += 1
        return count

    @property
    def are_few(self) -> bool:
        return self.labels is not None and 2 <= len(self.labels) <= FEW

    @property
    def are_whole(self) -> bool:
        return not self.picture.is_float or bool((self.pixels == np.rint(self.pixels)).all())

    @property
    def is_constant(self) -> bool:
        return not np.ptp(self.pixels, axis=(0, 1)).any()

    @property
    def bits(self) -> int:
        """Number of bits that integers from 0 to the highest one need."""
        return max(1, int(self.high).bit_length())

    def auto(self) -> tuple[float, float]:
        """Black and white by rule: integers by bit count, floats by common white values."""
        if self.low < 0:
            return self.low, self.high
        if self.are_whole and self.high > 1:
            is_power = int(self.high).bit_count() == 1  # 0 ... 32768, say
            return 0.0, self.high if is_power else 2.0**self.bits - 1
        return 0.0, next((white for white in FLOAT_WHITES if self.high <= white), self.high)

    def __str__(self) -> str:
        return f"values {number(self.low)} ... {number(self.high)}"


def number(value: float) -> str:
    return f"{value:.0f}" if value == round(value) and abs(value) < 1e15 else f"{value:.4g}"


def scaled(
    picture: Picture,
    names: Sequence[str],
    asked: Range | None,
    option: str,
    is_map: bool = False,
) -> Scaled:
    """The channels `names` scaled to 0 ... 1 as `asked`; `option` is the command-line option for
    messages.

    Float maps have any unit, and a map may be constant.
    """
    indices = [picture.names.index(name) for name in names]
    found = FoundRange(picture, picture.pixels[:, :, indices])
    if asked is None or asked == "full":
        notes = [] if asked else _warnings(found, option, is_map)
        return Scaled(picture.values[:, :, indices], picture.is_float, notes)
    if asked == "labels":
        return _labels_as_tones(found)
    low, high = found.auto() if isinstance(asked, str) else asked
    if low >= high:
        raise refuse(picture.path, f"{found}", "different values; a constant has no range")
    values = (found.pixels.astype(np.float64) - low) / (high - low)
    outside = float(((values < 0) | (values > 1)).mean())
    values = np.clip(values, 0, 1)
    if picture.white_is_zero:
        values = 1 - values
    is_linear = picture.is_float and picture.format in SCENE_LINEAR
    note = f"scales {number(low)} ... {number(high)} to 0 ... 1 (found {found})"
    if picture.is_float and not is_linear:
        note += ", taken as sRGB"
    if outside:
        note += f"; {100 * outside:.2g} % lie outside and are clipped"
    return Scaled(values.astype(np.float32), is_linear, [note])


def _labels_as_tones(found: FoundRange) -> Scaled:
    labels = found.labels
    if labels is None or len(labels) < 2:
        what = "color or too many values" if labels is None else "one value everywhere"
        raise refuse(
            found.picture.path, f"{what}", f"labels: 2 to {MOST_LABELS} values of one channel"
        )
    values = np.searchsorted(labels, found.pixels).astype(np.float32) / np.float32(len(labels) - 1)
    if found.picture.white_is_zero:
        values = 1 - values
    note = f"learns the {_listed(labels)} as evenly spaced grays, not as phases with sharp borders"
    return Scaled(values, False, [note])


def _listed(labels: np.ndarray) -> str:
    texts = [number(float(v)) for v in labels[:FEW]]
    more = ", ..." if len(labels) > FEW else ""
    return f"{len(labels)} labels {', '.join(texts)}{more}"


def _warnings(found: FoundRange, option: str, is_map: bool) -> list[str]:
    """Notes on unusual pixels that were scaled by default; refuses useless ones."""
    picture = found.picture
    if is_map and (picture.is_float or found.is_constant):
        return []
    if found.is_constant:
        raise refuse(picture.path, "the same color everywhere", "an image that shows structure")
    if found.are_few:
        return _labels_warnings(found, option)
    if (colors := found.color_count) <= FEW:
        return [
            f"warning: found only {colors} colors, learned as these colors; if they are labels of"
            f" phases, save the labels as gray values and use {option}labels"
        ]
    return (_floats_warnings if picture.is_float else _whole_warnings)(found, option)


def _labels_warnings(found: FoundRange, option: str) -> list[str]:
    labels, full = found.labels, found.picture.full
    assert labels is not None
    text = f"{_listed(labels)} of 0 ... {number(full)}"
    beyond = found.low < 0 or found.high > full
    if beyond or (not found.picture.is_float and found.high <= DARK * full):
        raise refuse(
            found.picture.path,
            f"{text}, not tones",
            f"tones; {option}labels learns them as evenly spaced grays, {option}full as they are,"
            " solidtex-train --phases as phases with sharp borders",
        )
    return [
        f"warning: found only the {text}, learned as these tones; if they are labels of phases,"
        f" use solidtex-train --phases; {option}labels spaces them evenly"
    ]


def _whole_warnings(found: FoundRange, option: str) -> list[str]:
    full = found.picture.full
    remedy = f"{option}LOW,HIGH or {option}auto ({_limits(found)})"
    of_full = f"{found} of 0 ... {number(full)}"
    if found.low < 0:
        raise refuse(
            found.picture.path, f"{found}, some below 0", f"0 ... {number(full)}; {remedy}"
        )
    if found.high <= BLACK * full:
        end = "white" if found.picture.white_is_zero else "black"
        raise refuse(found.picture.path, f"{of_full}, all {end}", f"tones; {remedy} scales them")
    fewer_bits = full > 255 and found.high in (2.0 ** (found.bits - 1), 2.0**found.bits - 1)
    is_dark = found.high <= 1.001 * DARK * full
    if found.high <= 1.001 * NEARLY_BLACK * full or (fewer_bits and is_dark):
        end = "white" if found.picture.white_is_zero else "black"
        raise refuse(
            found.picture.path,
            f"{of_full} ({found.bits} bits), nearly {end}",
            f"tones; {remedy} scales them, {option}full keeps them",
        )
    if is_dark or (fewer_bits and found.high < full):
        end = "bright" if found.picture.white_is_zero else "dark"
        return [
            f"warning: found {of_full} ({found.bits} bits), learned as they are: {end};"
            f" {remedy} scales them"
        ]
    return []


def _floats_warnings(found: FoundRange, option: str) -> list[str]:
    remedy = f"{option}auto ({_limits(found)}) or {option}LOW,HIGH scales them"
    low = float(np.quantile(found.pixels, 0.005))
    middle = float(np.median(found.pixels))
    is_code = found.high > 1 and found.are_whole
    if low < -OVERSHOOT or middle > 1 or is_code:
        raise refuse(
            found.picture.path,
            f"float {found}, median {number(middle)}",
            f"an albedo of 0 ... 1; {remedy}, {option}full keeps them",
        )
    if found.low < 0 or found.high > 1:
        return [f"found float {found}, some outside of 0 ... 1: kept as they are"]
    if found.high <= 1 / 16:
        return [f"warning: found float {found}, learned as they are: dark; {remedy}"]
    return []


def _limits(found: FoundRange) -> str:
    low, high = found.auto()
    return f"{number(low)},{number(high)}"
