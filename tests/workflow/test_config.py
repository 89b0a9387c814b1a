"""What the config may say, and what a user reads when it says something else."""

import copy

import pytest

from common.config import ROOT, load, read_yaml, section
from common.errors import InputError


@pytest.fixture(autouse=True)
def in_the_repository(monkeypatch):
    monkeypatch.chdir(ROOT)


@pytest.mark.parametrize("path", sorted((ROOT / "config").glob("*.yaml")), ids=lambda p: p.stem)
def test_shipped_configs_are_valid(path):
    if path.stem != "schema":
        assert load(read_yaml(path))["name"]


def test_overlay_changes_only_what_it_names():
    merged, plain = load({"aspect": {"elevation": {"step": 5}}, "noise": {"realizations": 7}}), load()
    assert merged["aspect"]["elevation"] == {"start": -45, "stop": 45, "step": 5}
    assert merged["noise"]["realizations"] == 7
    assert merged["noise"]["snr_db"] == plain["noise"]["snr_db"]
    assert merged["targets"] == plain["targets"]


def test_overlay_replaces_collections_and_alternatives():
    target = {"mesh": "resources/cad/drone.stl", "role": "known"}
    merged = load(
        {
            "targets": {"mine": target},
            "learning": {"experiments": {}},
            "aspect": {"azimuth": {"start": 0, "stop": 90, "step": 1}},
        }
    )
    assert merged["targets"] == {"mine": target}
    assert merged["learning"]["experiments"] == {}
    assert merged["learning"]["split"]
    assert merged["aspect"]["azimuth"] == {"start": 0, "stop": 90, "step": 1}


def test_a_target_may_have_its_own_formulation():
    config = load({"targets": {"a": {**KNOWN, "formulation": "cfie"}, "b": KNOWN}})
    assert config["targets"]["a"]["formulation"] == "cfie"
    assert config["scattering"]["formulation"] == "efie"


def test_exponents_without_a_sign_are_numbers():
    assert load()["radar"]["center_frequency"] == 2.775e9
    assert load({"radar": {"bandwidth": "1e9"}})["radar"]["bandwidth"] == 1e9


def test_section_does_not_depend_on_order():
    config = load()
    backwards = {
        key: dict(reversed(list(value.items()))) if isinstance(value, dict) else value for key, value in config.items()
    }
    assert repr(section(config, "radar", "aspect")) == repr(section(backwards, "aspect", "radar"))


