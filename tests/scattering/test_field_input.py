"""Fields from elsewhere: FEKO's files against closed forms, stores against themselves, and what is refused."""

import hashlib
import itertools
import re
import shutil
from pathlib import Path

import feko
import mie
import numpy as np
import pytest
import xarray as xr

from isarflow.core.errors import InputError
from isarflow.core.sweep import azimuths, elevations, frequencies, sweeps
from isarflow.imaging.store import make_clean, make_noisy
from isarflow.mesh.io import write_ply
from isarflow.scattering.band import solve_band
from isarflow.scattering.fields import field_files
from isarflow.scattering.fields.external import write_external

RADAR = {"center_frequency": 1.0e9, "bandwidth": 0.3e9, "frequencies": 4, "polarizations": ["VV"]}
# Neither the elevations nor the azimuths lie on round numbers, and the sweep crosses azimuth 0.
ASPECT = {
    "elevation": {"start": -20, "stop": 40, "step": 20},
    "azimuth": {"start": -20, "stop": 30, "step": 12.5},
}
SWEEP = frequencies(RADAR), elevations(ASPECT), azimuths(ASPECT)


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Writes files (name: text) to a folder of their own and takes the field from `field`: the store, loaded."""
    monkeypatch.chdir(tmp_path)

    def place(field, *polarizations, aspect=ASPECT, symmetry=(), **texts):
        for name, text in texts.items():
            (tmp_path / f"{name}.ffe").write_text(text)
        radar = RADAR | ({"polarizations": list(polarizations)} if polarizations else {})
        write_external(field, "out.zarr", radar, aspect, symmetry)
        return xr.open_zarr("out.zarr").load()

    return place


@pytest.fixture(scope="module")
def text():
    return feko.sweep(*SWEEP)


def test_fekos_field_is_that_of_the_closed_form(place):
    wanted = ("HV", "VV", "HH", "VH")
    store = place({"V": "v.ffe", "H": ["h.ffe"]}, *wanted, v=feko.sweep(*SWEEP, eta=0), h=feko.sweep(*SWEEP, eta=90))
    expected = feko.amplitudes(*SWEEP)
    assert store.field.dims == ("polarization", "frequency", "elevation", "azimuth")
    assert store.field.dtype == np.complex64
    assert store.polarization.values.tolist() == list(wanted)
    for name, values in zip(("frequency", "elevation", "azimuth"), SWEEP, strict=True):
        np.testing.assert_array_equal(store[name], values)
        assert store[name].attrs["units"] and store[name].attrs["long_name"]
    for name in wanted:
        np.testing.assert_allclose(store.field.sel(polarization=name), expected[name], atol=1e-6)
    # The four differ by far more than the tolerance: a wrong sign or a swapped pair would be seen.
    assert np.abs(expected["HV"]).max() > 0.1
    np.testing.assert_allclose(expected["HV"], expected["VH"], atol=1e-12)


def test_nearer_scatterer_has_the_contracts_phase(place, monkeypatch):
    monkeypatch.setattr(feko, "POINTS", np.array([[0.25, 0, 0]]))
    monkeypatch.setattr(feko, "TENSORS", np.eye(3)[None])
    store = place("nose.ffe", nose=feko.sweep(*SWEEP))
    nose_on = store.field.sel(polarization="VV", elevation=0).interp(azimuth=-7.5).values
    d = 0.25 * np.cos(np.radians(-7.5))
    np.testing.assert_allclose(nose_on, np.exp(2j * 2 * np.pi * SWEEP[0] / 299_792_458.0 * d), atol=1e-6)


def test_attributes_say_where_it_came_from(place, text):
    store = place("a.ffe", a=text)
    assert store.attrs["origin"] == {"a.ffe": hashlib.sha256(text.encode()).hexdigest()}
    assert store.attrs["formulation"] == "external"
    assert store.attrs["residual"] is None and store.attrs["unknowns"] is None
    assert "exp(+j omega t)" in store.attrs["convention"]


def test_files_may_be_split_reordered_and_hold_more(place, text):
    whole = place("whole.ffe", whole=text).field
    frequency, elevation, azimuth = SWEEP
    low = feko.sweep(frequency[:2][::-1], [*elevation[::-1], 60], azimuth)
    high = feko.sweep([*frequency[2:], 3e9], elevation, [*azimuth[::-1], 90])
    np.testing.assert_array_equal(place(["high.ffe", "low.ffe"], low=low, high=high).field, whole)


def test_both_ends_of_a_circle_are_one(place):
    aspect = ASPECT | {"azimuth": {"count": 4}}
    store = place("circle.ffe", aspect=aspect, circle=feko.sweep(*SWEEP[:2], [0, 90, 180, 270]))
    # FEKO's loop from 0 to 360 degrees solves the first direction once more.
    last = [
        feko.block(f, 90 - e, 360, [(90 - e, 360, *feko.solve(f, 90 - e, 0, 0))]) for f in SWEEP[0] for e in SWEEP[1]
    ]
    closed = feko.sweep(*SWEEP[:2], [0, 90, 180, 270]) + "".join(last)
    np.testing.assert_array_equal(place("closed.ffe", aspect=aspect, closed=closed).field, store.field)


def test_strength_of_the_incident_wave_is_read_from_the_rcs(place, text):
    unit = place("unit.ffe", unit=text).field
    strong = place("strong.ffe", strong=feko.sweep(*SWEEP, strength=25.0)).field
    np.testing.assert_allclose(strong, unit, rtol=1e-6, atol=1e-9)


def test_backscatter_is_found_among_the_rows_of_a_pattern(place, text):
    blocks = []
    for f in SWEEP[0]:
        for el in SWEEP[1]:
            for az in SWEEP[2] % 360:
                rows = [(t, az, *feko.solve(f, t, az, 0)) for t in (10, 90 - el, 170)]
                blocks.append(feko.block(f, 90 - el, az, rows))
    pattern = feko.HEAD + "".join(blocks)
    np.testing.assert_array_equal(place("a.ffe", a=pattern).field, place("b.ffe", b=text).field)


def test_a_pattern_round_the_circle_has_its_direction_twice(place):
    """Rows of phi 0 to 360, both included, in each block, and a loop over incident waves that is closed, too."""
    aspect = ASPECT | {"azimuth": {"count": 4}}

    def pattern(last):
        blocks = []
        for f, e, az in itertools.product(*SWEEP[:2], (0, 90, 180, 270, 360)):
            back = np.array(feko.solve(f, 90 - e, az, 0))
            rows = [(90 - e, phi, *back * (last if phi == 360 else 1)) for phi in sorted({0, az, 360})]
            blocks.append(feko.block(f, 90 - e, az, rows))
        return feko.HEAD + "".join(blocks)

    store = place("circle.ffe", aspect=aspect, circle=pattern(1))
    np.testing.assert_allclose(store.field[0], feko.amplitudes(*SWEEP[:2], azimuths(aspect))["VV"], atol=1e-6)
    with pytest.raises(InputError, match=rf"^circle\.ffe, line {ROW + 1}: another field .* circle\.ffe, line {ROW}\."):
        place("circle.ffe", aspect=aspect, circle=pattern(1.001))


def test_numbers_are_taken_as_fortran_and_editors_write_them(place, text):
    plain = place("plain.ffe", plain=text).field
    number = re.compile(r"(-?\d\.\d+)E([+-]\d\d)")
    written = number.sub(r"\1D\2", _row(text, "RCS(Phi)", "1.00000000-105"))
    np.testing.assert_array_equal(place("other.ffe", other="\ufeff" + written).field, plain)


def _without(text, start):
    """The text without its first line that starts so."""
    return "".join(text.splitlines(True)[: _line(text, start) - 1] + text.splitlines(True)[_line(text, start) :])


def _line(text, start):
    return next(n for n, line in enumerate(text.splitlines(), 1) if line.startswith(start))


def _row(text, column, value):
    """The text with one number of its first row replaced; the row's line number."""
    lines = text.splitlines(True)
    number = _line(text, "#     ")
    row = lines[number].split()
    row[feko.COLUMNS.index(column)] = value
    lines[number] = " ".join(row) + "\n"
    return "".join(lines)


