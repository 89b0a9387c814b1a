"""What the pages in docs/ and the README print works: links, the example store and the example model."""

import re

import numpy as np
import pytest
import xarray as xr

from scattering.external import write_external
from setup.config import ROOT, load
from setup.yaml_file import read_yaml

PAGES = [
    *sorted((ROOT / "docs").glob("*.md")),
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
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


@pytest.fixture
def points(tmp_path, monkeypatch):
    """The store of fields that own-fields.md makes, in the folder where it is made, and the config that takes them."""
    monkeypatch.chdir(tmp_path)
    (code,) = blocks("own-fields.md", "python")
    (tmp_path / "fields").mkdir()
    exec(compile(code, "own-fields.md", "exec"), {})
    (tmp_path / "points.yaml").write_text(blocks("own-fields.md", "yaml")[1])
    return load(read_yaml("points.yaml"))


def test_example_store_is_taken_as_it_is(points):
    for target in points["targets"].values():
        write_external(target["field"], "taken.zarr", points["radar"], points["aspect"])
        taken, made = (xr.open_zarr(path).field.values for path in ("taken.zarr", target["field"]))
        assert taken.shape == (1, 14, 2, 120)
        np.testing.assert_array_equal(taken, made)


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