KNOWN = {"mesh": "resources/cad/drone.stl", "role": "known"}
BAD = {
    "unknown key": ({"radar": {"bandwith": 1e9}}, "radar.bandwith", "did you mean 'bandwidth'"),
    "unknown section": ({"nosie": {}}, "nosie", "did you mean 'noise'"),
    "negative bandwidth": ({"radar": {"bandwidth": -1}}, "radar.bandwidth", "-1"),
    "SNR as text": ({"noise": {"snr_db": [0, "six"]}}, "noise.snr_db.1", "'six'"),
    "SNR twice": ({"noise": {"snr_db": [0, 3, 3.0]}}, "noise.snr_db", "non-unique"),
    "no SNR": ({"noise": {"snr_db": []}}, "noise.snr_db", "[]"),
    "missing mesh": ({"targets": {"a": {"mesh": "no/such.stl", "role": "known"}}}, "targets.a.mesh", "no/such.stl"),
    "not a mesh": ({"targets": {"a": {"mesh": "README.md", "role": "known"}}}, "targets.a.mesh", ".stl"),
    "mesh left out": ({"targets": {"a": {"role": "known"}}}, "targets.a.mesh", "missing"),
    "role": ({"targets": {"a": {**KNOWN, "role": "friend"}}}, "targets.a.role", "known"),
    "symmetry": ({"targets": {"a": {**KNOWN, "symmetry": ["xy"]}}}, "targets.a.symmetry", "xz"),
    "formulation": ({"targets": {"a": {**KNOWN, "formulation": "mfie"}}}, "targets.a.formulation", "of this target"),
    "target name": ({"targets": {"a-b": KNOWN}}, "targets", "a-b"),
    "no targets": ({"targets": {}}, "targets", "{}"),
    "section is a number": ({"radar": 5}, "radar", "5"),
    "section is empty": ({"radar": None}, "radar", "None"),
    "even aperture": ({"imaging": {"aperture": 10}}, "imaging.aperture", "odd"),
    "aperture too long": ({"imaging": {"aperture": 201}}, "imaging.aperture", "121"),
    "window": ({"imaging": {"window": "haming"}}, "imaging.window", "hamming"),
    "zero step": ({"aspect": {"elevation": {"step": 0}}}, "aspect.elevation.step", "0"),
    "stop below start": ({"aspect": {"elevation": {"stop": -50}}}, "aspect.elevation", "-50"),
    "steps that miss the stop": ({"aspect": {"elevation": {"step": 7}}}, "aspect.elevation", "39"),
    "elevation too high": ({"aspect": {"elevation": {"stop": 100}}}, "aspect.elevation", "90"),
    "half an azimuth": ({"aspect": {"azimuth": {"start": 3}}}, "aspect.azimuth", "step"),
    "azimuth over 360": ({"aspect": {"azimuth": {"start": 0, "stop": 360, "step": 3}}}, "aspect.azimuth", "count"),
    "bandwidth over the centre": ({"radar": {"bandwidth": 6e9}}, "radar.bandwidth", "center_frequency"),
    "one frequency with bandwidth": ({"radar": {"frequencies": 1}}, "radar.bandwidth", "0"),
    "frequencies without bandwidth": ({"radar": {"bandwidth": 0}}, "radar.bandwidth", "frequencies"),
    "polarization": ({"radar": {"polarizations": ["RR"]}}, "radar.polarizations.0", "VV"),
    "seed as text": ({"seed": "abc"}, "seed", "'abc'"),
    "split": ({"learning": {"split": {"train": 1.5}}}, "learning.split.train", "1.5"),
    "model": (
        {"learning": {"experiments": {"e": {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["svn"]}}}},
        "learning.experiments.e.models.0",
        "svm",
    ),
    "training SNR not tested": (
        {"learning": {"experiments": {"e": {"train": {"elevation": "all", "snr_db": 1}, "models": ["lr"]}}}},
        "learning.experiments.e.train.snr_db",
        "noise.snr_db",
    ),
    "training elevation not swept": (
        {"learning": {"experiments": {"e": {"train": {"elevation": [7], "snr_db": "clean"}, "models": ["lr"]}}}},
        "learning.experiments.e.train.elevation",
        "7",
    ),
    "not a number": ({"radar": {"bandwidth": float("nan")}}, "radar.bandwidth", "finite"),
    "SNR not a number": ({"noise": {"snr_db": [0, float("nan")]}}, "noise.snr_db.1", "finite"),
    "aperture too wide": ({"imaging": {"aperture": 61}}, "imaging.reformat", "imaging.aperture"),
    "aperture that keeps little bandwidth": ({"imaging": {"aperture": 37}}, "imaging.reformat", "of the bandwidth"),
    "too few pixels": ({"imaging": {"upsample": 13}}, "imaging.upsample", "14 samples"),
    "one pixel": ({"imaging": {"upsample": 1}}, "imaging.upsample", "3 to 128"),
    "too many pixels": ({"imaging": {"upsample": 100_000}}, "imaging.upsample", "3 to 128"),
    "pixels as text": ({"imaging": {"upsample": "64"}}, "imaging.upsample", "3 to 128"),
    "pixels of both axes": ({"imaging": {"upsample": [64, 64]}}, "imaging.upsample", "3 to 128"),
    "pixels as yes": ({"imaging": {"upsample": True}}, "imaging.upsample", "3 to 128"),
    "window without ends": ({"imaging": {"aperture": 3, "window": "hann"}}, "imaging.window", "of 3 samples"),
    "SNRs of one name": ({"noise": {"snr_db": [1.0, 1.0000001]}}, "noise.snr_db", "snr_1dB"),
    "nothing left to test": ({"learning": {"split": {"train": 0.001}}}, "learning.split.train", "0 to train"),
    "one class": ({"targets": {"a": KNOWN}}, "learning.experiments", "two targets"),
}


