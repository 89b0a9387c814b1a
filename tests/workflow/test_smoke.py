"""One true run of config/smoke.yaml, from CAD to the report: what comes out of it, and what reruns after an edit."""

import contextlib
import copy
import json
import os
import re
import shutil

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from isarflow.setup.config import ROOT

SMOKE = ("--configfile", "config/smoke.yaml")
RESULTS = "results/smoke"
TESTED = {"predict": 2, "scores": 1, "report": 1}
LEARNED = {"train": 2, "timing": 1, **TESTED}
ADDED = {"predict_2": 2, "scores": 1, "report": 1}  # of SNRs beside those that are there
IMAGED = {"image": 3, "noise": 2, **LEARNED}
SOLVED = {"solve": 6, "scattering": 3, **IMAGED}
ALL = {"mesh": 3, **SOLVED}
SPHERE = {"sphere": 1}  # which the solver is checked with
ONE_MODEL = {"train": 1, "timing": 1, "predict": 1, "scores": 1, "report": 1}
ONE_UNKNOWN = {"mesh": 1, "solve": 2, "scattering": 1, "image": 1, "report": 1}
ONE_SOLVE = {rule: count for rule, count in ONE_UNKNOWN.items() if rule != "mesh"}
TARGETS = "targets:\n  '*': null # none of config/config.yaml's but those named here\n"
DRONE = "  drone: {mesh: resources/cad/drone.stl, role: known, symmetry: [xz]}\n"
MISSILE = "  missile: {mesh: resources/cad/missile.stl, role: known, symmetry: [xz]}\n"
UFO = "  ufo: {mesh: resources/cad/ufo.stl, role: unknown, symmetry: [xz]}\n"
AIRCRAFT = "  aircraft: {mesh: resources/cad/aircraft.stl, role: known, symmetry: [xz]}\n"
MODELS = "learning:\n  models: "

