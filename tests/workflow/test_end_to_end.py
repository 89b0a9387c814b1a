"""One true run of config/smoke.yaml, from CAD to the report."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

SMOKE = ("--configfile", "config/smoke.yaml")
RESULTS = "results/smoke"


@pytest.fixture
def results(smoke):
    return smoke.folder / RESULTS


def test_every_artefact_of_the_contract_is_there(results):
    targets, runs = ("drone", "missile", "ufo"), [f"multi_elevation/{model}" for model in ("lr", "knn")]
    expected = [
        *(f"mesh/{t}.json" for t in targets),
        *(f"mesh/{t}-{band}.ply" for t in targets for band in (0, 1)),
        *(f"scattering/{t}.zarr" for t in targets),
        *(f"imaging/{t}/clean.zarr" for t in targets),
        *(f"imaging/{t}/snr_{snr}dB.zarr" for t in targets[:2] for snr in (0, 20)),
        *(f"learning/models/{run}/config.json" for run in runs),
        *(f"learning/predictions/{run}/snr_{snr}dB.csv" for run in runs for snr in (0, 20)),
        "learning/scores.csv",
        "report/index.html",
        "report/figures",
        "report/tables",
    ]
    assert [path for path in expected if not (results / path).exists()] == []


def test_fields_are_solved_and_smooth(results):
    for target in ("drone", "missile", "ufo"):
        store = xr.open_zarr(results / f"scattering/{target}.zarr")
        assert store.field.dims == ("polarization", "frequency", "elevation", "azimuth")
        assert store.field.dtype == np.complex64
        assert np.allclose(store.frequency, np.linspace(0.7e9, 1.1e9, 5))
        assert max(store.attrs["residual"]) < 1e-3
        for coordinate in store.coords.values():
            assert {"units", "long_name"} <= set(coordinate.attrs)
        # The targets are mirror-symmetric about xz: azimuths a and -a see the same.
        field = store.field.values
        mirrored = np.roll(field[..., ::-1], 1, axis=-1)
        assert np.abs(field - mirrored).max() < 1e-4 * np.abs(field).max()
        area = json.loads((results / f"mesh/{target}.json").read_text())["bands"][0]["area"]["after"]
        # No target this small scatters more than a flat plate of its whole area would.
        assert np.abs(field).max() < area / (299_792_458.0 / 1.1e9)


def test_missile_from_the_side_scatters_like_a_cylinder(results):
    field = np.abs(xr.open_zarr(results / "scattering/missile.zarr").field.sel(elevation=0, polarization="VV"))
    side = field.isel(frequency=-1)
    assert side.azimuth[int(side.values.argmax())] in (90, 270)
    # Broadside of a cylinder of radius a and length L: RCS = k a L^2 (Knott, Radar Cross Section, ch. 6).
    cylinder = np.sqrt(2 * np.pi * 1.1e9 / 299_792_458.0 * 0.045 / (4 * np.pi)) * 1.0
    assert abs(20 * np.log10(float(side.max()) / cylinder)) < 3


def test_models_learn(results):
    scores = pd.read_csv(results / "learning/scores.csv")
    accuracy = scores[(scores.metric == "accuracy") & (scores.test_snr_db == 20)]
    assert len(accuracy) == 2
    assert (accuracy.value > 0.8).all()
    assert ((scores.low <= scores.value + 1e-12) & (scores.value <= scores.high + 1e-12)).all()


def test_second_run_has_nothing_to_do(smoke):
    assert smoke.planned("report", *SMOKE) == {}


def test_artefact_that_no_rule_makes_is_refused(smoke):
    finished = smoke.run("--cores", 1, f"{RESULTS}/scattering/dron.zarr", *SMOKE)
    assert finished.returncode != 0
    assert "dron.zarr" in finished.stdout
    assert "Traceback" not in finished.stdout


def test_all_makes_every_store(smoke):
    assert smoke.planned("all", *SMOKE) == {"noise": 2}  # the unknown target's, which no experiment tests yet
