"""How much slower a machine is than the one that plans are for."""

import pytest

from isarflow.scattering import machine, needs
from isarflow.scattering.machine import REFERENCE_SECONDS
from isarflow.setup.config import load_config


def test_a_machine_is_measured_once(monkeypatch):
    runs = []
    monkeypatch.setattr(
        machine, "benchmark", lambda: runs.append(1) or (2 * REFERENCE_SECONDS[0], 3 * REFERENCE_SECONDS[1])
    )
    machine.slowness.cache_clear()
    assert machine.slowness() == machine.slowness() == pytest.approx(2.5)
    assert len(runs) == 1
    machine.slowness.cache_clear()


def test_what_is_expected_is_for_the_machine_at_hand(monkeypatch):
    config, size = load_config(), {"area": 0.5, "box": [1.0, 0.8, 0.2]}
    expected = {}
    for times in (1, 3):
        monkeypatch.setattr(needs, "slowness", lambda times=times: times)
        expected[times] = needs.expected(config, "drone", size)
    for slow, fast in zip(expected[3], expected[1], strict=True):
        assert slow == {**fast, "seconds": pytest.approx(3 * fast["seconds"])}


def test_the_benchmark_is_of_work(monkeypatch):
    monkeypatch.setattr(machine, "REPEATS", 1)
    product, of_pass = machine.benchmark()
    # Between a hundredth and a hundred times the reference machine's.
    assert all(
        0.01 * there < here < 100 * there for here, there in zip((product, of_pass), REFERENCE_SECONDS, strict=False)
    )
