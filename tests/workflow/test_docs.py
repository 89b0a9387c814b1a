"""What the pages in docs/ and the README print works: links, the example store and the example model."""

import re
import subprocess
import sys

import h5py
import numpy as np
import pytest
import xarray as xr
import zarr

import isarflow
from isarflow.core import store
from isarflow.core.sweep import C0
from isarflow.learning.data.export import export
from isarflow.scattering.fields.external import write_external
from isarflow.scattering.sphere import backscatter
from isarflow.setup.config import ROOT, load_config
from isarflow.setup.yaml_file import read_yaml

PAGES = [
    *sorted((ROOT / "docs").glob("*.md")),
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "config/README.md")),
]


def blocks(page, language):
    """The fenced blocks of a page in a language."""
    return re.findall(rf"^ *```{language}\n(.*?)^ *```$", (ROOT / "docs" / page).read_text(), re.MULTILINE | re.DOTALL)


def anchors(text):
    """The anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)\s]+)\)", page.read_text())
    for link in (link for link in links if "://" not in link):
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target.read_text()), link


def test_pages_agree_on_how_long_runs_take():
    readme, table = ((ROOT / name).read_text() for name in ("README.md", "config/README.md"))
    whole = re.search(r"the default experiment\s+takes (\d+ minutes) .*up to twice that", readme)[1]
    assert re.search(rf"^\| `config.yaml` .* \| {whole} .*up to twice that", table, re.MULTILINE)
    for page in (readme, table, *((ROOT / name).read_text() for name in ("config/smoke.yaml", "docs/tutorial.md"))):
        assert "one to two minutes" in page


@pytest.fixture
def points(tmp_path, monkeypatch):
    """The store of fields that own-fields.md makes, in the folder where it is made, and the config that takes them."""
    monkeypatch.chdir(tmp_path)
    (code,) = blocks("own-fields.md", "python")
    (tmp_path / "fields").mkdir()
    exec(compile(code, "own-fields.md", "exec"), {})
    (tmp_path / "points.yaml").write_text(blocks("own-fields.md", "yaml")[1])
    return load_config(read_yaml("points.yaml"))


def test_example_store_is_taken_as_it_is(points):
    for target in points["targets"].values():
        write_external(target["field"], "taken.zarr", points["radar"], points["aspect"])
        taken, made = (xr.open_zarr(path).field.values for path in ("taken.zarr", target["field"]))
        assert taken.shape == (1, 14, 2, 120)
        np.testing.assert_array_equal(taken, made)


def counted(block):
    """{rule: jobs} as a block of a page shows it."""
    return {rule: int(jobs) for rule, jobs in re.findall(r"^(\w+) +(\d+)$", block, re.MULTILINE) if rule != "total"}


def test_pages_show_the_plans_that_snakemake_makes(project_of):
    project, plans = project_of("pages"), {}
    for page, config in (("tutorial.md", "glider"), ("own-fields.md", "points")):
        files = [code for code in blocks(page, "python") if "file.write" in code or "to_zarr" in code]
        (project.folder / "fields").mkdir(exist_ok=True)
        subprocess.run([sys.executable, "-c", *files], cwd=project.folder, check=True)
        (text,) = [text for text in blocks(page, "yaml") if f"name: {config}" in text]
        project.write(f"config/{config}.yaml", text)
        (plans[config],) = [block for block in blocks(page, "console") if re.search("^train ", block, re.MULTILINE)]
    smoke = ["report", "--configfile", "config/smoke.yaml", "config/glider.yaml"]
    assert project.planned(*smoke) == counted(plans["glider"])
    assert project.planned("report", "--configfile", "config/points.yaml") == counted(plans["points"])
    assert f"{sum(counted(plans['points']).values())} of " in plans["points"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The file that exported-images.md loads: two targets, one bright in down-range's first half, one in its second."""
    folder = tmp_path_factory.mktemp("exported")
    random, azimuth = np.random.default_rng(0), np.arange(36) * 10.0
    axes = {"realization": [0, 1], "elevation": [0.0, 30.0], "azimuth": azimuth}
    axes |= {"range": np.arange(6) * 0.1, "crossrange": np.arange(4) * 0.1}
    stores, roles = [], {"dart": "known", "disc": "known", "wing": "unknown"}
    for target, rows in zip(roles, (slice(0, 3), slice(3, 6), slice(2, 4)), strict=True):
        image = 0.1 * random.standard_normal((2, 2, 36, 6, 4)) + 0j
        image[..., rows, :] += np.exp(2j * np.pi * random.random(image[..., rows, :].shape))
        stores.append(str(folder / target / "snr_20dB.zarr"))
        store.write(xr.Dataset({"image": (tuple(axes), image.astype(np.complex64))}, axes), stores[-1])
    path = folder / "results/smoke/learning/export/snr_20dB.h5"
    path.parent.mkdir(parents=True)
    for form in (path, path.with_suffix(".zarr")):
        split = {"train": 0.7, "validation": 0.33, "folds": 6, "spacing": 0}
        export(stores, form, roles, {target: ["xz"] for target in roles}, split, 0, 5)
    return path


@pytest.fixture
def exported(made, monkeypatch):
    monkeypatch.chdir(made.parents[4])
    return made


def loaded(number):
    code, space = blocks("exported-images.md", "python")[number], {}
    exec(compile(code, "exported-images.md", "exec"), space)
    return space


def test_exported_images_load_in_a_few_lines(exported):
    there = loaded(0)
    train, test = there["train"], there["test"]
    assert train.x.shape == (2 * 2 * 26 * 2, 6, 4) and train.x.dtype == np.complex64
    assert len(test) == 2 * 2 * 8 * 2
    assert (train.snr == 20).all() and set(train.role) == {"known"}
    # Bright in the half that belongs to the name.
    power = (abs(train.x) ** 2).sum(axis=2)
    assert (train.y == np.where(power[:, :3].sum(axis=1) > power[:, 3:].sum(axis=1), "dart", "disc")).all()


