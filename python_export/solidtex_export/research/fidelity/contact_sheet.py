"""Contact sheet of a comparison: photograph, axis slice and oblique slice of every method."""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image, ImageDraw

from solidtex_export.research.fidelity.cell import Cell
from solidtex_export.whole_file import write_whole

SIDE = 128  # pixels of an image
GAP = 4
LABEL = 14  # pixels: height of a line of text
VIEWS = ("x", "oblique")


def write_contact_sheet(path: Path, rows: list[list[Cell]]) -> bool:
    """Write a PNG with a row for each exemplar of which a cell is finished; false without one."""
    shown = [row for row in rows if any(cell.finished for cell in row)]
    if not shown:
        return False
    columns = 1 + len(VIEWS) * len(shown[0])
    size = columns * (SIDE + GAP) - GAP, len(shown) * (SIDE + LABEL + GAP) - GAP
    sheet = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(sheet)
    for index, row in enumerate(shown):
        top = index * (SIDE + LABEL + GAP)
        draw.text((0, top), row[0].entry.name, fill="black")
        finished = next(cell for cell in row if cell.finished)
        _paste(sheet, finished.folder / "pictures" / "exemplar-0.png", 0, top)
        for place, cell in enumerate(row):
            column = 1 + len(VIEWS) * place
            draw.text((column * (SIDE + GAP), top), cell.method, fill="black")
            if cell.finished:
                for offset, view in enumerate(VIEWS):
                    file = cell.folder / "pictures" / f"slice-{view}.png"
                    _paste(sheet, file, column + offset, top)
    data = io.BytesIO()
    sheet.save(data, "PNG")
    write_whole(path, data.getvalue())
    return True


def _paste(sheet: Image.Image, file: Path, column: int, top: int) -> None:
    picture = Image.open(file).convert("RGB").crop((0, 0, SIDE, SIDE))
    sheet.paste(picture, (column * (SIDE + GAP), top + LABEL))
