"""How much slower a machine is than the one that plans are for: measured once, and kept."""

import json

import pytest

from isarflow.scattering import machine, needs
from isarflow.scattering.machine import REFERENCE
from isarflow.setup.config import load


@pytest.fixture
def measured(monkeypatch, tmp_path):
    """The benchmarks that were run, on a machine that takes twice and three times as long; none is kept yet."""
    runs = []
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(machine, "slowness", machine.slowness.__wrapped__)
    monkeypatch.setattr(
        machine, "benchmark", lambda: runs.append(1) or tuple(f * s for f, s in zip((2, 3), REFERENCE, strict=False))
    )
    return runs


def test_a_processor_is_measured_once(measured, tmp_path, monkeypatch):
    assert machine.slowness() == machine.slowness() == pytest.approx(2.5)
    assert len(measured) == 1
    monkeypatch.setattr(machine, "CPUINFO", tmp_path / "cpuinfo")
    machine.CPUINFO.write_text("processor\t: 0\nmodel name\t: Z80\n")
    machine.slowness()
    assert len(measured) == 2
    assert len(json.loads((tmp_path / "isarflow/machine.json").read_text())) == 2


@pytest.mark.parametrize("text", ["", "{", "[]", '"x"', '{"KEY": [1, 2]}', '{"KEY": null}'])
def test_what_is_kept_and_cannot_be_read_is_measured_again(measured, tmp_path, text):
    path = tmp_path / "isarflow/machine.json"
    path.parent.mkdir()
    machine.slowness()
    (key,) = json.loads(path.read_text())
    measured.clear()
    path.write_text(text.replace("KEY", key))
    assert machine.slowness() == machine.slowness() == pytest.approx(2.5)
    assert len(measured) == 1


def test_a_folder_that_cannot_be_written_to_is_no_obstacle(measured, tmp_path):
    (tmp_path / "isarflow").touch()
    assert machine.slowness() == pytest.approx(2.5)


def test_what_is_expected_is_for_the_machine_at_hand(monkeypatch):
    config, size = load(), {"area": 0.5, "box": [1.0, 0.8, 0.2]}
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
    assert all(0.01 * there < here < 100 * there for here, there in zip((product, of_pass), REFERENCE, strict=False))