ROW = 17  # of the first block
BAD = {
    "another type": (lambda t: t.replace("Far field", "Near field"), r"line 1: a file of type 'Near field'"),
    "not FEKO's": (lambda t: "solid sphere\n" + t, r"line 1: not a FEKO far-field file"),
    "no type": (lambda t: _without(t, "##File Type"), r"line 6: not a FEKO far-field file"),
    "no block": (lambda t: feko.HEAD, r"no block"),
    "an antenna's": (lambda t: t.replace("Type: RCS", "Type: Gain", 1), r"line 13: the result is 'Gain', not RCS"),
    "Cartesian": (lambda t: t.replace("Spherical", "Cartesian", 1), r"line 10: coordinates are 'Cartesian'"),
    "moved origin": (lambda t: t.replace("#No. of T", "#Origin: (0, 0, 1.5)\n#No. of T", 1), r"line 11: 'Origin'"),
    "turned axes": (lambda t: t.replace("#No. of T", "#U-Vector: (0, 1, 0)\n#No. of T", 1), r"line 11: 'U-Vector'"),
    "no wave": (lambda t: _without(t, "#Incident"), r"line 7: .* 'Incident Wave Direction'"),
    "theta over 180": (
        lambda t: t.replace("(   1.10000000E+02", "(   2.10000000E+02", 1),
        r"line 14: theta 210 is not within 0 to 180 degrees, and elevation -120 is beyond -90 to 90",
    ),
    "two rows": (
        lambda t: t.replace("Theta Samples: 1", "Theta Samples: 2", 1),
        r"line 7: the block has 1 rows, not 2",
    ),
    "another direction": (lambda t: _row(t, "Theta", "95.0"), r"line 7: no rows look back .*theta 110, phi 340"),
    "no RCS": (lambda t: t.replace('"RCS(Total)"', '"Total"', 1), r"line 7: .* no column RCS\(Total\)"),
    "short row": (lambda t: _row(t, "RCS(Total)", ""), rf"line {ROW}: a row of 9 numbers"),
    "overflow": (lambda t: _row(t, "Re(Ephi)", "*********"), rf"line {ROW}: a row of 9 numbers"),
    "not a number": (lambda t: _row(t, "Re(Etheta)", "NaN"), rf"line {ROW}: a value is not finite"),
    "infinite": (lambda t: _row(t, "Im(Ephi)", "Infinity"), rf"line {ROW}: a value is not finite"),
    "wrong RCS": (lambda t: _row(t, "RCS(Total)", "1.0"), rf"line {ROW}: E and RCS imply"),
    "no RCS but E": (lambda t: _row(t, "RCS(Total)", "0.0"), rf"line {ROW}: RCS 0 does not belong"),
    "headers only": (lambda t: t + "#Frequency: 1e9\n#Frequency: 1e9\n", r"this block has no rows"),
    "wrong frequency": (lambda t: t.replace("8.50000000E+08", "8.51000000E+08"), r"no frequency 850000000 Hz"),
    "wrong elevation": (lambda t: t.replace("1.10000000E+02", "1.10500000E+02"), r"no elevation -20 degrees.*-20.5"),
    "wrong azimuth": (lambda t: t.replace("3.40000000E+02", "3.40100000E+02"), r"no azimuth -20 degrees.*340.1"),
    "one missing": (lambda t: t[: t.rindex("#Configuration")], r"1 of 80 samples .* azimuth 30 degrees"),
    "two polarizations": (
        lambda t: t + feko.sweep([SWEEP[0][1]], [0], [5], eta=90)[len(feko.HEAD) :],
        r"line \d+: another field .* of mine.ffe, line \d+\. .*\{V: \.\.\., H: \.\.\.\}",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_file_is_refused_with_its_place(place, text, case):
    change, message = BAD[case]
    changed = change(text)
    assert changed != text
    with pytest.raises(InputError, match=r"^mine\.ffe[,:].*" + message) as caught:
        place("mine.ffe", mine=changed)
    assert "\n" not in str(caught.value)


def test_file_cut_anywhere_is_refused_or_whole(place):
    aspect = {"elevation": {"start": 0, "stop": 0, "step": 1}, "azimuth": {"start": 0, "stop": 10, "step": 10}}
    text = feko.sweep(SWEEP[0], [0], [0, 10]).rstrip()
    whole = place("whole.ffe", aspect=aspect, whole=text).field
    last, refused = text.rindex("#Configuration"), 0
    for end in [0, 5, *range(last, len(text))]:
        try:
            cut = place("cut.ffe", aspect=aspect, cut=text[:end]).field
        except InputError as error:
            assert "cut.ffe" in str(error)
            refused += 1
        else:  # only digits of the total RCS are gone, which E repeats
            assert end > len(text) - 19
            np.testing.assert_allclose(cut, whole, rtol=1e-3)
    assert refused > len(text) - last - 19


@pytest.mark.parametrize(
    ("field", "wanted", "message"),
    [
        ("mine.ffe", ["VV", "HH"], r"need incident waves in H and V, .* for V.*\{H: h\.ffe, V: v\.ffe\}"),
        ({"V": "mine.ffe"}, ["HH"], r"named for H"),
        ({"H": "mine.ffe"}, ["HV"], r"named for V"),
        ({"H": ["a.ffe", "mine.ffe"], "V": "mine.ffe"}, ["HH", "VV"], r"mine\.ffe is named for H and V"),
    ],
)
def test_transmitted_polarization_without_a_file_is_refused(place, text, field, wanted, message):
    with pytest.raises(InputError, match=message):
        place(field, *wanted, mine=text)


# Stores.


@pytest.fixture
def given(tmp_path, monkeypatch):
    """A store of the closed form over the sweep and more, in V only, with azimuths from 0 to 360."""
    monkeypatch.chdir(tmp_path)
    frequency, elevation, azimuth = [*SWEEP[0], 2e9], [-40, *SWEEP[1]], np.sort(np.append(SWEEP[2] % 360, 99.0))
    values = feko.amplitudes(frequency, elevation, azimuth)
    data = xr.Dataset(
        {
            "field": (
                ("azimuth", "polarization", "elevation", "frequency"),
                np.stack([values["HV"], values["VV"]]).transpose(3, 0, 2, 1).astype(np.complex64),
                {"units": "m"},
            )
        },
        {"polarization": ["HV", "VV"], "frequency": frequency, "elevation": elevation, "azimuth": azimuth},
    )

    def write(change=lambda data: data):
        change(data).to_zarr("given.zarr", mode="w", zarr_format=2)
        return "given.zarr"

    return write


def test_samples_of_a_store_are_taken_as_they_are(place, given):
    store, values = place(given(), "VV", "HV"), feko.amplitudes(*SWEEP)
    expected = np.stack([values["VV"], values["HV"]]).astype(np.complex64)
    np.testing.assert_array_equal(store.field, expected)
    assert store.attrs["origin"] == {"given.zarr": field_files.digest("given.zarr")}


def test_digest_of_a_store_is_of_names_and_contents(given, tmp_path):
    first = field_files.digest(given())
    shutil.copytree("given.zarr", tmp_path / "copy.zarr")
    assert field_files.digest(tmp_path / "copy.zarr") == first
    chunk = next(path for path in (tmp_path / "copy.zarr" / "field").iterdir() if path.name[0] != ".")
    chunk.write_bytes(chunk.read_bytes()[:-1] + b"\0")
    assert field_files.digest(tmp_path / "copy.zarr") != first


def _spoilt(data):
    data.field[1, 1, 2, 1] = np.nan
    return data


BAD_STORES = {
    "frequency": (lambda d: d.isel(frequency=slice(1, None)), r"no frequency 850000000 Hz.*2e\+09 Hz"),
    "elevation": (lambda d: d.assign_coords(elevation=d.elevation + 0.01), r"no elevation -20, 0, 20, 40 degrees"),
    "azimuth": (lambda d: d.sel(azimuth=d.azimuth != 5), r"no azimuth 5 degrees, .*'aspect.azimuth'"),
    "polarization": (lambda d: d.sel(polarization=["HV"]), r"no polarization VV, .*there is HV"),
    "not finite": (_spoilt, r"1 of 80 samples are not finite; the first is VV at .*, azimuth 17.5 degrees"),
    "other axes": (lambda d: d.isel(elevation=0, drop=True), r"not a store with a variable 'field' over polarization"),
    "other name": (lambda d: d.rename(field="rcs"), r"not a store with a variable 'field'"),
    "other unit": (lambda d: d.assign(field=d.field.assign_attrs(units="dBsm")), r"in 'dBsm', not in m"),
    "magnitudes only": (lambda d: d.assign(field=abs(d.field)), r"field is float32; wanted are complex"),
    "other unit of angles": (
        lambda d: d.assign_coords(azimuth=d.azimuth.assign_attrs(units="radians")),
        r"azimuth is in 'radians', not in degrees",
    ),
    "words for numbers": (lambda d: d.assign_coords(elevation=[f"el{n}" for n in range(5)]), r"not a store with"),
    "other signs": (lambda d: d.assign_attrs(convention="exp(-i omega t)"), r"convention is 'exp\(-i omega t\)'"),
}


@pytest.mark.parametrize("case", BAD_STORES)
def test_bad_store_is_refused(place, given, case):
    change, message = BAD_STORES[case]
    with pytest.raises(InputError, match=r"^given\.zarr: .*" + message) as caught:
        place(given(change), "VV")
    assert "\n" not in str(caught.value)


def test_store_with_a_spoilt_chunk_is_refused(place, given):
    chunk = next(path for path in (Path(given()) / "field").iterdir() if path.name[0] != ".")
    chunk.write_bytes(bytes(chunk.stat().st_size))
    with pytest.raises(InputError, match=r"^given\.zarr: not a store"):
        place("given.zarr", "VV")


CIRCLE = ASPECT | {"azimuth": {"count": 24}}
PATTERNS = {  # of azimuth in rad: symmetric about these planes in V; H, received from V, turns round with the mirror
    "xz": (lambda a: 2 + np.cos(a) + 1j * np.cos(3 * a), np.sin),
    "yz": (lambda a: 2 + np.sin(a) + 1j * np.cos(2 * a), np.cos),
}


def pattern_of(plane):
    """The dataset of a field over CIRCLE that is symmetric about a plane."""
    radians = np.radians(azimuths(CIRCLE))
    values = np.array([function(radians) for function in PATTERNS[plane]])
    field = np.broadcast_to(values[:, None, None], (2, 4, 4, 24)).astype(np.complex64)
    names = ("polarization", "frequency", "elevation", "azimuth")
    axes = dict(zip(names, (["VV", "HV"], SWEEP[0], SWEEP[1], azimuths(CIRCLE)), strict=True))
    return xr.Dataset({"field": (names, field, {"units": "m"})}, axes)


def test_a_symmetric_field_may_be_given_at_half_of_the_azimuths(place):
    whole = pattern_of("xz")
    whole.isel(azimuth=slice(0, 13)).to_zarr("given.zarr", zarr_format=2)  # 0 to 180 degrees
    half = place("given.zarr", "VV", "HV", aspect=CIRCLE, symmetry=["xz"])
    np.testing.assert_allclose(half.field, whole.field, atol=1e-6)  # 3e-7: sines of angles and their opposites
    with pytest.raises(InputError, match=r"^given\.zarr: no azimuth 195, .* degrees"):
        place("given.zarr", "VV", "HV", aspect=CIRCLE)
    whole.isel(azimuth=slice(0, 12)).to_zarr("given.zarr", zarr_format=2, mode="w")
    with pytest.raises(InputError, match=r"^given\.zarr: no azimuth 180 degrees, which config key"):
        place("given.zarr", "VV", "HV", aspect=CIRCLE, symmetry=["xz"])


@pytest.mark.parametrize("plane", PATTERNS)
def test_mirror_planes_are_those_that_the_field_has(place, tmp_path, plane):
    given = pattern_of(plane)
    field = given.field.values
    given.to_zarr("given.zarr", zarr_format=2)
    store = place("given.zarr", "VV", "HV", aspect=CIRCLE, symmetry=[plane])
    np.testing.assert_array_equal(store.field, field)
    other = "yz" if plane == "xz" else "xz"
    with pytest.raises(InputError, match=rf"^given\.zarr: the VV field differs .* in the plane {other} by \d+ % of"):
        place("given.zarr", "VV", "HV", aspect=CIRCLE, symmetry=[plane, other])


def test_folder_that_is_no_store_is_refused(place, tmp_path):
    (tmp_path / "empty.zarr").mkdir()
    with pytest.raises(InputError, match=r"empty\.zarr: not a store"):
        place("empty.zarr")


def test_solved_field_fed_back_gives_the_same_images(tmp_path):
    radar = RADAR | {"center_frequency": 0.5e9, "polarizations": ["VV", "HH"]}
    aspect = {"elevation": {"start": 0, "stop": 30, "step": 30}, "azimuth": {"count": 36}}
    write_ply(tmp_path / "sphere.ply", *mie.icosphere(0.1, 0.1))
    solved, fed = tmp_path / "solved.zarr", tmp_path / "fed.zarr"
    method = {"solver": "mom", "formulation": "efie", "precision": "single", "tolerance": 1e-5}
    solve_band(tmp_path / "sphere.ply", solved, *sweeps(radar, aspect, 1), method, [], 1, "sphere")
    write_external(str(solved), fed, radar, aspect)
    for name in ("field", "frequency", "elevation", "azimuth", "polarization"):
        first, second = xr.open_zarr(solved)[name], xr.open_zarr(fed)[name]
        assert first.values.tobytes() == second.values.tobytes() and first.attrs == second.attrs, name
    imaging = {"imager": "fourier", "aperture": 5, "window": "hamming", "reformat": "polar", "upsample": "none"}
    imaging |= {"polarizations": radar["polarizations"]}
    noise = {"seed": 1, "realizations": 2, "definition": "peak_3db", "per": "image"}
    for path in (solved, fed):
        make_clean(path, path.with_suffix(".clean"), imaging)
        make_noisy(path, [path.with_suffix(".noisy") / "snr_6dB.zarr"], imaging, "sphere", noise)
    for kind in ("clean", "noisy"):
        files = [sorted(p for p in path.with_suffix(f".{kind}").rglob("*") if p.is_file()) for path in (solved, fed)]
        assert len(files[0]) == len(files[1]) > 5
        assert all(a.read_bytes() == b.read_bytes() for a, b in zip(*files, strict=True))
