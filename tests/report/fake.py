"""A small tree of made-up results in the layout of the other stages, for the report to show."""

import copy
import json

import numpy as np
import xarray as xr
from fake_learning import OFFSET, SCORES, learn
from shapes_made import sphere

from isarflow.core import store as stores
from isarflow.core import sweep
from isarflow.core.kinds import MODELS, available, page_names
from isarflow.mesh.io import write_ply
from isarflow.mesh.measures import describe, size
from isarflow.report.page import write_report
from isarflow.report.results import Results
from isarflow.scattering.fields.store import write_field

CLEAN, SECTOR = {"elevation": "all", "snr_db": "clean"}, {"open": True, "split": "sector"}
SMALL = {"width": 16, "capsules": 2}
SETTINGS = {
    "name": "fake",
    "seed": 3,
    "targets": {
        name: {"mesh": f"{name}.stl", "role": role}
        for name, role in {"ufo": "unknown", "missile": "known", "drone": "known"}.items()
    },
    "mesh": {"bands": 2, "edges_per_wavelength": 10},
    "radar": {"center_frequency": 1e9, "bandwidth": 0.4e9, "frequencies": 5, "polarizations": ["VV", "HH"]},
    "aspect": {"elevation": {"start": -30, "stop": 30, "step": 30}, "azimuth": {"count": 24}},
    "scattering": {"solver": "mom", "formulation": "efie", "precision": "single", "tolerance": 1e-5},
    "imaging": {"imager": "fourier", "polarizations": ["VV"], "aperture": 3}
    | {"window": "hamming", "reformat": "polar", "upsample": "none"},
    "noise": {"snr_db": [-12, 0, 2.5, 12, 24], "realizations": 2, "definition": "peak_3db", "per": "image"},
    "motion": {"place": 0, "drift": 0, "jitter": 0, "turn": 0, "missing": 0},
    "learning": {
        "split": {"scheme": "random", "train": 0.7, "validation": 0.33, "folds": 3, "spacing": 0},
        "kept": 0.95,
        "realizations": "all",
        "models": {
            "lr": {"penalty": 0.001},
            "lr_tuned": {"kind": "lr", "penalty": [0.001, 0.1]},
            "svm": {"C": 930.66, "scale": 2.75},
            "knn": {"k": 1},
            "fcnn": {"width": 756, "epochs": 3},
            "capsule": {**SMALL, "epochs": 5},
            "capsule_denoise": {**SMALL, "kind": "capsule"},
        },
        "experiments": {
            "single_elevation": {"train": {"elevation": [0], "snr_db": "clean"}, "models": ["lr", "svm", "knn"]},
            "multi_elevation": {"train": CLEAN, "models": ["lr", "knn"]},
            "noisy_training": {"train": {"elevation": [0, 30], "snr_db": {"each": [2.5, 12]}}, "models": ["lr", "svm"]},
            "fcnn_open": {"train": CLEAN, "models": ["fcnn", "knn"], "open": True},
            "sector": {"train": CLEAN, "models": ["lr", "lr_tuned", "knn"], **SECTOR},
            "sector_fcnn": {"train": CLEAN, "models": ["fcnn"], **SECTOR, "folds": [1, 3]},  # some of the folds
            # One fold: there are no intervals.
            "capsule_sector": {"train": CLEAN, "models": ["capsule"], **SECTOR, "folds": [2], "upsample": 16},
            "capsule_open": {"train": CLEAN, "models": ["capsule"], "open": True, "upsample": 16},
            "capsule_closed": {"train": CLEAN, "models": ["capsule"], "upsample": 16},
            "noisy_capsule": {"train": {"elevation": "all", "snr_db": {"random": ["clean", 0, 2.5, 12, 24]}}}
            | {"models": ["capsule", "capsule_denoise"], "open": True, "upsample": 16},
        },
    },
}
# Half axes in m.
SHAPES = {"ufo": (0.3, 0.3, 0.1), "disc": (0.2, 0.2, 0.02), "missile": (0.5, 0.08, 0.08), "drone": (0.25, 0.25, 0.06)}
# What the solver made of a sphere, almost right.
SPHERE = {"radius_wavelengths": 0.35, "unknowns": 570, "error_db": -0.012, "phase_deg": 0.3, "edges_per_wavelength": 10}
# Of stores of images.
ATTRS = {"polarization": "VV", "aperture_angle": 75.0, "range_wavenumber": 21.0, "snr_definition_offset_db": OFFSET}
ATTRS |= {"range_resolution": 0.3, "crossrange_resolution": 0.2, "range_extent": 1.5, "crossrange_extent": 1.0}


def changed(experiments=None, settings=SETTINGS, **sections):
    """Settings with these of their experiments alone, if they are named, and with these keys of sections."""
    settings = copy.deepcopy(settings)
    if experiments is not None:
        settings["learning"]["experiments"] = {name: settings["learning"]["experiments"][name] for name in experiments}
    for section, keys in sections.items():
        settings[section] |= keys
    return settings


def names(settings):
    """What the files of the models state, of those that have one."""
    models, kinds = settings["learning"]["models"], available(MODELS)
    return page_names({name: own for name, own in models.items() if own.get("kind", name) in kinds})


def results(folder, settings=SETTINGS):
    """The results in `folder` as the report reads them."""
    return Results(folder, settings, names(settings))


def write(root, settings=SETTINGS):
    """Made-up results in `root`, and their report; returns its folder."""
    make(root, settings)
    write_report(root, settings, names(settings), root / "report" / "index.html")
    return root / "report"


