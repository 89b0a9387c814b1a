"""What the config may say, and what a user reads when it says something else."""

import copy
import datetime
import re

import pytest

from isarflow.core.errors import InputError, refusal
from isarflow.core.kinds import MODELS
from isarflow.learning.caveats import warnings
from isarflow.learning.experiments import runs
from isarflow.scattering.needs import method
from isarflow.setup.artefacts import Plan
from isarflow.setup.config import ROOT, load_config, section
from isarflow.setup.overview import overview
from isarflow.setup.yaml_file import read_yaml

# Overlays that lie over another than the default.
OVER = {
    "kinds": "families-fields",
    "variant": "families-fields",
    "flyers-metal": "flyers",
    "flight-metal": "flight",
    "flight-otherwise": "flight",
    "recommended-models": "flight",
}


@pytest.fixture(autouse=True)
def in_the_repository(monkeypatch):
    monkeypatch.chdir(ROOT)


@pytest.mark.parametrize("path", sorted((ROOT / "config").glob("*.yaml")), ids=lambda p: p.stem)
def test_shipped_configs_are_valid(path):
    below = [read_yaml(path.with_name(f"{OVER[path.stem]}.yaml"))] if path.stem in OVER else []
    if path.stem not in ("schema", "materials"):
        assert load_config(*below, read_yaml(path))["name"] == read_yaml(path)["name"]


def test_a_target_may_have_its_own_formulation():
    config = load_config({"targets": {"a": {**KNOWN, "formulation": "cfie"}, "b": KNOWN}})
    assert config["targets"]["a"]["formulation"] == "cfie"
    assert config["scattering"]["formulation"] == "efie"


def test_a_material_has_its_numbers_written_out():
    config = load_config(of_material({"name": "abs", "thickness": 0.0015}))
    material = {"name": "abs", "permittivity": 2.7, "loss_tangent": 0.008, "thickness": 0.0015}
    assert method(config, "a")["material"] == config["targets"]["a"]["material"] == material
    assert "material" not in method(config, "drone")
    assert load_config(of_material("space_cloth"))["targets"]["a"]["material"]["resistance"] == 376.73


def test_parts_of_one_file_have_a_rest_of_metal():
    targets = {"targets": {"a": {"role": "other", "mesh": DRONE, "parts": {"shell": ABS, "motors": {}}}}}
    config = load_config(targets)
    assert [*method(config, "a")["parts"]] == ["motors", "rest", "shell"]
    assert config["targets"]["a"]["mesh"] == DRONE and config["targets"]["a"]["parts"]["rest"] == {}
    targets["targets"]["a"]["parts"]["rest"] = ABS
    assert load_config(targets)["targets"]["a"]["parts"]["rest"] == config["targets"]["a"]["parts"]["shell"]


def test_parts_have_materials_of_their_own():
    config = load_config(of_parts(shell={**ABS, "mesh": DRONE}, motors={"mesh": DRONE}, wires={"mesh": DRONE}))
    shell = {"name": "abs", "permittivity": 2.7, "loss_tangent": 0.008, "thickness": 0.0015}
    assert method(config, "a")["parts"] == {"motors": {}, "shell": {"material": shell}, "wires": {}}
    assert config["targets"]["a"]["parts"]["shell"] == {"mesh": DRONE, "material": shell}
    # Of metal alone they are solved as one mesh is, by every solver.
    metal = {"a": {"mesh": DRONE, "material": "pec"}, "b": {"mesh": DRONE}}
    assert "parts" not in method(load_config({**of_parts(**metal), "scattering": {"solver": "po"}}), "a")


def test_a_material_s_numbers_are_checked_in_its_file_too(tmp_path, monkeypatch):
    (tmp_path / "materials.yaml").write_text("foam: {permittivity: 0.9, loss_tangent: 0}")
    monkeypatch.setattr("isarflow.setup.materials.CATALOGUE", tmp_path / "materials.yaml")
    with pytest.raises(InputError, match=r"'targets\.a\.material\.permittivity': 0\.9 is less than"):
        load_config(of_material({"name": "foam", "thickness": 0.01}))


def test_numbers_of_a_material_s_file_may_have_exponents(tmp_path, monkeypatch):
    (tmp_path / "materials.yaml").write_text("film: {conductivity: 5.8e7, thickness: 1e-7}")
    monkeypatch.setattr("isarflow.setup.materials.CATALOGUE", tmp_path / "materials.yaml")
    assert load_config(of_material("film"))["targets"]["a"]["material"]["conductivity"] == 5.8e7


def test_metal_by_name_is_solved_as_metal_is():
    for settings in ({"formulation": "cfie"}, {"solver": "po"}):
        load_config({**of_material("pec"), "scattering": settings})


def test_what_a_material_lacks_is_said_of_the_form_that_it_has():
    said = refusal(load_config, of_material({"permittivity": 2.9}))
    assert "material.loss_tangent' is missing" in said and "has none" not in said


def test_a_thick_film_is_metal_only_if_it_reflects_like_metal():
    copper, poor = ({"conductivity": of, "thickness": 2e-2} for of in (5.8e7, 1.0))
    assert "like metal" in refusal(load_config, of_material(copper)) and "like metal" not in refusal(
        load_config, of_material(poor)
    )


@pytest.mark.parametrize("name", read_yaml(ROOT / "config/materials.yaml"))
def test_every_named_material_is_a_sheet(name):
    tried = {"name": name}, {"name": name, "thickness": 1e-4}
    assert "" in [refusal(load_config, of_material(material)) for material in tried]


@pytest.mark.parametrize("name", ["muscle", "skin", "water"])
def test_tissues_may_be_opaque(name):
    material = load_config(of_material({"name": name, "surface": "leontovich"}))["targets"]["a"]["material"]
    assert material["permittivity"] > 30 and material["surface"] == "leontovich"


def test_exponents_without_a_sign_are_numbers():
    assert load_config()["radar"]["center_frequency"] == 2.775e9
    assert load_config({"radar": {"bandwidth": "1e9"}})["radar"]["bandwidth"] == 1e9


def test_section_does_not_depend_on_order():
    config = load_config()
    backwards = {
        key: dict(reversed(list(value.items()))) if isinstance(value, dict) else value for key, value in config.items()
    }
    assert repr(section(config, "radar", "aspect")) == repr(section(backwards, "aspect", "radar"))


def one_experiment(elevation="all", snr_db="clean", models=("lr",), **more):
    experiment = {"train": {"elevation": elevation, "snr_db": snr_db}, "models": list(models), **more}
    return {"learning": {"experiments": {"e": experiment}}}


