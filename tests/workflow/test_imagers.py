"""An imager of one's own is one file and lines of config, as docs/adding-an-imager.md says."""

import numpy as np
import pytest
import xarray as xr
from test_docs import blocks

from isarflow.core.sweep import C0, azimuths, elevations, frequencies
from isarflow.scattering.fields.store import write_field
from isarflow.setup.yaml_file import read_yaml

LOOKS = ("--configfile", "config/looks.yaml")
IMAGER = "mine/multilook.py"
STORES = [f"results/looks/imaging/spot/{name}.zarr" for name in ("clean", "snr_20dB")]
PLACE = (0.3, 0.2)  # of the only scatterer: x and y in m
CONFIG = """
name: looks
targets:
  '*': null
  spot: {field: fields/spot.zarr, role: known}
radar: {center_frequency: 3.0e+9, bandwidth: 1.0e+9, frequencies: 9, polarizations: [VV]}
aspect: {elevation: {start: 0, stop: 0, step: 1}, azimuth: {start: -10, stop: 10, step: 2}}
imaging: {aperture: 9}
noise: {snr_db: [20], realizations: 1}
learning: {experiments: {}}
"""


def files(project):
    """What a user's folder holds beside results, by path."""
    kept = (path for path in project.folder.rglob("*") if path.is_file())
    found = {str(path.relative_to(project.folder)): path.read_bytes() for path in kept}
    return {path: text for path, text in found.items() if not path.startswith(("results/", ".snakemake/"))}


@pytest.fixture(scope="module")
def project(project_of):
    """A project in which the default imager made the stores."""
    project = project_of("looks")
    (project.folder / "fields").mkdir()
    config = read_yaml(project.folder / project.write("config/looks.yaml", CONFIG))
    frequency, elevation, azimuth = (
        frequencies(config["radar"]),
        elevations(config["aspect"]),
        azimuths(config["aspect"]),
    )
    az = np.radians(azimuth)
    nearer = PLACE[0] * np.cos(az) + PLACE[1] * np.sin(az)
    field = np.exp(2j * np.multiply.outer(2 * np.pi * frequency / C0, nearer)).astype(np.complex64)
    path = project.folder / "fields/spot.zarr"
    write_field(path, field[None, :, None], ["VV"], frequency, elevation, azimuth, {"formulation": "points"})
    finished = project.run("--cores", 2, "report", *STORES, *LOOKS)
    assert finished.returncode == 0, finished.stdout
    return project


def test_an_imager_of_ones_own_is_one_file_and_lines_of_config(project):
    page = project.folder / "results/looks/report/index.html"
    default = xr.open_zarr(project.folder / STORES[0]).attrs
    assert default["imager"] == "fourier" and default["coherent"] and default["reformat"] == "polar"
    assert "hamming window, polar reformatting" in page.read_text()
    before = files(project)

    (code,), (lines,) = (blocks("adding-an-imager.md", language) for language in ("python", "yaml"))
    project.write(IMAGER, code)
    own = lines.strip().replace("{", "{aperture: 9, ")
    assert project.planned("report", *STORES, *LOOKS) == {}  # nobody names it yet
    project.edit("config/looks.yaml", "imaging: {aperture: 9}", own)
    assert project.planned("report", *STORES, *LOOKS) == {"image": 1, "noise": 1, "report": 1}
    finished = project.run("--cores", 2, "report", *STORES, *LOOKS)
    assert finished.returncode == 0, finished.stdout

    after = files(project)
    changed = {path for path in before | after if before.get(path) != after.get(path) and "__pycache__" not in path}
    assert changed == {IMAGER, "config/looks.yaml"}
    for path in STORES:
        store = xr.open_zarr(project.folder / path).load()
        assert (store.attrs["imager"], store.attrs["looks"], store.attrs["coherent"]) == (IMAGER, 2, False)
        assert "window" not in store.attrs
        image = store.image.sel(elevation=0, azimuth=0).squeeze()
        assert (image.imag == 0).all() and image.real.min() >= 0 and image.real.max() == pytest.approx(1)
        row, column = np.unravel_index(image.real.values.argmax(), image.shape)
        assert abs(float(image.range[row]) + PLACE[0]) < image.range[1] - image.range[0]
        # A look is half an aperture, and as fine as two pixels.
        assert abs(float(image.crossrange[column]) - PLACE[1]) < 2 * (image.crossrange[1] - image.crossrange[0])
    assert "multilook, looks 2" in page.read_text() and "there is no phase" in page.read_text()

    project.edit(IMAGER, "    coherent = False", "    coherent = False\n    ADDED = 1")
    assert project.planned("report", *STORES, *LOOKS) == {"image": 1, "noise": 1, "report": 1}
    project.edit(IMAGER, "\n    ADDED = 1", "")
    (project.folder / "isarflow/imaging/imagers/fourier.py").open("a").write("ADDED = 1\n")
    # No image is made by it; the page's viewer forms images this way, too.
    assert project.planned("report", *STORES, *LOOKS) == {"report": 1}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ("looks: 0", "'imaging.looks': 0 is less than the minimum of 1. Expected: parts of the aperture"),
        ("looks: 12", "'imaging.looks': there are more looks than"),
        (
            "looks: 2, window: hann",
            "'imaging.window' is unknown. Known keys here: aperture, focus, imager, looks, polarizations.",
        ),
        ("imager: fourrier", "'imaging.imager': there is no imager 'fourrier'; did you mean 'fourier'?"),
        ("aperture: 9", "'imaging.looks' is missing. Expected: parts of the aperture"),
    ],
)
def test_its_settings_are_checked_as_all_others(project, settings, message):
    project.write(IMAGER, blocks("adding-an-imager.md", "python")[0])
    named = "" if "imager" in settings else f"imager: {IMAGER}, "
    project.write("config/wrong.yaml", CONFIG.replace("aperture: 9", named + settings))
    finished = project.run("--dry-run", "report", "--configfile", "config/wrong.yaml")
    assert finished.returncode != 0 and message in finished.stdout and "Traceback" not in finished.stdout


