"""HTML report: one file with embedded images."""

from __future__ import annotations

import base64
import io
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup
from PIL import Image

from solidtex_export import __version__
from solidtex_export.evaluation.evaluate import Evaluation
from solidtex_export.evaluation.subjects import BLOCK

GOOD, FAIR = 1.5, 3.0  # relative distances up to which a cell is green, yellow
COPIED = 0.35  # coherence of an exemplar's halves above which they are called partly the same
CAPTIONS = {f"slice {axis}": f"normal to {axis}" for axis in "xyz"} | {"slice oblique": "oblique"}


def render(evaluation: Evaluation, exemplars: list[str]) -> str:
    """The report as HTML text; `exemplars` are the names of the photographs."""
    document, pictures = evaluation.document, evaluation.pictures

    def figure(name: str, caption: str, zoom: int = 1) -> Markup:
        return _figure(pictures[name], caption, zoom)

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("solidtex_export.evaluation", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.globals |= {"cell": _cell, "number": number, "figure": figure}
    first = next(iter(document["distances"].values()))
    own = {"self": document["directions"]["self"]}
    return environment.get_template("report.html.j2").render(
        d=document,
        version=__version__,
        names=list(pictures),
        captions=CAPTIONS,
        block=BLOCK,
        several=len(exemplars) > 1,
        exemplars=", ".join(exemplars),
        sides=", ".join(str(side) for side in first["crop_side"]),
        warnings=_warnings(document),
        repetitions=_rows(document["repetition"]),
        directions=_rows(own | document["directions"]["views"]),
    )


def _rows(values: dict[str, Any]) -> list[tuple[str, Any]]:
    """One row for each exemplar, then the others."""
    own = [("exemplar", value) for value in values["self"]]
    return own + [(name, value) for name, value in values.items() if name != "self"]


def _warnings(document: dict[str, Any]) -> list[str]:
    repeating = any(found and found["repeats"] for found in document["repetition"]["self"])
    copied = max(document["copying"]["self"]) > COPIED
    text = (
        "The exemplar repeats itself (see Copying and Repetition): its halves are partly the same,"
        " its self-distance is too small, and all relative distances are too large."
    )
    return [text] if repeating or copied else []


def number(value: float | None) -> str:
    """Three significant digits; None is a length beyond the measured range."""
    return "longer" if value is None else f"{value:.3g}"


def _cell(distance: dict[str, float | None]) -> Markup:
    multiple, value = distance["multiple"], number(distance["value"])
    if multiple is None:
        return Markup("<td>({})</td>").format(value)
    quality = "good" if multiple <= GOOD else "fair" if multiple <= FAIR else "bad"
    return Markup('<td class="{}">{} <span class="quiet">({})</span></td>').format(
        quality, f"{multiple:.2f}", value
    )


def _figure(picture: np.ndarray, caption: str, zoom: int) -> Markup:
    rows, columns = picture.shape[:2]
    return Markup(
        '<figure><img width="{}" height="{}" alt="{}" src="data:image/png;base64,{}">'
        "<figcaption>{}</figcaption></figure>"
    ).format(columns * zoom, rows * zoom, caption, base64.b64encode(png(picture)).decode(), caption)


def png(picture: np.ndarray) -> bytes:
    """An image [row, column, channel] as an 8-bit PNG; the first channel where it has not three."""
    pixels = np.rint(np.clip(picture, 0, 1) * 255).astype(np.uint8)
    if pixels.shape[2] != 3:
        pixels = pixels[..., :1].repeat(3, axis=2)
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "PNG", optimize=True)
    return data.getvalue()