BAD_FIELDS = {
    "both": ({"mesh": "resources/cad/drone.stl", "field": "a.ffe"}, "targets.a.field", "either a 'mesh'"),
    **{
        key: ({"field": "a.ffe", key: value}, f"targets.a.{key}", "leave it out")
        for key, value in {
            "unit": "mm",
            "rotate": [0, 0, 90],
            "length": 1,
            "symmetry": ["xz"],
            "formulation": "cfie",
        }.items()
    },
    "misspelt": ({"feild": "a.ffe"}, "targets.a.feild", "did you mean 'field'"),
    "number": ({"field": 5}, "targets.a.field", "instead of mesh"),
    "polarization": ({"field": {"VV": "a.ffe"}}, "targets.a.field", "each incident polarization"),
    "empty list": ({"field": []}, "targets.a.field", "one or more"),
    "missing file": ({"field": "no/such.ffe"}, "targets.a.field", "no file no/such.ffe"),
    "missing store": ({"field": "no/such.zarr"}, "targets.a.field", "no store no/such.zarr"),
    "another file": ({"field": "README.md"}, "targets.a.field", ".ffe, .zarr"),
    "list of stores": ({"field": ["a.zarr", "b.zarr"]}, "targets.a.field", "named alone"),
    "not transmitted": ({"field": {"H": "here.ffe"}}, "targets.a.field", "incident waves in V"),
    "own results": ({"field": "results/mine/scattering/a.zarr"}, "targets.a.field", "copy it elsewhere"),
}


@pytest.mark.parametrize("case", BAD_FIELDS)
def test_bad_field_is_refused_with_its_key(case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here.ffe").touch()
    (tmp_path / "README.md").touch()
    (tmp_path / "results/mine/scattering/a.zarr").mkdir(parents=True)
    target, key, hint = BAD_FIELDS[case]
    with pytest.raises(InputError) as caught:
        load({"name": "mine", "targets": {"a": {**target, "role": "other"}}, "learning": {"experiments": {}}})
    assert f"'{key}'" in str(caught.value)
    assert hint in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("field", ["here.ffe", ["here.ffe"], {"V": "here.ffe"}, {"V": ["here.ffe"], "H": "here.ffe"}])
def test_a_target_may_be_a_field(field, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here.ffe").touch()
    targets = {"a": {"field": field, "role": "other"}}
    assert load({"targets": targets, "learning": {"experiments": {}}})["targets"] == targets


@pytest.mark.parametrize("case", BAD)
def test_bad_config_is_refused_with_its_key(case):
    overlay, key, hint = BAD[case]
    with pytest.raises(InputError) as caught:
        load(overlay)
    message = str(caught.value)
    assert key in message
    assert hint in message
    assert "\n" not in message


def test_loading_leaves_the_overlay_alone():
    overlay = {"mesh": {"bands": 9}, "radar": {"frequencies": 3}}
    before = copy.deepcopy(overlay)
    assert load(overlay)["mesh"]["bands"] == 3  # never more bands than frequencies
    assert overlay == before


def test_key_that_stands_twice_is_refused(tmp_path):
    file = tmp_path / "twice.yaml"
    file.write_text("radar: {bandwidth: 1}\nname: a\nradar: {bandwidth: 2}\n")
    with pytest.raises(InputError, match=r"twice.yaml, line 3: the key 'radar' stands twice"):
        load({}, [file])


def test_bad_syntax_is_refused_with_its_line(tmp_path):
    file = tmp_path / "bad.yaml"
    file.write_text("name: a\nradar: [1, 2\n")
    with pytest.raises(InputError, match=r"bad.yaml, line 3"):
        read_yaml(file)


def test_order_of_snrs_has_no_meaning():
    assert load({"noise": {"snr_db": [5, -5]}}) == load({"noise": {"snr_db": [-5, 5]}})