SPARSE = "imager: sparse, pixels: 2, sparsity: 0.1, iterations: 30"
COMPARED = "imagers: {a: {imager: esprit, pixels: 3, scatterers: 5}, b: {imager: centres, pixels: 3, centres: 5}}"


def test_settings_of_imagers_rerun_what_they_change(project):
    """Those of the run's own imager make its images again; those that the page compares, the page alone."""
    options, stores = ("--configfile", "config/beyond.yaml"), [path.replace("looks", "beyond") for path in STORES]
    imaging = f"imaging: {{aperture: 9, {SPARSE}}}\n{COMPARED}"
    text = CONFIG.replace("name: looks", "name: beyond").replace("imaging: {aperture: 9}", imaging)
    project.write("config/beyond.yaml", text)
    finished = project.run("--cores", 2, "report", *stores, *options)
    assert finished.returncode == 0, finished.stdout
    page = (project.folder / "results/beyond/report/index.html").read_text()
    assert "Imagers beside each other" in page and "a: esprit, pixels 3, scatterers 5" in page
    imaged, shown = {"image": 1, "noise": 1, "report": 1}, {"report": 1}
    for before, after, jobs in (
        ("sparsity: 0.1", "sparsity: 0.2", imaged),
        (SPARSE, "imager: esprit, pixels: 2, scatterers: 3", imaged),
        ("scatterers: 5", "scatterers: 6", shown),
    ):
        project.write("config/beyond.yaml", text.replace(before, after))
        assert project.planned("report", *stores, *options) == jobs, after
    project.write("config/beyond.yaml", text)
    for name, jobs in (("sparse", imaged), ("esprit", shown)):
        file = f"isarflow/imaging/imagers/{name}.py"
        project.edit(file, "\n\nclass Imager", "\nADDED = 1\n\n\nclass Imager")
        assert project.planned("report", *stores, *options) == jobs, name
        project.edit(file, "\nADDED = 1\n", "")


def test_a_focus_method_concerns_images_with_noise_alone(project):
    """Its file, of one's own here, is one of the code of their jobs, and no image without noise is made again."""
    options = ("--configfile", "config/focused.yaml")
    stores = [path.replace("looks", "focused") for path in STORES]
    text = CONFIG.replace("name: looks", "name: focused")
    project.write("config/focused.yaml", text)
    finished = project.run("--cores", 2, *stores, *options)
    assert finished.returncode == 0, finished.stdout
    (code,) = [block for block in blocks("motion.md", "python") if "class Focus" in block]
    (lines,) = [block for block in blocks("motion.md", "yaml") if "mine/" in block]
    project.write("mine/prominent.py", code)
    project.write(
        "config/focused.yaml", text.replace("imaging: {aperture: 9}", lines.replace("{", "{aperture: 9, ", 1))
    )
    assert project.planned(*stores, *options) == {"noise": 1}
    finished = project.run("--cores", 2, *stores, *options)
    assert finished.returncode == 0, finished.stdout
    assert xr.open_zarr(project.folder / stores[1]).attrs["focus"] == {"method": "mine/prominent.py", "rounds": 3}
    assert project.planned(*stores, *options) == {}
    project.edit("mine/prominent.py", "class Focus(Focusing):", "ADDED = 1\n\n\nclass Focus(Focusing):")
    assert project.planned(*stores, *options) == {"noise": 1}


@pytest.mark.parametrize(
    ("compared", "message"),
    [
        ("{a: 1}", "'imagers.a': it names an 'imager' and its settings"),
        (
            "{a: {imager: sparse, pixels: 2, sparsity: 2, iterations: 5}}",
            "'imagers.a': 'imaging.sparsity': 2 is greater than",
        ),
        ("{a: {imager: esprit, pixels: 2}}", "'imagers.a': 'imaging.scatterers' is missing"),
        ("{a: {imager: espirt}}", "did you mean 'esprit'?"),
    ],
)
def test_imagers_to_compare_are_checked_as_the_runs_own(project, compared, message):
    project.write("config/wrong.yaml", f"{CONFIG}imagers: {compared}\n")
    finished = project.run("--dry-run", "report", "--configfile", "config/wrong.yaml")
    assert finished.returncode != 0 and message in finished.stdout and "Traceback" not in finished.stdout