# Edits of config/smoke.yaml: what is replaced by what, and which jobs that makes necessary.
EDITS = {
    # Nothing, or only what the page says.
    "a comment": ("name: smoke", "name: smoke # the smallest\n# of all", {}),
    "a value that is the default": ("mesh: {bands: 2}", "seed: 0\nmesh: {bands: 2, edges_per_wavelength: 10}", {}),
    "SNRs in another order": ("snr_db: [0, 20]", "snr_db: [20, 0]", {}),
    "keys in another order": ("{snr_db: [0, 20], realizations: 2}", "{realizations: 2, snr_db: [0, 20]}", {}),
    "a number written otherwise": ("center_frequency: 0.9e9", "center_frequency: 900.0e+6", {}),
    "targets in another order": (TARGETS + DRONE + MISSILE + UFO, TARGETS + UFO + MISSILE + DRONE, {}),
    "models in another order": ("[lr, knn]", "[knn, lr]", {"report": 1}),
    "two settings of an unused model swapped": (
        "learning:\n",
        MODELS + "{svm: {C: 2.75, scale: 930.66}}\n",
        {"report": 1},
    ),
    # Everything.
    "name": ("name: smoke", "name: smaller", ALL | SPHERE),
    "mesh.bands": ("bands: 2", "bands: 1", ALL | {"solve": 3}),
    "more mesh.bands": ("bands: 2", "bands: 3", ALL | {"solve": 9}),
    "mesh.edges_per_wavelength": ("bands: 2", "bands: 2, edges_per_wavelength: 11", ALL | SPHERE),
    "radar.center_frequency": ("0.9e9", "0.8e9", ALL),
    "radar.bandwidth": ("0.4e9", "0.3e9", ALL),
    "radar.polarizations": ("[VV]", "[HH]", SOLVED),
    "two elevations' signs swapped": ("start: 0, stop: 30", "start: -30, stop: 0", SOLVED),
    "aspect.azimuth": ("count: 36", "count: 40", SOLVED),
    "scattering.formulation": ("imaging:", "scattering: {formulation: cfie}\nimaging:", SOLVED | SPHERE),
    "scattering.precision": ("imaging:", "scattering: {precision: double}\nimaging:", SOLVED | SPHERE),
    # From the images on, or from the noise.
    "imaging.aperture": ("aperture: 5", "aperture: 7", IMAGED),
    "imaging.window": ("aperture: 5", "aperture: 5, window: hann", IMAGED),
    "imaging.reformat": ("aperture: 5", "aperture: 5, reformat: exact", IMAGED),
    "imaging.upsample": ("aperture: 5", "aperture: 5, upsample: 12", IMAGED),
    "imaging.polarizations": ("aperture: 5", "aperture: 5, polarizations: [VV]", {}),
    "imaging.focus": ("aperture: 5", "aperture: 5, focus: entropy", {"noise": 2, **TESTED}),
    "imaging.focus as it is": ("aperture: 5", "aperture: 5, focus: none", {}),
    "noise.realizations": ("realizations: 2", "realizations: 3", {"noise": 2, **TESTED}),
    "noise.definition": ("realizations: 2", "realizations: 2, definition: mean", {"noise": 2, **TESTED}),
    "noise.per": ("realizations: 2", "realizations: 2, per: sweep", {"noise": 2, **TESTED}),
    "an SNR more": ("snr_db: [0, 20]", "snr_db: [10, 0, 20]", {"noise_2": 2, **ADDED}),
    "an SNR less": ("snr_db: [0, 20]", "snr_db: [20]", TESTED),
    "another SNR": ("snr_db: [0, 20]", "snr_db: [0, 10]", {"noise": 2, **TESTED}),
    "seed": ("name: smoke", "name: smoke\nseed: 1", {"noise": 2, **LEARNED}),
    # Learning.
    "two shares of the split swapped": ("learning:\n", "learning:\n  split: {train: 0.33, validation: 0.7}\n", LEARNED),
    "learning.split.scheme": (
        "learning:\n",
        "learning:\n  split: {scheme: sector}\n",
        {**LEARNED, "train": 12, "predict": 12},
    ),
    "folds that no experiment has": ("learning:\n", "learning:\n  split: {folds: 3}\n", {"report": 1}),
    "learning.realizations": ("learning:\n", "learning:\n  realizations: all\n", TESTED),
    "a hyper-parameter": ("learning:\n", MODELS + "{knn: {k: 3}}\n", ONE_MODEL),
    "a model's features": ("learning:\n", MODELS + "{knn: {features: magnitude}}\n", ONE_MODEL),
    "a model more": ("[lr, knn]", "[lr, knn, svm]", ONE_MODEL),
    "a model less": ("[lr, knn]", "[lr]", {"timing": 1, "scores": 1, "report": 1}),
    "an experiment more": (
        "  experiments:\n",
        "  experiments:\n    low: {train: {elevation: [0], snr_db: clean}, models: [knn]}\n",
        ONE_MODEL,
    ),
    "an experiment's elevations": ("elevation: all", "elevation: [30]", LEARNED),
    "an experiment's training SNR": ("snr_db: clean", "snr_db: 20", LEARNED),
    "an experiment's pixels": ("models: [lr, knn]", "models: [lr, knn]\n      upsample: 12", LEARNED),
    "an experiment opened": ("models: [lr, knn]", "models: [lr, knn]\n      open: true", {"noise": 1, **TESTED}),
    # Targets.
    "two targets' meshes swapped": (
        DRONE + MISSILE,
        DRONE.replace("drone.stl", "missile.stl") + MISSILE.replace("missile.stl", "drone.stl"),
        {"mesh": 2, "solve": 4, "scattering": 2, "image": 2, "noise": 2, **LEARNED},
    ),
    "two targets' roles swapped": (
        MISSILE + UFO,
        MISSILE.replace("known", "unknown") + UFO.replace("unknown", "known"),
        {"noise": 1, **LEARNED},
    ),
    "a target's symmetry": (UFO, UFO.replace("[xz]", "[xz, yz]"), ONE_UNKNOWN),
    "a target's unit": (UFO, UFO.replace("role", "unit: cm, role"), ONE_UNKNOWN),
    "a target's rotation": (UFO, UFO.replace("role", "rotate: [0, 0, 90], role"), ONE_UNKNOWN),
    "a target's material": (UFO, UFO.replace("role", "material: space_cloth, role"), ONE_SOLVE),
    "a solid target": (UFO, UFO.replace("role", "material: abs, role"), ONE_UNKNOWN),
    "a target's own formulation": (UFO, UFO.replace("role", "formulation: cfie, role"), ONE_SOLVE),
    "an unknown target more": (UFO, UFO + AIRCRAFT.replace("known", "unknown"), ONE_UNKNOWN),
    "a known target more": (
        UFO,
        UFO + AIRCRAFT,
        {"mesh": 1, "solve": 2, "scattering": 1, "image": 1, "noise": 1, **LEARNED},
    ),
    "a target less": (UFO, "", {"report": 1}),
}
# What a statement more in a file of Python, or a comment or a byte in another, makes necessary.
FILES = {
    "isarflow/mesh/remesh/edits.py": ALL,
    "isarflow/scattering/mom/basis.py": SOLVED | SPHERE,
    "isarflow/scattering/solvers/mom.py": SOLVED | SPHERE,
    "isarflow/scattering/mom/operators/cfie.py": SOLVED | SPHERE,
    "isarflow/imaging/noise.py": IMAGED,
    "isarflow/imaging/imagers/fourier.py": IMAGED,
    "isarflow/imaging/focus/none.py": {"noise": 2, **TESTED},
    "isarflow/scattering/fields/ffe.py": {},
    "isarflow/scattering/costs.py": SOLVED | SPHERE,
    "isarflow/learning/evaluation/metrics.py": {"scores": 1, "report": 1},
    "isarflow/learning/evaluation/thresholds.py": {"scores": 1, "report": 1},
    "isarflow/learning/evaluation/timing.py": {"timing": 1, "report": 1},
    "isarflow/learning/predict.py": TESTED,
    "isarflow/learning/data/split.py": LEARNED,
    "isarflow/learning/models/knn.py": ONE_MODEL,
    "isarflow/learning/confidence.py": ONE_MODEL,
    "isarflow/learning/networks/capsules.py": {},  # no such network is trained
    "isarflow/report/style.css": {"report": 1},
    "isarflow/report/page.py": {"report": 1},
    "isarflow/core/sweep.py": ALL | SPHERE,
    "resources/cad/ufo.stl": ONE_UNKNOWN,
}
NO_RESULT_OF = (
    "isarflow/learning/models/svm.py",
    "isarflow/imaging/focus/entropy.py",
    "isarflow/setup/overview.py",
    "workflow/rules/mesh.smk",
    "config/config.yaml",
    "config/smoke.yaml",
    "resources/cad/make.py",
    "resources/cad/aircraft.stl",
)