DRONE, ABS = "resources/cad/drone.stl", {"material": {"name": "abs", "thickness": 0.0015}}


def of_parts(**parts):
    return {"targets": {"a": {"role": "other", "parts": parts}}}


def of_material(material):
    return {"targets": {"a": {**KNOWN, "material": material}}}


NARROW = {"start": 0, "stop": 60, "step": 3}
KNOWN = {"mesh": "resources/cad/drone.stl", "role": "known"}
BAD = {
    "unknown key": ({"radar": {"bandwith": 1e9}}, "radar.bandwith", "did you mean 'bandwidth'"),
    "unknown section": ({"nosie": {}}, "nosie", "did you mean 'noise'"),
    "unknown motion": ({"motion": {"jiter": 0.1}}, "motion.jiter", "did you mean 'jitter'"),
    "negative displacement": ({"motion": {"place": -0.1}}, "motion.place", "-0.1 is less than the minimum of 0"),
    "too many pulses lost": (
        one_experiment(motion={"missing": 0.79}),
        "learning.experiments.e.motion.missing",
        "8.7 of 11",
    ),
    "a turn on an arc": (
        {"motion": {"turn": 0.1}, "aspect": {"azimuth": NARROW}},
        "motion.turn",
        "takes a sweep over a whole circle",
    ),
    "motion without images": (
        {"motion": {"place": 0.1}, "aspect": {"azimuth": [0, 20, 50]}},
        "motion",
        "there are none",
    ),
    "motion in images of points": (
        {
            "imaging": {"imager": "esprit", "pixels": 4, "scatterers": 20},
            **one_experiment(motion={"place": 0.1}),
        },
        "learning.experiments.e.motion",
        "not linear",
    ),
    "motion of the section in images of points": (
        {
            "imaging": {"imager": "esprit", "pixels": 4, "scatterers": 20},
            "motion": {"place": 0.1},
            **one_experiment(),
        },
        "motion",
        "not linear",
    ),
    "an unknown way to a place": (
        {"learning": {"models": {"zncc": {"place": "guess"}}}},
        "learning.models.zncc.place",
        "'guess' is not one of ['search', 'known']",
    ),
    "triangles as drawn, for currents": ({"mesh": {"remesh": False}}, "mesh.remesh", "take po or sbr"),
    "a range of SNRs that descends": (
        {"noise": {"snr_db": {"start": 6, "stop": 0}}},
        "noise.snr_db",
        "start 6 to stop 0",
    ),
    "a range of SNRs that misses its stop": ({"noise": {"snr_db": {"stop": 23}}}, "noise.snr_db", "end at 21"),
    "an endless range of SNRs": ({"noise": {"snr_db": {"step": 1e-9}}}, "noise.snr_db", "more than 201 values"),
    "ranges of too many SNRs": (
        {"noise": {"snr_db": [{"start": -100, "stop": 99.5, "step": 1.5}, {"start": -99.9, "stop": 0, "step": 1.11}]}},
        "noise.snr_db",
        "more than 201 entries",
    ),
    "a range of SNRs misspelt": ({"noise": {"snr_db": {"stpo": 3}}}, "noise.snr_db.stpo", "did you mean 'stop'?"),
    "a range in a list misspelt": (
        {"noise": {"snr_db": [0, {"start": 3, "stpo": 6, "step": 3}]}},
        "noise.snr_db.1.stpo",
        "did you mean 'stop'?",
    ),
    "an SNR in a range and beside it": (
        {"noise": {"snr_db": [0, {"start": -3, "stop": 3, "step": 3}]}},
        "noise.snr_db",
        "0 stands twice",
    ),
    "all SNRs of itself": ({"noise": {"snr_db": "all"}}, "noise.snr_db", "'all' is not allowed"),
    "a range without a step to train at": (
        one_experiment(snr_db={"start": 0, "stop": 6}),
        "learning.experiments.e.train.snr_db",
        "step",
    ),
    "a range to train at of untested SNRs": (
        one_experiment(snr_db={"random": {"start": 0, "stop": 2, "step": 1}}, models=["fcnn"]),
        "learning.experiments.e.train.snr_db",
        "1 is none of 'noise.snr_db'",
    ),
    "fields from itself": ({"name": "mine", "from": "mine"}, "'from'", "another run"),
    "fields from a path": ({"name": "mine", "from": "../quick"}, "'from'", "a letter, then letters"),
    "negative bandwidth": ({"radar": {"bandwidth": -1}}, "radar.bandwidth", "-1"),
    "SNR as text": ({"noise": {"snr_db": [0, "six"]}}, "noise.snr_db.1", "'six'"),
    "SNR twice": ({"noise": {"snr_db": [0, 3, 3.0]}}, "noise.snr_db", "3 stands twice in the list"),
    "no SNR": ({"noise": {"snr_db": []}}, "noise.snr_db", "[]"),
    "missing mesh": ({"targets": {"a": {"mesh": "no/such.stl", "role": "known"}}}, "targets.a.mesh", "no/such.stl"),
    "not a mesh": ({"targets": {"a": {"mesh": "README.md", "role": "known"}}}, "targets.a.mesh", ".stl"),
    "mesh left out": ({"targets": {"a": {"role": "known"}}}, "targets.a.mesh", "missing"),
    "role": ({"targets": {"a": {**KNOWN, "role": "friend"}}}, "targets.a.role", "known"),
    "symmetry": ({"targets": {"a": {**KNOWN, "symmetry": ["zx"]}}}, "targets.a.symmetry", "xz"),
    "formulation": ({"targets": {"a": {**KNOWN, "formulation": "mfie"}}}, "targets.a.formulation", "of this target"),
    "material": (of_material("abs_"), "targets.a.material", "no material 'abs_'; did you mean 'abs'?"),
    "material that is a number": (of_material(377), "targets.a.material", "a name of config/materials.yaml"),
    "a film without thickness": (
        of_material({"conductivity": 1e4}),
        "targets.a.material.thickness",
        "that of the film",
    ),
    "material of no form": (of_material({"thickness": 1e-3}), "targets.a.material.conductivity", "missing"),
    "material of two forms": (
        of_material({"resistance": 5, "thickness": 1e-3}),
        "targets.a.material.thickness",
        "a material with resistance has none",
    ),
    "negative thickness": (of_material({"name": "abs", "thickness": -1e-3}), "targets.a.material.thickness", "above 0"),
    "a gain": (of_material({"name": "abs", "loss_tangent": -0.1}), "targets.a.material.loss_tangent", "gives power"),
    "negative resistance": (of_material({"resistance": -5}), "targets.a.material.resistance", "ohm a square"),
    "a film thicker than its skin depth": (
        of_material({"conductivity": 1e4, "thickness": 1e-3}),
        "targets.a.material.thickness",
        "1 mm is more than its skin depth at 3.525 GHz, 0.0848 mm",
    ),
    "a wall too thick": (
        of_material({"name": "abs", "thickness": 0.01}),
        "targets.a.material.thickness",
        "10 mm is more than a tenth of the wavelength in it at 3.525 GHz",
    ),
    "a part's material": (
        of_parts(b={"mesh": DRONE, "material": "abs_"}),
        "targets.a.parts.b.material",
        "did you mean 'abs'?",
    ),
    "a part's gain": (
        of_parts(b={"mesh": DRONE, "material": {"name": "abs", "loss_tangent": -1}}),
        "targets.a.parts.b.material.loss_tangent",
        "gives power",
    ),
    "a part's wall": (of_parts(b={"mesh": DRONE, "material": "abs"}), "targets.a.parts.b.material.thickness", "solid"),
    "a part's file": (of_parts(b={"mesh": "no.stl"}), "targets.a.parts.b.mesh", "there is no file no.stl"),
    "no parts": (of_parts(), "targets.a.parts", "the parts of a target by name"),
    "a part by cfie": (
        {"scattering": {"formulation": "cfie"}, **of_parts(b={"mesh": DRONE, **ABS})},
        "targets.a.parts.b.material",
        "'formulation: efie' alone",
    ),
    "a part by physical optics": (
        {"scattering": {"solver": "po"}, **of_parts(b={"mesh": DRONE, **ABS})},
        "targets.a.parts.b.material",
        "perfect conductors alone",
    ),
    "parts of a material": (
        {"targets": {"a": {"role": "other", "material": "pec", "parts": {"b": {"mesh": DRONE}}}}},
        "targets.a.material",
        "each of the 'parts' has its own",
    ),
    "poses of parts in one file": (
        {"targets": {"a": {"role": "other", "mesh": DRONE, "parts": {"b": {"poses": [DRONE, DRONE]}}}}},
        "targets.a.parts.b.poses",
        "the file of all its 'parts'",
    ),
    "parts beside poses": (
        {"targets": {"a": {"role": "other", "poses": [DRONE, DRONE], "parts": {"b": {}}}}},
        "targets.a.parts",
        "one of 'mesh'",
    ),
    "a part's file beside the target's": (
        {"targets": {"a": {"role": "other", "mesh": DRONE, "parts": {"b": {"mesh": DRONE}}}}},
        "targets.a.parts.b.mesh",
        "the file of all its 'parts'",
    ),
    "material by cfie": (
        {"scattering": {"formulation": "cfie"}, **of_material({"resistance": 377})},
        "targets.a.material",
        "'formulation: efie' alone",
    ),
    "material by physical optics": (
        {"scattering": {"solver": "po"}, **of_material({"resistance": 377})},
        "targets.a.material",
        "the solver 'po' has perfect conductors alone",
    ),
    "a coating by cfie": (
        {"scattering": {"formulation": "cfie"}, **of_material({"name": "skin", "thickness": 1e-4, "backing": "metal"})},
        "targets.a.material",
        "surface impedances are solved by 'formulation: efie' alone",
    ),
    "an opaque body of low contrast": (
        of_material({"name": "abs", "surface": "leontovich"}),
        "targets.a.material.surface",
        "has 2.5 or more, and here the refractive index is 1.64",
    ),
    "a thick coating": (
        of_material({"name": "abs", "thickness": 0.0015, "backing": "metal"}),
        "targets.a.material.thickness",
        "1.5 mm is more than a thin coating of this permittivity has at",
    ),
    "a coating of nothing": (
        of_material({"resistance": 5, "backing": "metal"}),
        "targets.a.material.backing",
        "a material with resistance has none",
    ),
    "name that is a date": ({"name": datetime.date(2024, 1, 1)}, "'name'", "2024-01-01 (to YAML a date; in quotes"),
    "name that is true": ({"targets": {True: KNOWN}}, "targets.True", "true is not text; put it in quotes"),
    "an SNR twice": ({"noise": {"snr_db": [0, 6, 0]}}, "noise.snr_db", "0 stands twice in the list"),
    "dotted key": ({"radar.bandwidth": 1e9}, "radar.bandwidth", "did you mean 'radar: {bandwidth: ...}'?"),
    "decimal comma": ({"radar": {"center_frequency": 2, "5e9": None}}, "radar.5e9", "is unknown"),
    "target name with a space": ({"targets": {"a b": KNOWN}}, "targets", "a b"),
    "target name that ends with a dot": ({"targets": {"a.": KNOWN}}, "targets", "a."),
    "target name that begins with a hyphen": ({"targets": {"-a": KNOWN}}, "targets", "-a"),
    "name of the images of noise": ({"targets": {"pure-noise": KNOWN}}, "targets.pure-noise", "images of noise alone"),
    "too many SNRs": (
        {"noise": {"snr_db": [n / 100 for n in range(10_000)]}},
        "noise.snr_db",
        "... is too long. Expected: signal-to-noise",
    ),
    "target name": ({"targets": {"a/b": KNOWN}}, "targets", "a/b"),
    "no targets": ({"targets": {}}, "targets", "{}"),
    "no targets left": ({"targets": {"*": None}}, "targets", "{}"),
    "remove a target that is not there": ({"targets": {"uffo": None}}, "targets.uffo", "did you mean 'ufo'?"),
    "remove a model that is not there": (
        {"learning": {"models": {"svn": None}}},
        "learning.models.svn",
        "did you mean 'svm'?",
    ),
    "remove an experiment that is not there": (
        {"learning": {"experiments": {"sectors": None}}},
        "learning.experiments.sectors",
        "did you mean 'sector'?",
    ),
    "remove what a target does not say": (
        {"targets": {"ufo": {"simmetry": None}}},
        "targets.ufo.simmetry",
        "did you mean 'symmetry'?",
    ),
    "remove what a target needs": ({"targets": {"ufo": {"role": None}}}, "targets.ufo.role", "missing"),
    "everything as a target": ({"targets": {"*": KNOWN}}, "targets.*", "takes null alone"),
    "several as a target": ({"targets": {"u*": KNOWN}}, "targets.u*", "takes null alone"),
    "remove targets of which none is there": ({"targets": {"x*": None}}, "targets.x*", "no name here is like 'x*'"),
    "section is a number": ({"radar": 5}, "radar", "5"),
    "section is empty": ({"radar": None}, "radar", "nothing is not of type 'object'"),
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
    "seed as a number of YAML's with a fraction": ({"seed": 2.2e9}, "seed", "a whole number"),
    "split": ({"learning": {"split": {"train": 1.5}}}, "learning.split.train", "1.5"),
    "validation": ({"learning": {"split": {"validation": 0}}}, "learning.split.validation", "0"),
    "scheme": ({"learning": {"split": {"scheme": "sectors"}}}, "learning.split.scheme", "sector (arcs"),
    "model": (one_experiment(models=["svn"]), "learning.experiments.e.models", "did you mean 'svm'"),
    "model without a file": ({"learning": {"models": {"mine": {}}}}, "learning.models.mine", "mine.py"),
    "kind": ({"learning": {"models": {"mine": {"kind": "fcn"}}}}, "learning.models.mine.kind", "did you mean 'fcnn'"),
    "hyper-parameter": ({"learning": {"models": {"knn": {"kk": 1}}}}, "learning.models.knn.kk", "did you mean 'k'"),
    "hyper-parameter of a kind": (
        {"learning": {"models": {"mine": {"kind": "svm", "C": -1}}}},
        "learning.models.mine.C",
        "box constraint",
    ),
    "one of several values": (
        {"learning": {"models": {"lr_tuned": {"penalty": [1, "high"]}}}},
        "learning.models.lr_tuned.penalty",
        "'high' is not of type 'number'",
    ),
    "no values": ({"learning": {"models": {"lr_tuned": {"penalty": []}}}}, "learning.models.lr_tuned.penalty", "empty"),
    "kind is a list": ({"learning": {"models": {"mine": {"kind": ["lr"]}}}}, "learning.models.mine.kind", "['lr']"),
    "a key that is a number": ({"learning": {"models": {"knn": {3: 4}}}}, "learning.models.knn", "3 is not text"),
    "settings are a number": ({"learning": {"models": {"knn": 3}}}, "learning.models.knn", "3"),
    "training SNR not tested": (one_experiment(snr_db=1), "learning.experiments.e.train.snr_db", "noise.snr_db"),
    "one of several SNRs": (
        one_experiment(snr_db={"each": [0, 1]}),
        "learning.experiments.e.train.snr_db",
        "1 is none of 'noise.snr_db'",
    ),
    "how SNRs are used": (one_experiment(snr_db={"any": [0]}), "learning.experiments.e.train.snr_db", "{each: list}"),
    "no training SNR": (one_experiment(snr_db=[]), "learning.experiments.e.train.snr_db", "[]"),
    "an SNR a batch for a model without": (
        one_experiment(snr_db={"random": [0]}),
        "learning.experiments.e.train.snr_db",
        "lr does not keep the SNRs",
    ),
    "training elevation not swept": (one_experiment(elevation=[7]), "learning.experiments.e.train.elevation", "7"),
    "open": (one_experiment(open="yes"), "learning.experiments.e.open", "unknown targets"),
    "split of an experiment": (one_experiment(split="half"), "learning.experiments.e.split", "sector (arcs"),
    "images too small for a capsule network": (
        one_experiment(models=["capsule"]),
        "learning.experiments.e.upsample",
        "capsule needs 17 pixels a side or more, these images have 11; 32 is usual",
    ),
    "images too large for a covariance": (
        one_experiment(models=["adaptive_filter"], snr_db={"random": [0, 6]}, upsample=128),
        "learning.experiments.e.upsample",
        "these images have 49152; 4096 (64 a side) are the most",
    ),
    "nothing to denoise towards": (
        one_experiment(models=["capsule_denoise"], snr_db={"random": [0, 6]}, upsample=32),
        "learning.experiments.e.train.snr_db",
        "{random: [clean, ...]}",
    ),
    "a denoising network without noise": (
        one_experiment(models=["capsule_denoise"], upsample=32),
        "learning.experiments.e.train.snr_db",
        "{random: [clean, ...]}",
    ),
    "to denoise, or not": (
        {
            "learning": {
                "models": {"capsule": {"denoise": [False, True]}},
                **one_experiment(models=["capsule"], upsample=32)["learning"],
            }
        },
        "learning.experiments.e.train.snr_db",
        "{random: [clean, ...]}",
    ),
    "routings": ({"learning": {"models": {"capsule": {"routings": 0}}}}, "learning.models.capsule.routings", "routing"),
    "a misspelt size": (
        {"learning": {"models": {"capsule": {"widht": 3}}}},
        "learning.models.capsule.widht",
        "'width'",
    ),
    "complex as a number": (
        {"learning": {"models": {"capsule": {"complex": 1}}}},
        "learning.models.capsule.complex",
        "1 is not of type 'boolean'",
    ),
    "decay": ({"learning": {"models": {"capsule": {"decay": 1.1}}}}, "learning.models.capsule.decay", "learning rate"),
    "loading": ({"learning": {"models": {"adaptive_filter": {"loading": -1}}}}, "loading", "mean eigenvalue"),
    "upsample": (one_experiment(upsample=2), "learning.experiments.e.upsample", "pixels a side"),
    "upsample below the image": (one_experiment(upsample=10), "learning.experiments.e.upsample", "11"),
    "no room for sectors": (
        {"aspect": {"azimuth": NARROW}, **one_experiment(split="sector")},
        "learning.split.folds",
        "10 as a guard",
    ),
    "a fold too many": (
        one_experiment(split="sector", folds=[2, 7]),
        "learning.experiments.e.folds",
        "fold 7 is none of 6",
    ),
    "folds of the other split": (
        one_experiment(folds=[2]),
        "learning.experiments.e.folds",
        "only the splits by sector",
    ),
    "a third fold by elevation": (
        one_experiment(split="elevation", folds=[3]),
        "learning.experiments.e.folds",
        "fold 3 is none of 2.",
    ),
    "too few elevations": (
        {"aspect": {"elevation": {"step": 45}}, **one_experiment(split="elevation")},
        "aspect.elevation",
        "every second trains and the others validate and test by turns; the sweep has 3",
    ),
    "too few elevations so far apart": (
        {"learning": {"split": {"spacing": 35}, **one_experiment(split="elevation")["learning"]}},
        "aspect.elevation",
        "('learning.split.spacing'), of which",
    ),
    "elevations of the split and others": (
        one_experiment([0], split="elevation"),
        "learning.experiments.e.train.elevation",
        "write all",
    ),
    "elevations a right angle apart": (
        {"learning": {"split": {"spacing": 91}}},
        "learning.split.spacing",
        "by elevation",
    ),
    "one fold": ({"learning": {"split": {"folds": 1}}}, "learning.split.folds", "by sector"),
    "realizations": ({"learning": {"realizations": "none"}}, "learning.realizations", "models are tested on"),
    "whose noise": ({"noise": {"per": "target"}}, "noise.per", "overlapping apertures"),
    "a target named other": ({"targets": {"other": KNOWN}}, "targets.other", "another name"),
    "runs of one name": (
        {
            "learning": {
                "experiments": {
                    "e": {"train": {"elevation": "all", "snr_db": {"each": [0]}}, "models": ["lr"]},
                    "e_snr_0dB": {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["lr"]},
                }
            }
        },
        "learning.experiments",
        "give one another name",
    ),
    "not a number": ({"radar": {"bandwidth": float("nan")}}, "radar.bandwidth", "nan is not of type 'number'"),
    "SNR not a number": ({"noise": {"snr_db": [0, float("nan")]}}, "noise.snr_db.1", "nan is not allowed"),
    "a range of SNRs of no number": (
        {"noise": {"snr_db": {"step": float("nan")}}},
        "noise.snr_db.step",
        "nan is not of type 'number'",
    ),
    "no such imager": ({"imaging": {"imager": "furier"}}, "imaging.imager", "did you mean 'fourier'?"),
    "imager of no name": ({"imaging": {"imager": [1]}}, "imaging.imager", "There are: centres, esprit, fourier"),
    "key of no imager": (
        {"imaging": {"looks": 3}},
        "imaging.looks",
        "aperture, focus, imager, polarizations, reformat, upsample, window",
    ),
    "no such focus method": ({"imaging": {"focus": "entropie"}}, "imaging.focus", "did you mean 'entropy'?"),
    "focus of no method": ({"imaging": {"focus": {"error": "pulse"}}}, "imaging.focus.method", "is missing"),
    "no file of a focus method": ({"imaging": {"focus": "mine/none.py"}}, "imaging.focus", "no file mine/none.py"),
    "a file of another seam": (
        {"imaging": {"focus": "isarflow/imaging/imagers/sparse.py"}},
        "imaging.focus",
        "no class Focus with method focus",
    ),
    "setting of a focus method": (
        {"imaging": {"focus": {"method": "entropy", "error": "pulses"}}},
        "imaging.focus.error",
        "did you mean 'pulse'",
    ),
    "setting of no focus method": (
        {"imaging": {"focus": {"method": "none", "error": "pulse"}}},
        "imaging.focus.error",
        "is unknown. Known keys here: method.",
    ),
    "channel that is not solved": (
        {"radar": {"polarizations": ["VV"]}, "imaging": {"polarizations": ["VV", "HV"]}},
        "imaging.polarizations",
        "HV is none of 'radar.pol",
    ),
    "channel that no image has": (
        {
            "radar": {"polarizations": ["VV", "HH"]},
            "imaging": {"polarizations": ["VV"]},
            **one_experiment(channels=["HH"]),
        },
        "learning.experiments.e.channels",
        "HH is none of 'imaging.polarizations' (VV)",
    ),
    "channel of no name": (
        one_experiment(channels=["VW"]),
        "learning.experiments.e.channels.0",
        "not one of ['VV', 'HH'",
    ),
    "features": (
        {"learning": {"models": {"knn": {"features": "magnitud"}}}},
        "learning.models.knn.features",
        "did you mean 'magnitude'",
    ),
    "a choice of features": (
        {"learning": {"models": {"lr": {"features": ["log", "phase"]}}}},
        "learning.models.lr.features",
        "'phase'",
    ),
    "features of a model that has its own": (
        {"learning": {"models": {"capsule": {"features": "log"}}}},
        "learning.models.capsule.features",
        "is unknown",
    ),
    "more channels than covariances hold": (
        {
            "radar": {"polarizations": ["VV", "HH", "HV"]},
            **one_experiment(models=["adaptive_filter"], snr_db={"random": [0, 6]}, upsample=64),
        },
        "learning.experiments.e.upsample",
        "have 12288",
    ),
    "aperture too wide": ({"imaging": {"aperture": 61}}, "imaging.reformat", "imaging.aperture"),
    "aperture that keeps little bandwidth": ({"imaging": {"aperture": 37}}, "imaging.reformat", "of the bandwidth"),
    "too few pixels": ({"imaging": {"upsample": 10}}, "imaging.upsample", "14 samples"),
    "one pixel": ({"imaging": {"upsample": 1}}, "imaging.upsample", "3 to 128"),
    "too many pixels": ({"imaging": {"upsample": 100_000}}, "imaging.upsample", "3 to 128"),
    "pixels as text": ({"imaging": {"upsample": "64"}}, "imaging.upsample", "3 to 128"),
    "pixels of both axes": ({"imaging": {"upsample": [64, 64]}}, "imaging.upsample", "3 to 128"),
    "pixels as yes": ({"imaging": {"upsample": True}}, "imaging.upsample", "3 to 128"),
    "window without ends": (
        {"imaging": {"imager": "fourier", "aperture": 3, "window": "hann"}},
        "imaging.window",
        "of 3 samples",
    ),
    "SNRs of one name": ({"noise": {"snr_db": [1.0, 1.0000001]}}, "noise.snr_db", "snr_1dB"),
    "nothing left to train": (
        {"learning": {"split": {"train": 0.001}, **one_experiment()["learning"]}},
        "learning.split.train",
        "0 to train",
    ),
    "one class": ({"targets": {"*": None, "a": KNOWN}}, "learning.experiments", "two targets"),
    "no mapping": ([1, 2], "config: [1, 2]", "not of type 'object'"),
    "text alone": ("quick", "config: 'quick'", "not of type 'object'"),
    "noise is a number": ({"noise": 5}, "noise", "snr_db, realizations, definition"),
    "its setting elsewhere": ({"radar": {"window": "hann"}}, "radar.window", "did you mean 'imaging.window'?"),
    "key of another section": ({"aperture": 11}, "aperture", "did you mean 'imaging.aperture'?"),
    "capital letters": ({"noise": {"SNR_dB": [0]}}, "noise.SNR_dB", "did you mean 'snr_db'?"),
    "misspelt value": ({"imaging": {"window": "hamingg"}}, "imaging.window", "did you mean 'hamming'?"),
    "how SNRs are used, misspelt": (
        one_experiment(snr_db={"rnadom": [0, 3]}),
        "learning.experiments.e.train.snr_db.rnadom",
        "did you mean 'random'?",
    ),
    "kind, misspelt": (
        {"learning": {"models": {"mine": {"knd": "lr"}}}},
        "learning.models.mine",
        "has one of these as its 'kind'",
    ),
    "a setting of a model without": (
        {"learning": {"models": {"matched_filter": {"othr": True}}}},
        "learning.models.matched_filter.othr",
        "did you mean 'other'?",
    ),
    "more neighbours than images": (
        {"learning": {"models": {"knn": {"k": [1, 2159]}}}},
        "learning.models.knn.k",
        "2159 is more than the 2158 images that the run 'multi_elevation' trains on; take 2158 at most",
    ),
    "trillions of angles": (
        {"aspect": {"elevation": {"start": -90, "stop": 90, "step": 1e-9}}},
        "aspect.elevation.step",
        "more than 100000 values",
    ),
    "name of a folder above": ({"name": ".."}, "name", "a letter, then"),
    "name with a line's end": ({"name": "a\n"}, "name", "a letter, then"),
    "name of 300 letters": ({"name": 300 * "a"}, "name", "a hundred"),
    "target name that is a path": ({"targets": {"a/b": KNOWN}}, "targets.a/b", "a letter, then"),
    "target names alike": ({"targets": {"a": KNOWN, "A": KNOWN}}, "targets.A", "capital letters"),
    "experiment names alike": (
        {"learning": {"experiments": {name: one_experiment()["learning"]["experiments"]["e"] for name in "Ee"}}},
        "learning.experiments.e",
        "capital letters",
    ),
    "all trained": (
        {"learning": {"split": {"train": 1}}},
        "learning.split.train",
        "1 is greater than or equal to the maximum of 1",
    ),
    "both kinds of azimuths": (
        {"aspect": {"azimuth": {"count": 9, "start": 0, "stop": 8, "step": 1}}},
        "aspect.azimuth",
        "it has count, start, step, stop",
    ),
}