def test_exported_images_of_several_files_roles_and_splits(exported):
    both = isarflow.load(exported, exported, split="sector_2", roles=("unknown", "known"))
    assert len(both) == 2 * 3 * 2 * 2 * 36
    assert dict(zip(both.y, both.role, strict=True)) == {"dart": "known", "disc": "known", "wing": "unknown"}
    with h5py.File(exported) as file:
        sides = file.attrs["sides"][file["split_sector_2"][:]]
        for name in ("elevation", "azimuth", "realization"):
            np.testing.assert_array_equal(getattr(both, name), np.tile(file[name][:], 2))
    np.testing.assert_array_equal(both.side, np.tile(sides, 2))
    with pytest.raises(ValueError, match="no split 'sector'; it has random, sector_1"):
        isarflow.load(exported, split="sector")
    with pytest.raises(FileNotFoundError, match=r"snakemake --cores 2 nowhere\.h5"):
        isarflow.load("nowhere.h5")
    with pytest.raises(ValueError, match="which files"):
        isarflow.load()
    with pytest.raises(ValueError, match="no role 'knwon'; roles are known, unknown, other"):
        isarflow.load(exported, roles="knwon")


def test_what_is_no_exported_file_is_said(tmp_path):
    (tmp_path / "snr_20dB.zarr").mkdir()
    with pytest.raises(ValueError, match=r"is a folder; take the HDF5 file beside it, .*snr_20dB\.h5"):
        isarflow.load(tmp_path / "snr_20dB.zarr")
    (tmp_path / "text.h5").write_text("nothing")
    with pytest.raises(ValueError, match="no HDF5 file"):
        isarflow.load(tmp_path / "text.h5")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["image"] = np.zeros(3)
    with pytest.raises(ValueError, match="no exported images"):
        isarflow.load(tmp_path / "other.h5")


def test_exported_images_load_with_numpy(exported):
    there = loaded(1)
    images = loaded(0)
    np.testing.assert_array_equal(there["x_train"], images["train"].x)
    np.testing.assert_array_equal(there["x_test"], images["test"].x)
    assert set(there["y_train"]) == {0, 1}
    # The other form takes the same lines.
    same = {"file": zarr.open(str(exported.with_suffix(".zarr"))), "np": np}
    lines = blocks("exported-images.md", "python")[1].splitlines()
    exec("\n".join(line.strip() for line in lines if "known" in line), same)
    np.testing.assert_array_equal(same["x"][same["side"] == 0], there["x_train"])


def test_exported_images_are_learned_with_scikit_learn(exported):
    assert loaded(2)["accuracy"] > 0.95


def test_exported_images_load_with_pytorch(exported):
    pytest.importorskip("torch", reason="PyTorch is not installed")
    there = loaded(3)
    assert len(there["dataset"]) == 2 * 2 * 26 * 2
    assert there["x"].shape[1:] == (1, 6, 4)


def test_exported_images_are_what_the_matlab_example_reads(exported):
    (code,) = blocks("exported-images.md", "matlab")
    with h5py.File(exported) as file:
        names = re.findall(r"h5read\(path, '/(\w+)'\)", code)
        assert set(names) <= set(file)
        assert len(names) == 5
        assert re.findall(r"h5readatt\(path, '/', '(\w+)'\)", code) == ["targets"]
        assert "targets" in file.attrs
        # What is read as a structure of r and i: a compound of two numbers.
        kind = file["image"].id.get_type()
        assert [kind.get_member_name(n) for n in range(kind.get_nmembers())] == [b"r", b"i"]


def test_example_model_tells_two_classes_apart():
    code, settings = blocks("adding-a-model.md", "python")[0], {"power": 1}
    space = {}
    exec(compile(code, "adding-a-model.md", "exec"), space)
    random = np.random.default_rng(0)
    labels = np.repeat(["a", "b"], 40)
    images = random.standard_normal((80, 5, 4)) * np.where(labels == "a", 1, 1j)[:, None, None]
    images[labels == "a", 1] *= 5
    images[labels == "b", 3] *= 5
    outcome = space["Model"](settings, 0).fit(images[::2], labels[::2]).evaluate(images[1::2])
    assert (outcome.labels == labels[1::2]).all()
    assert outcome.scores.shape == (40, 2)
    # Unlike either class: all of it in a row that neither has.
    strange = np.zeros((1, 5, 4), complex)
    strange[:, 0] = 1
    assert (
        space["Model"](settings, 0).fit(images, labels).evaluate(strange).known["correlation"]
        < outcome.known["correlation"].min()
    )


def test_the_readme_is_short_and_its_example_works(monkeypatch):
    text = (ROOT / "README.md").read_text()
    assert len(text.split()) <= 600
    monkeypatch.setenv("MPLBACKEND", "agg")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    made = {}
    exec(compile(code, "README.md", "exec"), made)
    rcs = 4 * np.pi * abs(made["field"][:, 0]) ** 2
    mie = [4 * np.pi * abs(backscatter(2 * np.pi * f / C0, 0.2)) ** 2 for f in made["frequency"]]
    np.testing.assert_allclose(rcs, mie, rtol=0.03)
    down, across = made["imager"].axes()
    row, column = np.unravel_index(abs(made["images"][0]).argmax(), made["images"][0].shape)
    # Its side towards the radar is 0.5 m before the origin.
    assert abs(down[row] + 0.5) < down[1] - down[0] and across[column] == 0