@pytest.fixture(scope="module")
def smoke(project_of):
    """A project in which the report of config/smoke.yaml was made, from CAD on; tests leave it as it was."""
    project = project_of("smoke")
    finished = project.run("--cores", 2, "report", *SMOKE)
    assert finished.returncode == 0, finished.stdout
    return project


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
        "learning/scores.json",
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
    # 64 test images, none with a mirror image among the 104 that train: chance is 0.5 with a deviation of 0.06.
    assert accuracy.value.mean() > 0.8 and accuracy.value.min() > 0.7
    assert ((scores.low <= scores.value + 1e-12) & (scores.value <= scores.high + 1e-12)).all()


def test_second_run_has_nothing_to_do(smoke):
    assert smoke.planned("report", *SMOKE) == {}


def test_files_that_no_rule_makes_are_no_inputs(smoke):
    """Of those Snakemake looks at the date alone; what they hold is a param."""
    records = [json.loads(path.read_text()) for path in (smoke.folder / ".snakemake/metadata").iterdir()]
    assert {path.split("/")[0] for record in records for path in record["input"]} == {"results"}


def test_artefact_that_no_rule_makes_is_refused(smoke):
    finished = smoke.run("--cores", 1, f"{RESULTS}/scattering/dron.zarr", *SMOKE)
    assert finished.returncode != 0
    assert "dron.zarr" in finished.stdout
    assert "Traceback" not in finished.stdout


def test_all_makes_every_store(smoke):
    assert smoke.planned("all", *SMOKE) == {"noise": 1}  # the unknown target's, which no experiment tests yet