BAD_FIELDS = {
    "both": ({"mesh": "resources/cad/drone.stl", "field": "a.ffe"}, "targets.a.field", "one of 'mesh'"),
    **{
        key: ({"field": "a.ffe", key: value}, f"targets.a.{key}", "leave it out")
        for key, value in {
            "unit": "mm",
            "rotate": [0, 0, 90],
            "length": 1,
            "formulation": "cfie",
            "material": "abs",
        }.items()
    },
    "misspelt": ({"feild": "a.ffe"}, "targets.a.feild", "did you mean 'field'"),
    "number": ({"field": 5}, "targets.a.field", "instead of mesh"),
    "polarization": ({"field": {"VV": "a.ffe"}}, "targets.a.field.VV", "each incident polarization"),
    "empty list": ({"field": []}, "targets.a.field", "one or more"),
    "missing file": ({"field": "no/such.ffe"}, "targets.a.field", "no file no/such.ffe"),
    "missing store": ({"field": "no/such.zarr"}, "targets.a.field", "no store no/such.zarr"),
    "another file": ({"field": "README.md"}, "targets.a.field", ".ffe, .zarr"),
    "list of stores": ({"field": ["a.zarr", "b.zarr"]}, "targets.a.field", "named alone"),
    "not transmitted": ({"field": {"H": "here.ffe"}}, "targets.a.field", "incident waves in V"),
    "own results": ({"field": "results/mine/scattering/a.zarr"}, "targets.a.field", "copy it elsewhere"),
    "own mesh": ({"mesh": "results/mine/a.stl"}, "targets.a.mesh", "copy it elsewhere"),
    "no background": (
        {"field": "here.zarr", "background": "no/such.zarr"},
        "targets.a.background",
        "no store no/such.zarr",
    ),
    "background in a file": ({"field": "here.zarr", "background": "here.ffe"}, "targets.a.background", ".zarr"),
    "no reference": (
        {"field": "here.zarr", "calibrate": {"measured": "here.zarr", "computed": "no/such.zarr"}},
        "targets.a.calibrate.computed",
        "no store no/such.zarr",
    ),
    "half a reference": (
        {"field": "here.zarr", "calibrate": {"measured": "here.zarr"}},
        "targets.a.calibrate.computed",
        "is missing",
    ),
    "no gate": ({"field": "here.zarr", "gate": 0.5}, "targets.a.gate", "0.5"),
    "background of FEKO's": (
        {"field": "here.ffe", "background": "here.zarr"},
        "targets.a.background",
        "one store (.zarr)",
    ),
    "own RCS": ({"field": "here.ffe", "reference": "results/mine/a.csv"}, "targets.a.reference", "copy it elsewhere"),
}