def make(folder, settings=SETTINGS, scores=SCORES):
    """Fill `folder` (results/<name>) with made-up results for the settings. scores: of models that have their own."""
    directions = sweep.elevations(settings["aspect"]), sweep.azimuths(settings["aspect"])
    has_images = settings["radar"]["frequencies"] > 1
    for name in settings["targets"]:
        if "mesh" in settings["targets"][name]:
            _mesh(folder / "mesh", name, settings)
            (folder / "scattering" / "check").mkdir(parents=True, exist_ok=True)
            (folder / "scattering" / "check" / "sphere.json").write_text(json.dumps(SPHERE))
        _scattering(folder / "scattering" / f"{name}.zarr", name, settings, *directions)
        if has_images:
            _images(folder / "imaging" / name, settings, *directions)
    if has_images and settings["learning"]["experiments"]:
        learn(folder / "learning", settings, scores)
    (folder / "benchmarks" / "mesh").mkdir(parents=True)
    (folder / "benchmarks" / "mesh" / "drone.tsv").write_text("s\th:m:s\tmax_rss\n12.5\t0:00:12\t250.0\n")


def _mesh(folder, name, settings):
    """The same ellipsoid in every band, with its true figures."""
    folder.mkdir(parents=True, exist_ok=True)
    vertices, triangles = sphere(1.0, 2)
    vertices, bands = vertices * SHAPES[name], []
    source = size(vertices, triangles) | {"vertices": len(vertices), "triangles": len(triangles)}
    source |= {"thinned_by": 0.0, "thinned_area": 0.0, "thinned_volume": 0.0}
    write_ply(folder / f"{name}-source.ply", vertices, triangles)
    for number, band in enumerate(sweep.bands(settings["radar"], settings["mesh"]["bands"])):
        parts = sorted(settings["targets"][name].get("parts", {}))
        part = np.arange(len(triangles)) % len(parts) if parts else None
        write_ply(folder / f"{name}-{number}.ply", vertices, triangles, part, parts)
        wavelength, apart = sweep.C0 / band[-1], ((0.0, vertices[0]),) * 2
        measures = describe((vertices, triangles), source, apart, wavelength, wavelength / 10)
        frequencies = {"first": float(band[0]), "last": float(band[-1]), "count": len(band)}
        bands.append({"frequencies": frequencies} | measures)
    source["raw"] = size(vertices, triangles) | {"triangles": len(triangles) + 2}
    repairs = {"duplicate_triangles": 2, "welded_vertices": 0}
    (folder / f"{name}.json").write_text(json.dumps({"source": source, "repairs": repairs, "bands": bands}))


def _scattering(path, name, settings, elevation, azimuth):
    """Two point scatterers, at the nose and at the tail."""
    frequency, polarizations = sweep.frequencies(settings["radar"]), settings["radar"]["polarizations"]
    down = np.cos(np.radians(elevation))[:, None] * np.cos(np.radians(azimuth))
    phase = 4 * np.pi / sweep.C0 * np.multiply.outer(frequency, SHAPES[name][0] * down)
    field = 0.1 * np.exp(1j * phase) + 0.05 * np.exp(-1j * phase)
    field = np.stack([field * (1 + 0.5 * index) for index in range(len(polarizations))]).astype(np.complex64)
    origin = settings["targets"][name].get("field")
    attrs = {"formulation": "external", "origin": {origin: "0123456789abcdef"}, "unknowns": None, "residual": None}
    if origin is None:
        residual = [1e-6 * (n + 1) for n in range(len(frequency))]
        attrs = {"formulation": "efie", "unknowns": [792] * len(frequency), "residual": residual}
        attrs |= {key: value for key, value in settings["targets"][name].items() if key in ("material", "parts")}
    write_field(path, field, polarizations, frequency, elevation, azimuth, attrs)


def _images(folder, settings, elevation, azimuth):
    """Random pixels, each image with its peak at 1 over all its channels."""
    random, noise = np.random.default_rng([5, *folder.name.encode()]), settings["noise"]
    channels = settings["imaging"]["polarizations"]
    rows, columns = settings["radar"]["frequencies"], settings["imaging"]["aperture"]
    coords = {"elevation": elevation, "azimuth": azimuth, "channel": channels}
    coords["range"] = 0.3 * (np.arange(rows) - rows // 2)  # m
    coords["crossrange"] = 0.2 * (np.arange(columns) - columns // 2)  # m
    for store in ("clean", *map(sweep.snr_label, noise["snr_db"])):
        sizes = {} if store == "clean" else {"realization": noise["realizations"]}
        sizes |= {name: len(values) for name, values in coords.items()}
        image = random.normal(size=(*sizes.values(), 2)) @ [1, 1j]
        image = (image / np.abs(image).max(axis=(-3, -2, -1), keepdims=True)).astype(np.complex64)
        dataset = xr.Dataset({"image": ([*sizes], image)}, coords, ATTRS)
        if len(channels) == 1:
            dataset = dataset.isel(channel=0, drop=True)
        if store == "clean":
            # From 0 to twice the mean; one image has no signal.
            offset = np.linspace(0, 2 * OFFSET, len(elevation) * len(azimuth)).reshape(len(elevation), -1)
            offset[len(elevation) // 2, len(azimuth) // 2] = np.nan
            dataset["snr_definition_offset"] = ("elevation", "azimuth"), offset
        stores.write(dataset, folder / f"{store}.zarr")
