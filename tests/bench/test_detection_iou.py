"""benchmarks/detection_iou.py: the overlap of two masks."""

import detection_iou
import numpy as np
import pytest


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
