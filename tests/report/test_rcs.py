"""The radar cross-section as numbers and figures: tables, cuts, and a reference of the user's own."""

import json

import fake
import feko
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from pages import check_whole

from isarflow.core.errors import InputError
from isarflow.core.store import write
from isarflow.core.sweep import C0, directions, unit_vectors
from isarflow.report.rcs import compare_figure, compare_table, write_rcs
from isarflow.report.rcs_figures import cut_figure, frequency_figure, map_figure
from isarflow.scattering.fields.compared import compare
from isarflow.scattering.fields.cuts import ALONG, SINGLE, cut
from isarflow.scattering.fields.interpolation import is_dense, order
from isarflow.scattering.fields.rcs import as_table, rcs_dbsm
from isarflow.scattering.fields.store import write_field

REACH, FREQUENCY = 0.3, np.array([1.0e9, 1.5e9])
POINTS = np.array([[0.2, 0.1, 0.0], [-0.15, 0.2, 0.1], [0.0, -0.25, -0.1]])
CIRCLE, TURNED = np.arange(0.0, 360.0, 5.0), np.arange(-90.0, 91.0, 10.0)
SINGLES = ([1.0, 30.0, 2.0], [5.0, 6.0, 7.0], True)


def points_field(elevation, azimuth, frequency=FREQUENCY):
    """Backscatter (1, F, ...) of point scatterers at directions of one shape."""
    u, *_ = unit_vectors(*np.broadcast_arrays(np.asarray(elevation, float), np.asarray(azimuth, float)))
    phase = 4 * np.pi / C0 * np.multiply.outer(frequency, u @ POINTS.T)
    return (np.exp(1j * phase) @ [1.0, 0.6, 0.8])[None].astype(np.complex64)


@pytest.fixture
def stored(tmp_path):
    """stored(elevation, azimuth, paired=False): a store of the points' field, opened."""

    def store(elevation, azimuth, paired=False):
        elevation, azimuth = np.array(elevation, float), np.array(azimuth, float)
        field = points_field(*((elevation, azimuth) if paired else (elevation[:, None], azimuth)))
        write_field(tmp_path / "a.zarr", field, ["VV"], FREQUENCY, elevation, azimuth, {})
        return xr.open_zarr(tmp_path / "a.zarr")

    return store


@pytest.mark.parametrize("paired", [False, True])
def test_the_table_holds_the_store(stored, paired):
    dataset = stored([0.0, 10.0, 20.0], [5.0, 90.0, 7.0], paired)
    table = as_table(dataset)
    assert len(table) == dataset.field.size
    rows = table[["elevation_deg", "azimuth_deg", "frequency_hz"]].itertuples(index=False)
    truth = np.array([points_field(*row)[0] for row in rows])
    np.testing.assert_allclose(table["rcs_dbsm"], 10 * np.log10(4 * np.pi * np.abs(truth) ** 2), atol=1e-4)
    np.testing.assert_allclose(table["phase_deg"], np.degrees(np.angle(truth)), atol=1e-2)


def test_curves_pass_through_the_samples_and_hold_the_field_between_them(stored):
    across, _, _, curves = cut(stored([0.0, 30.0], CIRCLE), REACH, 5)
    assert (across, len(curves)) == ("azimuth", 2)
    for curve, elevation in zip(curves, (0, 30), strict=True):
        assert curve.smooth and curve.x[-1] == 360
        largest, drawn = 10 ** (curve.levels.max() / 20), 10 ** (curve.y / 20)
        exact = np.sqrt(4 * np.pi) * np.abs(points_field(elevation, curve.x, FREQUENCY[:1])[0, 0])
        assert np.abs(drawn - exact).max() < 1e-4 * largest
        at_samples = np.interp(curve.samples, curve.x, drawn)
        assert np.abs(at_samples - 10 ** (curve.levels / 20)).max() < 0.02 * largest


def test_samples_too_far_apart_are_joined_by_lines_and_said_so(stored):
    dataset = stored([0.0], CIRCLE[::8])
    assert not is_dense(CIRCLE[::8], order(1e9, REACH, 0.0))
    for curve in cut(dataset, REACH, 5)[-1]:
        # Round the circle, and back to the first.
        assert not curve.smooth and np.array_equal(curve.x, [*curve.samples, 360]) and curve.y[-1] == curve.y[0]
    assert "too far apart" in cut_figure("a", dataset, REACH, 5).caption
    curves = cut(stored([0.0], CIRCLE[:40:8]), REACH, 5)[-1]
    assert all(np.array_equal(curve.x, curve.samples) for curve in curves)


def test_one_cut_is_drawn_at_several_frequencies(stored):
    assert rcs_dbsm(np.array([1 / np.sqrt(4 * np.pi), 0])) == pytest.approx([0, -200], abs=1e-12)
    for dataset in (stored([0.0], CIRCLE), stored(CIRCLE / 8, 0 * CIRCLE, True)):
        curves = cut(dataset, REACH, 5)[-1]
        assert [curve.label for curve in curves] == ["1 GHz", "1.5 GHz"]
        for curve, frequency in zip(curves, FREQUENCY, strict=True):
            truth = dataset.field.sel(polarization="VV", frequency=frequency).values.ravel()
            assert np.array_equal(curve.levels, rcs_dbsm(truth))
        assert sorted(cut_figure("a", dataset, REACH, 5).data["frequency"].unique()) == FREQUENCY.tolist()


