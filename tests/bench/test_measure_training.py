"""The measurements of trainings run and say what they measured. No times are judged."""

from typing import Any

import measure_training


def test_a_row_for_each_method_and_size(capsys: Any) -> None:
    arguments = ["--method", "lattice", "sampler", "--size", "32", "40", "--steps", "2"]
    assert measure_training.main(arguments) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split()[:2] == ["method", "size"]
    found = [row.split() for row in rows]
    expected = [(m, s) for m in ("lattice", "sampler") for s in ("32", "40")]
    assert [tuple(row[:2]) for row in found] == expected
    for row in found:
        start, peak, seconds = map(float, row[2:])
        assert 0 < start <= peak
        assert seconds > 0
