"""How much slower a machine is than the one that plans are for: measured once, and kept."""

import json

import pytest
from test_plan import SINGLE, SWEEP, plan

from scattering import machine
from scattering.machine import REFERENCE, Slowness
from scattering.needs import closed
from scattering.plan import planned
from scattering.solver import build


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
    assert machine.slowness() == machine.slowness() == pytest.approx(Slowness(products=2, passes=3))
    assert len(measured) == 1
    monkeypatch.setattr(machine, "CPUINFO", tmp_path / "cpuinfo")
    machine.CPUINFO.write_text("processor\t: 0\nmodel name\t: Z80\n")
    machine.slowness()
    assert len(measured) == 2
    assert len(json.loads((tmp_path / "isarflow/machine.json").read_text())) == 2


@pytest.mark.parametrize("text", ["", "{", "[]", '"x"'])
def test_what_is_kept_and_cannot_be_read_is_measured_again(measured, tmp_path, text):
    path = tmp_path / "isarflow/machine.json"
    path.parent.mkdir()
    path.write_text(text)
    assert machine.slowness() == machine.slowness() == pytest.approx(Slowness(2, 3))
    assert len(measured) == 1


def test_a_folder_that_cannot_be_written_to_is_no_obstacle(measured, tmp_path):
    (tmp_path / "isarflow").touch()
    assert machine.slowness() == pytest.approx(Slowness(2, 3))


def test_a_plan_is_for_the_machine_at_hand(monkeypatch):
    size = closed(20_000, [1.0, 0.0, 0.3])
    how = {"formulation": "efie", "precision": "single", "tolerance": 1e-5}
    megabytes, seconds = planned(size, 0, SWEEP, **how)
    slower = [planned(size, 0, SWEEP, **how, slowness=of) for of in (Slowness(3, 1), Slowness(1, 3), Slowness(3, 3))]
    assert {of[0] for of in slower} == {megabytes}
    assert slower[0][1] + slower[1][1] == pytest.approx(4 * seconds)
    assert slower[2][1] == pytest.approx(3 * seconds)
    monkeypatch.setattr("scattering.solvers.mom.slowness", lambda: Slowness(3, 3))
    assert build(SINGLE).plan(size, 0, SWEEP)[1] == pytest.approx(3 * plan(20_000, 0, tolerance=1e-5)[1])


def test_the_benchmark_is_of_work(monkeypatch):
    monkeypatch.setattr(machine, "REPEATS", 1)
    product, of_pass = machine.benchmark()
    # Between a hundredth and a hundred times the reference machine's.
    assert all(0.01 * there < here < 100 * there for here, there in zip((product, of_pass), REFERENCE, strict=False))