def test_every_form_of_sweep_has_its_cut(stored):
    assert cut(stored(TURNED, [0.0, 90.0]), REACH, 5)[0] == "elevation"
    assert cut(stored([0.0], [30.0]), REACH, 5)[0] == "frequency"
    circle = {"great_circle": {"from": [0, 0], "through": [90, 0], "angle": {"count": 24}}}
    across, label, _, (curve, *_) = cut(stored(*directions(circle), paired=True), None, 4)
    assert (across, label) == ("direction", ALONG)
    # It is closed.
    assert len(curve.samples) == 24 and curve.x[-1] == pytest.approx(360) and curve.y[-1] == curve.y[0]
    for dataset in (stored([0.0, 10.0, 20.0], CIRCLE), stored(TURNED, 0 * TURNED, True)):
        assert cut_figure("a", dataset, REACH, 5, False) and cut_figure("a", dataset, REACH, 5, True)
        assert frequency_figure("a", dataset, 5)
        assert (map_figure("a", dataset) is None) == ("direction" in dataset.sizes)
    # Single directions are points, each named by its angles: nothing lies between them, and none is left out.
    assert cut(stored(*SINGLES), REACH, 5)[1] == SINGLE
    drawn = cut_figure("a", stored(*SINGLES), REACH, 5)
    assert all(name in drawn.svg.decode() for name in ("1, 5", "30, 6", "2, 7", "elevation, azimuth [°]"))
    assert "line" not in drawn.caption


def reference(path, azimuth, shift, **columns):
    level = rcs_dbsm(points_field(0.0, azimuth, FREQUENCY[:1])[0, 0]) + shift
    frame = pd.DataFrame({"azimuth_deg": azimuth, "rcs_dbsm": level, "frequency_hz": FREQUENCY[0]} | columns)
    frame.to_csv(path, index=False)
    return str(path)


def test_a_reference_between_the_samples_is_compared_with_the_field_there(stored, tmp_path):
    azimuth, shift = np.array([0.0, 2.2, 33.1, 355.0, 358.0]), np.array([0.5, -0.5, 0.5, 0.5, -2.0])
    compared = compare(reference(tmp_path / "r.csv", azimuth, shift), stored([0.0], CIRCLE), REACH)
    np.testing.assert_allclose(compared["difference_db"], -shift, atol=1e-3)
    data = compare_table("a", compared).data
    assert data[["mean_db", "worst_db"]].to_numpy() == pytest.approx(np.array([[0.8, 2.0]]), abs=1e-3)
    assert compared["azimuth_deg"][compared["difference_db"].idxmax()] == 358


def test_a_reference_round_the_circle_has_each_direction_once(stored, tmp_path):
    """With Fortran's exponents, a byte-order mark, a comment in another encoding, and columns of no meaning here."""
    azimuth = [0.0, 90.0, 360.0, -90.0, 270.0]
    path = tmp_path / "r.csv"
    reference(path, np.array(azimuth), 0.0, note="x")
    plain = path.read_text()
    assert "1000000000.0" in plain
    other = plain.replace("1000000000.0", "1.0D+09").replace("\n90.0", "\n900.0000-001").replace("\n", "\r\n")
    path.write_bytes(b"\xef\xbb\xbf# 0 bis 360\xb0\r\n" + other.encode())
    compared = compare(str(path), stored([0.0], CIRCLE), None)
    assert compared["azimuth_deg"].tolist() == [0.0, 90.0, -90.0]
    np.testing.assert_allclose(compared["difference_db"], 0, atol=1e-4)
    assert compared.attrs["left_out"] == 0 and set(compared["note"]) == {"x"}


def test_samples_that_do_not_compare_are_left_out_and_counted(stored, tmp_path):
    """Two are of directions that the run has not, two without a level."""
    azimuth, elevation = np.array([0.0, 5.0, 7.0, 15.0, 30.0, 45.0]), [0.0, 3.0, 0.0, 0.0, 0.0, 0.0]
    shift = np.array([0.0, 0.0, 0.0, np.nan, -np.inf, 0.0])
    path = reference(tmp_path / "r.csv", azimuth, shift, elevation_deg=elevation)
    compared = compare(path, stored([0.0], CIRCLE), None)
    assert compared["azimuth_deg"].tolist() == [0.0, 45.0]
    assert "4 more have no" in compare_figure("a", compared).caption


