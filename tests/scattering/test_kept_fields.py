"""The fields of families are kept one by one, at half of their azimuths, from which the reader makes the whole."""

import importlib
import json
import sys

import numpy as np
import pytest

from isarflow.core.store import open_store
from isarflow.core.sweep import sweeps
from isarflow.mesh.families import stated_values
from isarflow.scattering.fields.external import write_external
from isarflow.scattering.fields.store import write_field
from isarflow.setup.config import ROOT, load_config
from isarflow.setup.yaml_file import read_yaml

CONFIG = {
    "name": "few",
    "targets": {"*": None, "box": {"family": {"kind": "box", "count": 2, "seed": 1}, "role": "other"}},
    "radar": {"frequencies": 2},
    "mesh": {"bands": 1},
    "imaging": {"aperture": 3},
    "aspect": {"elevation": [0, 10], "azimuth": {"count": 9}},
    "learning": {"experiments": {"*": None}},
}


@pytest.fixture
def script(monkeypatch, tmp_path):
    """resources/fields/make_families.py, which keeps in the test's own folder."""
    monkeypatch.syspath_prepend(ROOT / "resources/fields")
    made = importlib.import_module("make_families")
    monkeypatch.setattr(made, "HERE", tmp_path)
    yield made
    for name in ("make_families", "make", "check"):
        del sys.modules[name]


def solved(results, config, name, odd=0.0):
    """Made-up results of a finished solve; returns its field. odd: what is not symmetric in VV."""
    (sweep,) = sweeps(config["radar"], config["aspect"], 1)
    azimuth = np.radians(sweep.azimuth)
    ways = np.stack([2 + np.cos(azimuth) + odd * np.sin(azimuth), 1 + np.cos(azimuth) ** 2, np.sin(azimuth)])
    field = (ways[:, None, None] * np.ones((3, 2, 2, 9)) * (1 + 1j)).astype(np.complex64)
    attrs = {"unknowns": [10, 12], "residual": [1e-5, 2e-5]}
    axes = sweep.polarizations, sweep.frequency, sweep.elevation, sweep.azimuth
    family = config["targets"][name]["family"]
    for folder in ("mesh", "benchmarks/mesh", "benchmarks/scattering/bands", "logs/scattering/bands"):
        (results / folder).mkdir(parents=True, exist_ok=True)
    write_field(results / "scattering" / f"{name}.zarr", field, *axes, attrs)
    mesh = {"family": family, "parameters": stated_values(family), "source": {"box": [0.3, 0.2, 0.1]}}
    (results / "mesh" / f"{name}.json").write_text(json.dumps(mesh))
    (results / "mesh" / f"{name}-0.ply").write_text("made up")
    for job, seconds in ((f"mesh/{name}", 3.5), (f"scattering/bands/{name}-0", 20.25)):
        (results / "benchmarks" / f"{job}.tsv").write_text(f"s\tcpu_time\n1.0\t{seconds}\n")
    (results / "logs/scattering/bands" / f"{name}-0.log").write_text("on a fine GPU, with 2 threads\n")
    return field


def test_a_finished_field_is_kept_and_read_whole(script, tmp_path, capsys, monkeypatch):
    config, results = load_config(CONFIG), tmp_path / "results"
    field = solved(results, config, "box_02")
    script.keep(config, results)
    assert "kept box_02: residual at most 2.0e-05, 20 s of processors" in capsys.readouterr().out
    store = open_store(tmp_path / CONFIG["name"] / "box_02.zarr").load()
    assert store.field.shape == (3, 2, 2, 5) and store.azimuth.values.max() == 160
    attrs = store.attrs
    assert attrs["symmetry"] == ["xz", "yz"] and attrs["kind"] == "box" and attrs["role"] == "other"
    assert attrs["parameters"] == stated_values(config["targets"]["box_02"]["family"])
    assert attrs["processor"] == "a fine GPU"
    assert (attrs["processor_s"], attrs["mesh_processor_s"]) == (20.2, 3.5) and len(attrs["mesh_sha256"]) == 1
    whole = tmp_path / "whole.zarr"
    write_external(str(tmp_path / CONFIG["name"] / "box_02.zarr"), whole, config["radar"], config["aspect"], ["xz"])
    np.testing.assert_allclose(open_store(whole).field.values, field, atol=1e-6)
    capsys.readouterr()
    script.missing(config, results)
    assert capsys.readouterr().out.split() == [str(results / "scattering/box_01.zarr")]
    monkeypatch.setattr(script, "CONFIGS", tmp_path)
    (tmp_path / CONFIG["name"] / "README.md").write_text("<!-- models -->\n<!-- end of models -->\n")
    script.card(config, results)
    assert (
        "\n| box | other | 1 | 0.30 to 0.30 m | 12 to 12 | 2.0e-05 |"
        in (tmp_path / CONFIG["name"] / "README.md").read_text()
    )
    taken = read_yaml(tmp_path / f"{CONFIG['name']}-fields.yaml")["targets"].pop("box_02")
    assert taken.pop("field") == f"resources/fields/{CONFIG['name']}/box_02.zarr"
    assert taken == {"role": "other", "kind": "box", "symmetry": ["xz", "yz"]}


def test_other_parameters_are_another_model_and_an_odd_field_is_not_kept(script, tmp_path, capsys):
    config, results = load_config(CONFIG), tmp_path / "results"
    for name in ("box_01", "box_02"):
        solved(results, config, name, odd=0.01 if name == "box_02" else 0.0)
    with pytest.raises(SystemExit, match=r"^box_02: the field is 3\.7e-03 of itself from its mirror image"):
        script.keep(config, results)
    other = load_config(CONFIG, {"targets": {"box": {"family": {"seed": 2}}}})
    capsys.readouterr()
    for asked, names in ((config, ["box_02"]), (other, ["box_01", "box_02"])):
        script.missing(asked, results)
        assert capsys.readouterr().out.split() == [str(results / f"scattering/{name}.zarr") for name in names]