IN_VV = {"radar": {"polarizations": ["VV"]}, "learning": {"experiments": {}}}


@pytest.mark.parametrize("case", BAD_FIELDS)
def test_bad_field_is_refused_with_its_key(case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here.ffe").touch()
    (tmp_path / "here.zarr").mkdir()
    (tmp_path / "README.md").touch()
    (tmp_path / "results/mine/scattering/a.zarr").mkdir(parents=True)
    for name in ("a.stl", "a.csv"):
        (tmp_path / "results/mine" / name).touch()
    target, key, hint = BAD_FIELDS[case]
    with pytest.raises(InputError) as caught:
        targets = {"a": {**target, "role": "other"}}
        load_config({"name": "mine", "targets": targets, **IN_VV})
    assert f"'{key}'" in str(caught.value)
    assert hint in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("field", ["here.ffe", ["here.ffe"], {"V": "here.ffe"}, {"V": ["here.ffe"], "H": "here.ffe"}])
def test_a_target_may_be_a_field(field, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here.ffe").touch()
    targets = {"a": {"field": field, "role": "other"}}
    assert load_config({"targets": {"*": None, **targets}, **IN_VV})["targets"] == targets


@pytest.mark.parametrize("case", BAD)
def test_bad_config_is_refused_with_its_key(case):
    overlay, key, hint = BAD[case]
    with pytest.raises(InputError) as caught:
        load_config(overlay)
    message = str(caught.value)
    assert key in message
    assert hint in message
    assert "\n" not in message


def test_a_model_has_the_settings_of_its_kind_where_it_has_none():
    models = load_config({"learning": {"models": {"mine": {"kind": "fcnn", "epochs": 9}, "fcnn": {"width": 33}}}})[
        "learning"
    ]
    mine = models["models"]["mine"]
    assert (mine["epochs"], mine["width"], mine["kind"]) == (9, 33, "fcnn")
    assert models["models"]["fcnn"]["epochs"] == 5


@pytest.fixture
def own_models(tmp_path, monkeypatch):
    """A folder of the repository's models, to which a test adds one of its own."""
    for path in (ROOT / "isarflow/learning/models").glob("*.py"):
        (tmp_path / path.name).write_text(path.read_text())
    for module in ("core.kinds", "setup.check"):
        monkeypatch.setattr(f"isarflow.{module}.MODELS", MODELS._replace(folder=str(tmp_path)))
    return tmp_path


def test_a_model_of_ones_own_takes_any_settings(own_models):
    (own_models / "mine.py").write_text((own_models / "knn.py").read_text().replace("SETTINGS", "NOTES"))
    overlay = {"learning": {"models": {"mine": {"depth": 3, "k": 1}}, **one_experiment(models=["mine"])["learning"]}}
    assert load_config(overlay)["learning"]["models"]["mine"] == {"depth": 3, "k": 1}


def test_what_a_base_class_has_need_not_be_written_again(own_models):
    text = "from isarflow.learning.pytorch import PyTorch\nclass Model(PyTorch):\n    def network(self): pass\n"
    (own_models / "mine.py").write_text(text)
    assert load_config({"learning": {"models": {"mine": {}}}})["learning"]["models"]["mine"] == {}


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("class Model:\n    def fit(self:\n", "mine.py, line 2"),
        ("class Modell:\n    def fit(self): pass\n    def evaluate(self): pass\n", "no class Model"),
        ("class Model:\n    def fit(self): pass\n", "methods fit and evaluate"),
        (
            "class Model:\n    smallest = 'big'\n    def fit(self): pass\n    def evaluate(self): pass\n",
            "smallest = 'big'",
        ),
        (
            "class Model:\n    LABELS = {'mine': 'my'}\n    def fit(self): pass\n    def evaluate(self): pass\n",
            "LABELS = {'mine': 'my'}; it is a mapping of names to (label, words in a sentence)",
        ),
        ("class Model:\n    name = '\0'\n", "mine.py"),
    ],
)
def test_a_model_that_cannot_work_is_refused_at_the_start(text, hint, own_models):
    (own_models / "mine.py").write_text(text)
    with pytest.raises(InputError) as caught:
        load_config({"learning": {"models": {"mine": {}}}})
    assert "learning.models.mine" in str(caught.value) and hint in str(caught.value)