@pytest.fixture(scope="module")
def plans(smoke):
    """{edit: jobs that a dry-run announces}; each edit is in a file of its own."""
    text = (smoke.folder / "config/smoke.yaml").read_text()
    requests = []
    for number, (old, new, _) in enumerate(EDITS.values()):
        assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in config/smoke.yaml"
        path = smoke.write(f"config/edit_{number}.yaml", text.replace(old, new))
        requests.append(["report", "--configfile", path])
    return dict(zip(EDITS, smoke.all_planned(*requests), strict=True))


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_of_the_config_reruns_what_it_concerns_and_no_more(plans, edit):
    assert plans[edit] == EDITS[edit][2]


def test_a_run_takes_the_meshes_and_fields_of_another(smoke):
    text = (smoke.folder / "config/smoke.yaml").read_text()
    other = text.replace("name: smoke", "name: other\nfrom: smoke").replace("[lr, knn]", "[lr, knn, svm]")
    learned = {**IMAGED, "train": 3, "predict": 3}
    configs = {
        "learning": (other, learned),
        "a target": (
            other.replace(UFO, UFO + AIRCRAFT.replace("known", "unknown")),
            {**ONE_UNKNOWN, **learned, "image": 4},
        ),
        "settings": (other.replace("count: 36", "count: 40"), {"solve": 6, "scattering": 3, **learned}),
        "unknown run": (other.replace("from: smoke", "from: none"), {**ALL, **SPHERE, **learned}),
    }
    paths = [smoke.write(f"config/from_{n}.yaml", config) for n, (config, _) in enumerate(configs.values())]
    found = smoke.all_planned(*(["report", "--configfile", path] for path in paths))
    assert dict(zip(configs, found, strict=True)) == {case: jobs for case, (_, jobs) in configs.items()}
    said = smoke.run("--dry-run", "report", "--configfile", paths[1]).stdout
    assert "are those of results/smoke: drone, missile, ufo. Not there yet, and made there: aircraft." in said


@contextlib.contextmanager
def edited(*files, statement=b"ADDED = 1"):
    """The files of Python with a statement more, others with a comment and an old date, for a while."""
    contents = [file.read_bytes() for file in files]
    for file, content in zip(files, contents, strict=True):
        file.write_bytes(content + b"\n" + (statement if file.suffix == ".py" else b"# A comment.") + b"\n")
        os.utime(file, (1e9, 1e9))  # as `cp -p`, unzip and tar bring along
    try:
        yield
    finally:
        for file, content in zip(files, contents, strict=True):
            file.write_bytes(content)


@pytest.mark.parametrize("path", FILES)
def test_an_edit_of_a_file_reruns_what_it_concerns_and_no_more(smoke, path):
    with edited(smoke.folder / path):
        found = smoke.planned("report", *SMOKE)
    assert found == FILES[path]


def test_edits_of_what_no_result_comes_from_rerun_nothing(smoke):
    with edited(*(smoke.folder / path for path in NO_RESULT_OF)):
        assert smoke.planned("report", *SMOKE) == {}


def test_an_edited_comment_or_docstring_reruns_nothing(smoke):
    names = "mesh/remesh/edits.py", "core/sweep.py", "scattering/solve.py", "learning/models/knn.py", "report/page.py"
    files = [smoke.folder / "isarflow" / name for name in names]
    before = [file.read_text() for file in files]
    for file in files:
        file.write_text('"""Says something else."""\n\n' + file.read_text().partition('"""\n')[2])
    with edited(*files, statement=b"# A comment."):
        assert smoke.planned("report", "thesis_page", *SMOKE) == {"thesis_page": 1}
    for file, text in zip(files, before, strict=True):
        file.write_text(text)


# After the edits above: all that was put back has a new date and its old content.
def test_touched_and_restored_files_rerun_nothing(smoke):
    for path in ("resources/cad/drone.stl", "isarflow/mesh/read/target.py", "config/config.yaml"):
        os.utime(smoke.folder / path)
    assert smoke.planned("report", *SMOKE) == {}


def test_what_troubleshooting_says_of_copies(smoke, tmp_path):
    """`cp -a` of a finished run is one; `cp -r` is none until --touch says so."""
    for name, how in (("kept", shutil.copy2), ("lost", shutil.copy)):
        copied = copy.copy(smoke)
        copied.folder = shutil.copytree(smoke.folder, tmp_path / name, copy_function=how)
        if name == "lost":
            assert copied.planned("report", *SMOKE) != {}
            finished = copied.run("--cores", 1, "report", "--touch", *SMOKE)
            assert finished.returncode == 0, finished.stdout
        assert copied.planned("report", *SMOKE) == {}


