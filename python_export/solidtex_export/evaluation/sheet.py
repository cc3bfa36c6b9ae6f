"""The sheet: exemplars beside a slice of each view, as the preview of a training shows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from solidtex_export.evaluation.subjects import Subject
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.images.sheet import sheet_of


def sheet(subject: Subject, exemplars: Sequence[Exemplar], side: int) -> np.ndarray:
    """Colours [row, column, 3]: exemplars and the first slice of each view, all cut to `side`.

    A row for the colour, and one below it for each further channel that both have.
    """
    shared = tuple(c for c in exemplars[0].channels if c in subject.channels)
    known = [exemplars[0].channels.index(c) for c in shared]
    places = [subject.channels.index(c) for c in shared]
    cut = [view.pictures[0][:side, :side, places] for view in subject.views]
    slices = [torch.from_numpy(np.moveaxis(picture, -1, 0).copy()) for picture in cut]
    shown = [replace(e, image=e.image[known], channels=shared) for e in exemplars]
    return sheet_of(slices, shown, side).movedim(0, 2).numpy()