@pytest.mark.parametrize(
    ("key", "module", "base"), [("imager", "formation", "Formation"), ("focus", "focusing", "Focusing")]
)
def test_a_base_class_gives_none_of_the_methods_that_a_kind_defines(key, module, base, tmp_path):
    path = tmp_path / "mine.py"
    text = f"from isarflow.imaging.{module} import {base}\nclass {key.capitalize()}({base}):\n    SETTINGS = {{}}\n"
    path.write_text(text)
    with pytest.raises(InputError, match=f"'imaging.{key}': .*mine.py has no class {key.capitalize()} with method"):
        load_config({"imaging": {key: str(path)}})


def test_whole_numbers_may_have_a_point_and_choices_any_order():
    models = load_config({"learning": {"models": {"knn": {"k": 3.0}, "lr_tuned": {"penalty": [10, "1e0", 0.1]}}}})
    assert repr(models["learning"]["models"]["knn"]) == "{'k': 3}"
    assert models["learning"]["models"]["lr_tuned"]["penalty"] == [0.1, 1, 10]
    assert load_config({"imaging": {"aperture": 9.0}})["imaging"]["aperture"] == 9


def test_an_elevation_is_the_sweeps_to_a_ten_thousandth_of_a_degree():
    third = {"aspect": {"elevation": {"start": 0, "stop": 100 / 3, "step": 100 / 3}}}
    assert load_config({**third, **one_experiment(elevation=[33.33333])})
    with pytest.raises(InputError, match=r"33\.33 degrees is not one"):
        load_config({**third, **one_experiment(elevation=[33.33])})