def test_what_troubleshooting_says_of_a_deleted_file(smoke, results, tmp_path):
    store = results / "scattering/drone.zarr"
    store.rename(tmp_path / "drone.zarr")
    try:
        assert smoke.planned("report", *SMOKE) == {}
        assert smoke.planned(f"{RESULTS}/scattering/drone.zarr", *SMOKE) == {"scattering": 1}
    finally:
        (tmp_path / "drone.zarr").rename(store)


def test_the_thesis_s_page_shows_what_there_is_and_names_the_rest(smoke, results):
    assert smoke.planned("thesis_page", *SMOKE) == {"thesis_page": 1}
    finished = smoke.run("--cores", 1, "thesis_page", *SMOKE)
    assert finished.returncode == 0, finished.stdout
    page = (results / "report/thesis/README.md").read_text()
    scores = pd.read_csv(results / "learning/scores.csv", keep_default_na=False, na_values={"value": [""]}).astype(
        {"value": float}
    )
    rows = scores.query("model == 'knn' and metric == 'accuracy' and snr_definition == 'mean'")
    (line,) = (line for line in page.splitlines() if line.startswith("| KNN, split at random |"))
    assert len(rows) and [cell.split()[0] for cell in line.split(" | ")[1:]] == [f"{value:.3f}" for value in rows.value]
    assert "experiment `capsule_open` in the open set, split at random" in page
    assert (results / "report/thesis/fig-4-12.png").stat().st_size > 10_000
    assert smoke.planned("thesis_page", *SMOKE) == smoke.planned("report", *SMOKE) == {}
    with edited(smoke.folder / "resources/reference/thesis_settings.csv"):
        assert smoke.planned("report", *SMOKE) == {}  # which does not show them


@pytest.fixture(scope="module")
def seeded(smoke):
    """The options of a config with an SNR more and a second seed, of which the two seeds were compared.

    With it what was planned, and the predictions that were there before, each with its time.
    """
    text = (smoke.folder / "config/smoke.yaml").read_text().replace("[lr, knn]", "[knn]")
    text = text.replace("[0, 20]", "[0, 10, 20]").replace("name: smoke", "name: smoke\nseed: [0, 1]")
    options = ("--configfile", smoke.write("config/seeded.yaml", text))
    there = {path: path.stat().st_mtime_ns for path in (smoke.folder / RESULTS).glob("learning/predictions/*/*/*.csv")}
    planned = smoke.planned("compare", *options)
    finished = smoke.run("--cores", 2, "compare", *options)
    assert finished.returncode == 0, finished.stdout
    return options, planned, there


def test_an_added_snr_predicts_itself_alone_and_a_seed_makes_what_follows_from_it(smoke, results, seeded):
    options, planned, there = seeded
    # The one SNR, and of the other seed everything but meshes, fields and images without noise.
    assert planned == {
        "noise": 2,
        "noise_2": 2 + 2,
        "train": 1,
        "predict": 1,
        "predict_2": 1 + 1,
        "scores": 2,
        "seeds": 1,
        "compare": 1,
    }
    assert len(there) == 4 and {path: path.stat().st_mtime_ns for path in there} == there
    added = results / "learning/predictions/multi_elevation/knn/snr_10dB.csv"
    assert len(pd.read_csv(added)) == len(pd.read_csv(added.with_stem("snr_0dB")))
    scores = f"{RESULTS}/learning/scores.csv"
    assert smoke.all_planned(["compare", *options], [scores, *options], ["report", *SMOKE]) == [
        {},
        {},
        {"scores": 1, "report": 1},
    ]


def test_a_seed_s_results_are_those_of_a_run_with_that_seed_alone(smoke, results, seeded):
    alone = (smoke.folder / seeded[0][1]).read_text().replace("seed: [0, 1]", "seed: 1\nfrom: smoke")
    alone = ("--configfile", smoke.write("config/alone.yaml", alone.replace("name: smoke", "name: alone")))
    store = "imaging/drone/snr_20dB.zarr"
    finished = smoke.run("--cores", 1, f"results/alone/{store}", *alone)
    assert finished.returncode == 0, finished.stdout
    sums = [
        (folder / store / "SHA256SUMS").read_text() for folder in (smoke.folder / "results/alone", results / "seed_1")
    ]
    assert sums[0] == sums[1] != (results / store / "SHA256SUMS").read_text()
    # Models, too, are told nothing else than that run's would be.
    models = [results / folder / "learning/models/multi_elevation/knn/config.json" for folder in ("", "seed_1")]
    first, second = (json.loads(model.read_text()) for model in models)
    assert second["seed"] == np.random.SeedSequence([1, *b"multi_elevation/knn"]).generate_state(1)[0] != first["seed"]
    first["run"]["division"]["seed"] = 1
    assert second["run"] == first["run"]


