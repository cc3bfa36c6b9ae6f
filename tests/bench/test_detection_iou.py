"""benchmarks/detection_iou.py and composed_photograph.py: overlaps, and known borders."""

import sys
from pathlib import Path

import composed_photograph
import detection_iou
import numpy as np
import pytest
from PIL import Image


def square(left: int) -> np.ndarray:
    mask = np.zeros((8, 8), bool)
    mask[2:6, left : left + 4] = True
    return mask


@pytest.mark.parametrize(("left", "expected"), [(0, 1), (1, 12 / 20), (2, 8 / 24), (4, 0)])
def test_iou_is_the_overlap_by_the_union(left: int, expected: float) -> None:
    assert detection_iou.iou(square(left), square(0)) == pytest.approx(expected)
    assert detection_iou.iou(square(0), square(left)) == pytest.approx(expected)


def test_iou_of_a_part_is_its_share() -> None:
    assert detection_iou.iou(square(0) & (np.indices((8, 8))[0] < 4), square(0)) == 0.5


def test_photographs_become_cells_row_by_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    photos = [tmp_path / f"{gray}.png" for gray in (10, 60, 110, 160)]
    for photo in photos:
        Image.new("RGB", (24, 16), (int(photo.stem),) * 3).save(photo)
    path = tmp_path / "composed.png"
    arguments = [*map(str, photos), "--cell", "8", "-o", str(path)]
    monkeypatch.setattr(sys, "argv", ["composed_photograph.py", *arguments])
    composed_photograph.main()
    pixels = np.asarray(Image.open(path))[:, :, 0]
    assert np.array_equal(pixels, np.kron([[10, 60], [110, 160]], np.ones((8, 8))))
    sys.argv.remove(str(photos[0]))
    with pytest.raises(SystemExit):
        composed_photograph.main()