def test_a_sweep_without_room_for_sectors_leaves_the_default_ones_out():
    config = load_config({"aspect": {"azimuth": NARROW}})
    assert "sector" not in config["learning"]["experiments"]
    assert "10 as a guard" in config["learning"]["left_out"]["sector"]
    assert any("'sector' is left out" in line for line in overview(config, "results/none"))
    assert "left_out" not in load_config()["learning"]


def test_other_snrs_leave_the_default_experiments_those_of_them_that_they_had():
    config = load_config({"noise": {"snr_db": [0, 6, 7.5]}})
    trained = {name: what["train"]["snr_db"] for name, what in config["learning"]["experiments"].items()}
    assert trained["adaptive"] == {"random": ["clean", 0, 6]}
    assert "left_out" not in config["learning"]
    # One SNR is no range.
    assert "adaptive" in load_config({"noise": {"snr_db": [0, 7.5]}})["learning"]["left_out"]
    # In a config of one's own an SNR that is not there is a mistake.
    with pytest.raises(InputError, match=r"-3 is none of 'noise\.snr_db'"):
        load_config({"noise": {"snr_db": [0, 6]}, **one_experiment(snr_db={"random": ["clean", -3]}, models=["fcnn"])})


def test_an_experiment_tests_at_those_of_its_snrs_that_there_are():
    """Its own are refused where there is none of them; a default one then tests at all."""
    tested = one_experiment(test={"snr_db": [{"start": 0, "stop": 9, "step": 3}]})
    tested["learning"]["experiments"]["*"] = None
    plan = Plan(load_config({"noise": {"snr_db": [-20, 0, 6]}, **tested}))
    assert plan.tested_snrs("e") == ["snr_0dB", "snr_6dB"] and plan.snrs[0] == "snr_-20dB"
    assert plan.tests(plan.snrs) == {("snr_0dB", "snr_6dB"): ["e"]} and plan.tests(["snr_-20dB"]) == {}
    assert plan.predictions("a") == [f"a/learning/predictions/e/lr/snr_{snr}dB.csv" for snr in (0, 6)]
    with pytest.raises(InputError, match=r"e\.test\.snr_db': 0 is none of 'noise\.snr_db' \(-20\)"):
        load_config({"noise": {"snr_db": [-20]}, **tested})
    default = Plan(load_config({"noise": {"snr_db": [0, 1, 7.5]}}))
    assert default.tested_snrs("sector_fold1") == ["snr_0dB"] and len(default.tested_snrs("library")) == 3
    assert Plan(load_config({"noise": {"snr_db": [7.5]}})).tested_snrs("sector_fold1") == ["snr_7.5dB"]