def test_scores_over_seeds_are_their_mean_and_interval(results, seeded):
    tables = [pd.read_csv(results / folder / "learning/scores.csv") for folder in ("", "seed_1")]
    over = pd.read_csv(results / "learning/seeds.csv")
    assert len(over) == len(tables[0]) == len(tables[1]) and (over["n"] == 2).all()
    query = "metric == 'accuracy' and snr_definition == 'peak_3db' and test_snr_db == 10"
    (row,), values = over.query(query).to_dict("records"), [table.query(query)["value"].item() for table in tables]
    assert row["value"] == pytest.approx(np.mean(values))
    assert (row["lowest"], row["highest"]) == (min(values), max(values))
    assert row["low"] <= row["lowest"] and row["high"] >= row["highest"]


def test_seeds_stand_side_by_side_on_a_page_of_its_own(results, seeded):
    page, scores = (results / "report/compare.html").read_text(), pd.read_csv(results / "learning/scores.csv")
    assert "<h1>smoke beside seed_1</h1>" in page and "Over 2 seeds: Multi elevation" in page
    held = " ".join(re.findall(r'<script type="text/plain" data-file="([^"]+)', page)).split()
    links = [link for link in re.findall(r'(?:src|href)="([^"]+)', page) if not link.startswith(("data:", "#"))]
    assert set(links) <= set(held)
    differs = pd.read_csv(results / "report/compare.csv")
    assert differs.groupby("metric").size().to_dict() == {"accuracy": 3, "f1_weighted": 3}
    # Split at random by another seed: the images are those that test in both.
    tested = scores.query("metric == 'accuracy' and snr_definition == 'peak_3db'")["n"]
    assert (differs["n"] > 0).all() and (differs["n"] < tested.min()).all()
    np.testing.assert_allclose(differs["difference"], differs["value"] - differs["reference_value"])


def test_older_tables_of_another_run_are_compared_again(smoke, results, seeded):
    compare = ("compare", *SMOKE, "--config", "compare=[smoke/seed_1]")
    finished = smoke.run("--cores", 1, "--touch", *compare)  # as if it had been made
    assert finished.returncode == 0, finished.stdout
    with edited(results / "seed_1/learning/predictions/multi_elevation/knn/snr_0dB.csv"):
        assert smoke.planned(*compare) == {"compare": 1}
    assert smoke.planned(*compare) == {}


def test_runs_to_compare_have_to_be_there(smoke, results, seeded):
    compared = {"[none]": "no results/none/learning/scores.csv", "[smoke]": "own 'name'"}
    for others, said in compared.items():
        assert said in smoke.run("--dry-run", "compare", *SMOKE, "--config", f"compare={others}").stdout
    assert "nothing to compare this run with" in smoke.run("--dry-run", "compare", *SMOKE).stdout


# Last, as it makes images that no other job needs.
def test_images_of_one_snr_are_exported_and_load_as_docs_say(smoke, results, monkeypatch):
    name = f"{RESULTS}/learning/export/snr_20dB.h5"
    assert smoke.planned("export", *SMOKE) == {"noise": 1, "export": 1, "export_hdf5": 3, "export_zarr": 3}
    finished = smoke.run("--cores", 2, name, *SMOKE)
    assert finished.returncode == 0, finished.stdout
    page = (ROOT / "docs/exported-images.md").read_text()
    assert name in page
    monkeypatch.chdir(smoke.folder)
    space = {}
    exec(re.findall(r"```python\n(.*?)```", page, re.DOTALL)[2], space)
    # Of drone and missile, at 20 dB.
    assert space["accuracy"] > 0.8
    assert smoke.planned(name, *SMOKE) == {}
