"""The program that measures what hosts cost runs, and gives a rate for each."""

import measure_hosts
import pytest


def test_every_host_has_a_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure_hosts, "EDGE", 32)
    monkeypatch.setattr(measure_hosts, "FEW", 16)
    model = "granite-speckled"
    rows = [*measure_hosts.python_rates(model), *measure_hosts.mitsuba_rates(model)]
    names = [name for name, _ in rows]
    assert names[:3] == ["direct", "Python, 4096 a call", "Python, one a call"]
    assert len(names) in (3, 5) and all(rate > 0 for _, rate in rows)