def test_more_pixels_than_the_default_experiments_ask_for_leave_those_out():
    config = load_config({"imaging": {"upsample": 40}})
    assert "32 pixels a side are fewer" in config["learning"]["left_out"]["capsule_open"]
    assert {"multi_elevation", "fcnn_open"} <= set(config["learning"]["experiments"])


def test_targets_without_unknown_ones_close_the_default_experiments():
    config = load_config({"targets": {"*": None, "a": KNOWN, "b": KNOWN}})
    assert not any(run["open"] for run in runs(config).values())
    assert any("'fcnn_open' is open, but" in line for line in overview(config, "results/none"))


def test_loading_leaves_the_overlay_alone():
    overlay = {"mesh": {"bands": 9}, "radar": {"frequencies": 3}}
    before = copy.deepcopy(overlay)
    assert load_config(overlay)["mesh"]["bands"] == 3  # never more bands than frequencies
    assert overlay == before


def test_snrs_may_be_ranges_and_all():
    assert load_config({"noise": {"snr_db": {"step": 12}}})["noise"]["snr_db"] == [-24, -12, 0, 12, 24]
    noise = {"snr_db": [5.5, {"start": -0.3, "stop": 0.3, "step": 0.1}]}
    assert repr(load_config({"noise": noise})["noise"]["snr_db"]) == "[-0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3, 5.5]"

    def trained(snr_db, model="fcnn"):
        overlay = {"noise": {"snr_db": [6, 0, 3]}, **one_experiment(snr_db=snr_db, models=[model])}
        return load_config(overlay)["learning"]["experiments"]["e"]["train"]["snr_db"]

    every, steps = ["clean", 0, 3, 6], {"start": 0, "stop": 6, "step": 3}
    for kind in ("random", "each"):
        assert trained({kind: "all"}) == trained({kind: ["clean", steps]}) == {kind: every}
        assert trained({kind: steps}) == {kind: [0, 3, 6]}
    assert trained("all") == trained(["clean", steps]) == every
    assert trained(steps) == trained([{**steps, "stop": 3}, 6]) == [0, 3, 6]