@pytest.mark.parametrize(
    ("columns", "row", "message"),
    [
        ("azimuth_deg,rcs", "0,1", "no column rcs_dbsm"),
        ("azimuth_deg,rcs_dbsm", "0,1", "no column frequency_hz; there are azimuth_deg, rcs_dbsm"),
        ("azimuth_deg,frequency_hz,rcs_dbsm", "0,1e9,x", "line 2: 'x' is not a finite number, for column rcs_dbsm"),
        ("azimuth_deg,frequency_hz,rcs_dbsm", "0,1e9,inf", "line 2: 'inf' is not a finite number"),
        ("azimuth_deg,frequency_hz,rcs_dbsm", ",1e9,0", "line 2: '' is not a finite number, for column azimuth_deg"),
        (
            "azimuth_deg,frequency_hz,rcs_dbsm",
            "0,1e9,1,5",
            "line 2: 4 values, and 3 columns .* Decimals are written with",
        ),
        ("azimuth_deg,frequency_hz,rcs_dbsm,rcs_dbsm", "0,1e9,1,5", "more than one column rcs_dbsm"),
        ("azimuth_deg,frequency_hz,rcs_dbsm", "# nothing", "no row below its header"),
        (
            "azimuth_deg,frequency_hz,rcs_dbsm",
            "0,1e9,1\n\n# turned\n360,1e9,1.01",
            "line 5: another level .*r.csv, line 2",
        ),
        ("azimuth_deg,frequency_hz,elevation_deg,rcs_dbsm", "0,1e9,120,1", "line 2: elevation 120 degrees is beyond"),
        ("azimuth_deg,frequency_hz,rcs_dbsm", "0,1e9,NaN", "none of its 1 samples has a level"),
        ("azimuth_deg,frequency_hz,rcs_dbsm", "1,1e9,0", "none of its 1 samples has .* run.$"),
        ("azimuth_deg,frequency_hz,rcs_dbsm", "0,1e3,0", "Its frequency_hz: 1000 to 1000; the run's: 1000000000 to "),
        ("azimuth_deg,frequency_hz,polarization,rcs_dbsm", "0,1e9,HH,0", "Its polarization: HH; the run's: VV.$"),
    ],
)
def test_a_reference_that_does_not_fit_is_refused(stored, tmp_path, columns, row, message):
    (tmp_path / "r.csv").write_text(f"{columns}\n{row}\n")
    with pytest.raises(InputError, match=message):
        compare(str(tmp_path / "r.csv"), stored([0.0], CIRCLE), None)


def test_a_reference_may_be_what_feko_wrote(tmp_path):
    sweep = [1.0e9], [0.0, 20.0], [0.0, 40.0, 80.0]
    (tmp_path / "v.ffe").write_text(feko.sweep(*sweep))
    field = feko.amplitudes(*sweep)
    both = np.stack([field["VV"], 2 * field["HV"]]).astype(np.complex64)
    write_field(tmp_path / "b.zarr", both, ["VV", "HV"], *sweep, {})
    compared = compare({"V": str(tmp_path / "v.ffe")}, xr.open_zarr(tmp_path / "b.zarr"), None)
    mean = compared.groupby("polarization")["difference_db"].mean()
    assert mean.to_dict() == pytest.approx({"VV": 0, "HV": 20 * np.log10(2)}, abs=1e-3)
    assert len(compared) == 12
    # FEKO's loop from 0 to 360 degrees solves the first direction once more.
    again = feko.sweep(sweep[0], sweep[1], [0.0])[len(feko.HEAD) :]
    (tmp_path / "v.ffe").write_text(feko.sweep(*sweep) + again)
    assert len(compare({"V": str(tmp_path / "v.ffe")}, xr.open_zarr(tmp_path / "b.zarr"), None)) == 12
    (tmp_path / "v.ffe").write_text(
        feko.sweep(*sweep) + feko.sweep(sweep[0], sweep[1], [0.0], eta=90)[len(feko.HEAD) :]
    )
    with pytest.raises(InputError, match=r"v\.ffe, line \d+: another field .*v\.ffe, line 17\."):
        compare({"V": str(tmp_path / "v.ffe")}, xr.open_zarr(tmp_path / "b.zarr"), None)


def test_the_page_shows_what_meshes_warn_of(tmp_path):
    settings = fake.changed(radar={"frequencies": 1}, mesh={"bands": 1})
    del settings["targets"]["ufo"]
    settings["targets"]["drone"] = {"field": "drone.zarr", "role": "known"}
    fake.make(tmp_path, settings)
    field = xr.open_zarr(tmp_path / "scattering/drone.zarr").load()
    write(field.assign_attrs(warnings=["drone.zarr: a chunk is absent."]), tmp_path / "scattering/drone.zarr")
    path = tmp_path / "mesh/missile.json"
    measures = json.loads(path.read_text())
    missed = measures["bands"][0]["missed"] = "is 0.031 wavelengths from its source (goal 0.025)"
    measures["source"]["warnings"] = ["its shell is nearly closed."]
    path.write_text(json.dumps(measures))
    report = tmp_path / "rcs"
    report.mkdir()
    write_rcs(tmp_path, settings, report / "index.html")
    words = check_whole(report).words
    glossary = words.partition("Glossary")[2]
    assert "RCS Radar cross section" in glossary
    assert not any(word in glossary for word in ("margin", "folds", "realizations"))  # of its style, and the config
    assert "3 warnings on this run: " in words
    assert "drone : drone.zarr: a chunk is absent." in words
    assert f"missile : its shell is nearly closed. missile : the mesh of band 0 {missed}" in words
