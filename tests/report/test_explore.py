"""What a page holds: files, to the letter; for its viewer fields, ways to form images and meshes, if it bears them."""

import base64

import fake
import numpy as np
import pytest
import xarray as xr
from pages import unpacked

from isarflow.report import section_explore
from isarflow.report.embed import embedded


def explorer(whole, settings=fake.SETTINGS):
    return section_explore.explorer(fake.results(whole.parent, settings))


def numbers(packed):
    """Return whole numbers of two bytes, times their scale where they have one."""
    if isinstance(packed, dict):
        return packed["scale"] * numbers(packed["numbers"])
    return np.frombuffer(base64.b64decode(packed), "<i2")


def _sorted(corners):
    """Return triangles (triangles, 3, 3) in an order that does not depend on theirs, nor on where each begins."""
    turned = [min(triangle[k:] + triangle[:k] for k in range(3)) for triangle in np.round(corners, 4).tolist()]
    return np.array(sorted(turned))


def test_the_viewer_has_the_fields_and_meshes_of_the_stores(whole):
    data = explorer(whole)
    assert [one["name"] for one in data["targets"]] == ["drone", "missile", "ufo"]
    assert data["elevations"] == [-30, 0, 30] and data["polarizations"] == ["VV", "HH"]
    assert data["snrs"] == [24, 12, 2.5, 0, -12]
    field, mesh = data["targets"][2]["field"], data["targets"][2]["mesh"]
    store = xr.open_zarr(whole.parent / "scattering" / "ufo.zarr").field.values  # in the viewer's order
    kept = numbers(field).reshape(*store.shape, 2) @ [1, 1j]
    np.testing.assert_allclose(kept, store, rtol=0, atol=2.2e-5 * np.abs(store).max())
    # The same triangles, of the same sense of rotation, in whatever order: each from its smallest corner.
    triangles = np.cumsum(numbers(mesh["triangles"])).reshape(-1, 3)
    points, corners = fake.results(whole.parent).surfaces["ufo"]
    seen = numbers(mesh["vertices"]).reshape(-1, 3)[triangles]
    np.testing.assert_allclose(_sorted(seen), _sorted(points[corners]), atol=1.1e-4)


# 3 targets of 5 frequencies and 24 azimuths: 1440 bytes for each polarization and elevation.
@pytest.mark.parametrize(("most", "polarizations", "elevations"), [(8640, 2, 3), (8639, 1, 3), (2900, 1, 2), (9, 1, 1)])
def test_the_viewer_grows_no_further_than_a_page_bears(whole, monkeypatch, most, polarizations, elevations):
    monkeypatch.setattr(section_explore, "MOST_TRIANGLES", 10)
    monkeypatch.setattr(section_explore, "MOST_BYTES", most)
    data = explorer(whole)
    assert (len(data["polarizations"]), len(data["elevations"])) == (polarizations, elevations)
    assert sum(numbers(one["field"]).size for one in data["targets"]) == 720 * polarizations * elevations
    assert [one["mesh"] for one in data["targets"]] == [None, None, None]


def test_the_run_s_own_way_comes_first_and_one_that_cannot_be_is_left_out(whole):
    assert list(explorer(whole, fake.changed(imaging={"reformat": "none"}))["ways"]) == ["none", "polar"]
    frequency, angle = np.linspace(1e9, 1.4e9, 5), np.radians([-80.0, 0, 80])
    assert list(section_explore._ways(frequency, angle, "none")) == ["none"]


def test_what_is_held_is_put_together_to_the_letter(tmp_path):
    letter = '<path id="DejaVuSans-41" d="M 1 2\nL 3 4\nz\n" transform="scale(0.015625)"/>'
    files = {
        "figures/a.svg": f'<svg>{letter}<path id="m1" d="M 0 0"/></svg>',
        "figures/b.svg": f"<svg><g>{letter}</g></svg>",
        "tables/a.csv": 'a,b\n1,"x, y"\n2,µ\n',
        "tables/same.csv": 'a,b\n1,"x, y"\n2,µ\n',
        "tables/one.csv": "a\n1\n",
        "tables/empty.csv": "a,b\n,\n,2\n",
        "tables/none.csv": "a,b\n",
        "tables/lines.csv": 'a,b\n"of two\nlines",1\n',
    }
    data = embedded(files, {"live": {"x": [1, 2]}})
    assert set(data) == {*list(files)[:2], "tables/a.csv tables/same.csv", *list(files)[4:], "live.json", "glyphs.json"}
    html = "".join(f'<script type="text/plain" data-file="{names}">{text}</script>\n' for names, text in data.items())
    (tmp_path / "index.html").write_text(html)
    held = unpacked(tmp_path / "index.html")
    assert held.pop("live.json") == b'{"x":[1,2]}' and held.pop("glyphs.json")
    assert {name: text.encode() for name, text in files.items()} == held
