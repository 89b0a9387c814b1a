"""One true run of config/smoke.yaml, from CAD to the report, and what reruns after an edit."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

SMOKE = ("--configfile", "config/smoke.yaml")
RESULTS = "results/smoke"


@pytest.fixture(scope="module")
def project(project_of):
    project = project_of("smoke")
    finished = project.run("--cores", 2, "report", *SMOKE)
    assert finished.returncode == 0, finished.stdout
    return project


@pytest.fixture
def results(project):
    return project.folder / RESULTS


@pytest.fixture
def restored(project):
    """The project, whose config files are put back after the test."""
    paths = [project.folder / "config" / name for name in ("smoke.yaml", "config.yaml")]
    texts = [path.read_text() for path in paths]
    yield project
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text)


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


def test_second_run_has_nothing_to_do(project):
    assert project.planned("report", *SMOKE) == {}


def test_added_snr_runs_only_its_own_jobs(restored):
    restored.edit("config/smoke.yaml", "snr_db: [0, 20]", "snr_db: [10, 0, 20]")
    # An SNR has images of the targets that are tested or shown, an evaluation for each of the two models.
    assert restored.planned("report", *SMOKE) == {"noise": 2, "predict": 2, "scores": 1, "report": 1}


def test_added_unknown_target_runs_only_its_own_chain(restored):
    restored.edit(
        "config/smoke.yaml",
        "  ufo:",
        "  aircraft: {mesh: resources/cad/aircraft.stl, role: unknown, symmetry: [xz]}\n  ufo:",
    )
    assert restored.planned("report", *SMOKE) == {"mesh": 1, "solve": 2, "scattering": 1, "image": 1, "report": 1}


def test_added_known_target_also_trains_anew(restored):
    restored.edit(
        "config/smoke.yaml",
        "  ufo:",
        "  aircraft: {mesh: resources/cad/aircraft.stl, role: known, symmetry: [xz]}\n  ufo:",
    )
    assert restored.planned("report", *SMOKE) == {
        "mesh": 1,
        "solve": 2,
        "scattering": 1,
        "image": 1,
        "noise": 2,
        "train": 2,
        "timing": 1,
        "predict": 2,
        "scores": 1,
        "report": 1,
    }


def test_comments_and_order_rerun_nothing(restored):
    restored.edit("config/config.yaml", "seed: 0", "seed: 0 # a comment\n# another")
    restored.edit("config/smoke.yaml", "snr_db: [0, 20], realizations: 2", "realizations: 2, snr_db: [20, 0]")
    assert restored.planned("report", *SMOKE) == {}


def test_comment_in_a_stages_code_reruns_it_and_what_follows(project):
    for module, expected in (
        ("report/page.py", {"report"}),
        ("learning/scores.py", {"train", "predict", "timing", "scores", "report"}),
        ("common/config.py", set()),
    ):
        path = project.folder / "workflow/scripts" / module
        text = path.read_text()
        path.write_text(text + "# A comment.\n")
        assert set(project.planned("report", *SMOKE)) == expected, module
        path.write_text(text)
    assert project.planned("report", *SMOKE) == {}


def test_artefact_that_no_rule_makes_is_refused(project):
    finished = project.run("--cores", 1, f"{RESULTS}/scattering/dron.zarr", *SMOKE)
    assert finished.returncode != 0
    assert "dron.zarr" in finished.stdout
    assert "Traceback" not in finished.stdout


def test_all_makes_every_store(project):
    assert project.planned("all", *SMOKE) == {"noise": 2}  # the unknown target's, which no experiment tests yet