def test_order_of_snrs_has_no_meaning():
    assert load_config({"noise": {"snr_db": [5, -5]}}) == load_config({"noise": {"snr_db": [-5, 5]}})


MESH = "resources/cad/drone.stl"
KNOWN_TWO = {name: {"mesh": MESH, "role": "known"} for name in ("a", "b")}
EXPERIMENT = {"train": {"elevation": "all", "snr_db": "clean"}}
# Targets' roles beside two known ones, experiments, models; and what is said of them, beside the images.
UNUSED = {
    "nothing": (("unknown", "other"), {"e": {"models": ["knn"], "open": True}}, {}, []),
    "open without unknown targets": (
        (),
        {"e": {"models": ["knn"], "open": True}, "f": {"models": ["lr"], "open": True}, "g": {"models": ["lr"]}},
        {},
        ["experiment 'e' is open", "experiment 'f' is open"],
    ),
    "unknown targets and nothing open": (
        ("unknown",),
        {"e": {"models": ["knn"]}},
        {},
        ["no experiment has 'open: true'"],
    ),
    "role other for nothing": (("other",), {"e": {"models": ["knn"]}}, {}, ["role other (t0) is not used"]),
    "role other for a class": (("other",), {"e": {"models": ["fcnn_other"]}}, {}, []),
    "a class other from noise": (
        (),
        {"e": {"models": ["fcnn_other"]}},
        {},
        ["fcnn_other learns the class 'other' from"],
    ),
    "a model in no experiment": ((), {"e": {"models": ["knn"]}}, {"wide": {"kind": "fcnn"}}, ["the model 'wide'"]),
    "settings of a model that others inherit": (
        (),
        {"e": {"models": ["wide"]}},
        {"wide": {"kind": "fcnn", "width": 9}, "fcnn": {"epochs": 2}},
        [],
    ),
    "no experiments": (("unknown", "other"), {}, {}, []),
}


@pytest.mark.parametrize("case", UNUSED)
def test_what_learning_does_not_use_is_said_once(case):
    others, experiments, models, said = UNUSED[case]
    targets = KNOWN_TWO | {f"t{place}": {"mesh": MESH, "role": role} for place, role in enumerate(others)}
    config = load_config(
        {
            "name": "unused",
            "targets": {"*": None, **targets},
            "learning": {
                **({"models": models} if models else {}),
                "experiments": {"*": None, **{name: EXPERIMENT | one for name, one in experiments.items()}},
            },
        }
    )
    lines = [line for line in overview(config, "results/none") if "Warning" in line and "extent" not in line]
    assert len(lines) == len(said) and all(text in line for text, line in zip(said, lines, strict=True)), lines


def of_classes(**experiment):
    """A config of four known targets in two classes, and one experiment."""
    drones, missiles = ({**KNOWN, "class": name} for name in ("drone", "missile"))
    targets = {"*": None, "a": drones, "b": drones, "c": missiles, "d": missiles}
    return {"targets": targets, **one_experiment(**experiment)}


@pytest.mark.parametrize(("reach", "place", "warned"), [(0.3, 0.1, False), (0.3, 0.3, True), (2.0, 30.0, True)])
def test_a_displacement_that_leaves_the_extent_is_warned_of(reach, place, warned):
    """0.52 m to either side, also of a target that folds over at its place."""
    config = load_config(one_experiment(motion={"place": place}))
    texts = [text for name, text in warnings(config, dict.fromkeys(config["targets"], reach)) if name == "drone"]
    assert any(f"displaced by up to {place:g} m it reaches {reach + place:.2f} m" in text for text in texts) == warned


def test_targets_may_share_a_class_and_stay_out_of_training():
    assert runs(load_config(of_classes(without=["d", "b"])))["e"]["without"] == ["b", "d"]
    for overlay, text in (
        (of_classes(without=["a", "b"]), "'learning.experiments.e.without' leaves no target of the class drone"),
        (of_classes(without=["e"]), "'learning.experiments.e.without': e is none of 'targets of role known'"),
        ({"targets": {"*": None, "a": {**KNOWN, "class": "c"}, "c": KNOWN}, **one_experiment()}, "of one class, c"),
        (
            {"targets": {"ufo": {"class": "drone"}}},
            "'targets.ufo.class': 'drone' is not allowed. Expected: nothing, as only a target of role known",
        ),
        (
            {"targets": {"drone": {"class": "other"}}},
            "'targets.drone.class': 'other' is not allowed. Expected: another name, as 'other' is what",
        ),
    ):
        with pytest.raises(InputError, match=re.escape(text)):
            load_config(overlay)
