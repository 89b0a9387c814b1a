"""A small tree of made-up results in the layout of the other stages, for the report to show."""

import itertools
import json

import numpy as np
import pandas as pd
import xarray as xr

from core import store as stores
from core import sweep
from learning.experiments import runs, train_snr_db, training
from learning.scores import COLUMNS, CONFUSION, VALIDATION
from mesh.io import write_ply
from mesh.measures import describe, size
from report.page import write_report
from report.selection import decoded_snrs
from setup.kinds import MODELS, available, page_names

SETTINGS = {
    "name": "fake",
    "seed": 3,
    "targets": {
        "ufo": {"mesh": "ufo.stl", "role": "unknown"},
        "missile": {"mesh": "missile.stl", "role": "known"},
        "drone": {"mesh": "drone.stl", "role": "known"},
    },
    "mesh": {"bands": 2, "edges_per_wavelength": 10},
    "radar": {"center_frequency": 1e9, "bandwidth": 0.4e9, "frequencies": 5, "polarizations": ["VV", "HH"]},
    "aspect": {"elevation": {"start": -30, "stop": 30, "step": 30}, "azimuth": {"count": 24}},
    "scattering": {"solver": "mom", "formulation": "efie", "precision": "single", "tolerance": 1e-5},
    "imaging": {"imager": "fourier", "aperture": 5, "window": "hamming", "reformat": "polar", "upsample": "none"},
    "noise": {"snr_db": [-12, 0, 2.5, 12, 24], "realizations": 2, "definition": "peak_3db"},
    "learning": {
        "split": {"scheme": "random", "train": 0.7, "validation": 0.33},
        "models": {
            "lr": {"penalty": 0.001},
            "svm": {"C": 930.66, "scale": 2.75},
            "knn": {"k": 1},
            "fcnn": {"width": 756},
            "capsule": {"width": 16, "capsules": 2},
            "capsule_denoise": {"kind": "capsule", "width": 16, "capsules": 2},
        },
        "experiments": {
            "single_elevation": {"train": {"elevation": [0], "snr_db": "clean"}, "models": ["lr", "svm", "knn"]},
            "multi_elevation": {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["lr", "knn"]},
            "noisy_training": {"train": {"elevation": [0, 30], "snr_db": {"each": [2.5, 12]}}, "models": ["lr", "svm"]},
            "fcnn_open": {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["fcnn", "knn"], "open": True},
            "sector": {"train": {"elevation": "all", "snr_db": "clean"}, "models": ["lr", "knn"], "split": "sector"},
            "capsule_open": {
                "train": {"elevation": "all", "snr_db": "clean"},
                "models": ["capsule"],
                "open": True,
                "upsample": 16,
            },
            "capsule_closed": {
                "train": {"elevation": "all", "snr_db": "clean"},
                "models": ["capsule"],
                "upsample": 16,
            },
            "noisy_capsule": {
                "train": {"elevation": "all", "snr_db": {"random": ["clean", 0, 2.5, 12, 24]}},
                "models": ["capsule_denoise"],
                "open": True,
                "upsample": 16,
            },
        },
    },
}
# Else softmax.
SCORES = {
    "capsule": ("mse", "zncc"),
    "capsule_denoise": ("mse", "zncc", "noise_zncc"),
    "own": ("my_error", "fit"),
}
DECODERS = tuple(SCORES)
WORSE_HELD_OUT = ("knn",)
IMAGES = 200  # test images of each target that are counted
TESTED = 40  # test images of each target in the predictions
# Half axes in m.
SHAPES = {
    "ufo": (0.3, 0.3, 0.1),
    "disc": (0.2, 0.2, 0.02),
    "missile": (0.5, 0.08, 0.08),
    "drone": (0.25, 0.25, 0.06),
}


def write(root, settings):
    """Made-up results in `root`, and their report; returns its folder."""
    make(root, settings)
    return again(root, settings, root / "report")


def names(settings):
    """What the files of the models state, of those that have one."""
    models, kinds = settings["learning"]["models"], available(MODELS)
    return page_names({name: own for name, own in models.items() if own.get("kind", name) in kinds})


def again(root, settings, report):
    write_report(root, settings, names(settings), report / "index.html", report / "figures", report / "tables")
    return report


def make(folder, settings):
    """Fill `folder` (results/<name>) with made-up results for the settings."""
    frequency = sweep.frequencies(settings["radar"])
    elevation, azimuth = sweep.elevations(settings["aspect"]), sweep.azimuths(settings["aspect"])
    for name in settings["targets"]:
        if "mesh" in settings["targets"][name]:
            _mesh(folder / "mesh", name, settings)
        _scattering(folder / "scattering" / f"{name}.zarr", name, settings, frequency, elevation, azimuth)
        if len(frequency) > 1:
            _images(folder / "imaging" / name, settings, elevation, azimuth)
    if len(frequency) > 1 and settings["learning"]["experiments"]:
        _learning(folder / "learning", settings)
    record = folder / "benchmarks" / "mesh" / "drone.tsv"
    record.parent.mkdir(parents=True)
    record.write_text("s\th:m:s\tmax_rss\n12.5\t0:00:12\t250.0\n")


def ellipsoid(half_axes, rings=12):
    """Vertices (n, 3) and triangles (m, 3) of a closed ellipsoid."""
    polar, turn = np.linspace(0, np.pi, rings + 1)[1:-1], np.arange(2 * rings) * np.pi / rings
    ring = np.stack(
        [
            np.outer(np.sin(polar), np.cos(turn)),
            np.outer(np.sin(polar), np.sin(turn)),
            np.outer(np.cos(polar), np.ones_like(turn)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    vertices = np.vstack([ring, [[0, 0, 1], [0, 0, -1]]]) * half_axes
    count, north, south = 2 * rings, len(ring), len(ring) + 1
    triangles = []
    for k in range(count):
        after = (k + 1) % count
        triangles += [(north, k, after), (south, len(ring) - count + after, len(ring) - count + k)]
        for row in range(rings - 2):
            a, b, c, d = (row * count + k, row * count + after, (row + 1) * count + k, (row + 1) * count + after)
            triangles += [(a, c, b), (b, c, d)]
    return vertices, np.array(triangles)


def _mesh(folder, name, settings):
    """The same ellipsoid in every band, with its true figures."""
    folder.mkdir(parents=True, exist_ok=True)
    surface = ellipsoid(SHAPES[name])
    write_ply(folder / f"{name}-source.ply", *surface)
    bands = []
    for number, band in enumerate(sweep.bands(settings["radar"], settings["mesh"]["bands"])):
        write_ply(folder / f"{name}-{number}.ply", *surface)
        wavelength = sweep.C0 / band[-1]
        frequencies = {"first": float(band[0]), "last": float(band[-1]), "count": len(band)}
        figures = {"frequencies": frequencies} | describe(surface, surface, wavelength, wavelength / 10)
        bands.append(figures)
    source = size(*surface) | {"vertices": len(surface[0]), "triangles": len(surface[1]), "thinned_by": 0.0}
    source["raw"] = size(*surface) | {"triangles": len(surface[1]) + 2}
    repairs = {"duplicate_triangles": 2, "welded_vertices": 0}
    (folder / f"{name}.json").write_text(json.dumps({"source": source, "repairs": repairs, "bands": bands}))


def _coordinate(name, values, units):
    return (name, values, {"units": units, "long_name": name})


def _scattering(path, name, settings, frequency, elevation, azimuth):
    """Two point scatterers, at the nose and at the tail."""
    k = 2 * np.pi * frequency / sweep.C0
    down = np.cos(np.radians(elevation))[:, None] * np.cos(np.radians(azimuth))
    nose = SHAPES[name][0]
    field = 0.1 * np.exp(2j * k[:, None, None] * nose * down) + 0.05 * np.exp(-2j * k[:, None, None] * nose * down)
    polarizations = settings["radar"]["polarizations"]
    field = np.stack([field * (1 + 0.5 * index) for index in range(len(polarizations))]).astype(np.complex64)
    axes = ("polarization", "frequency", "elevation", "azimuth")
    origin = settings["targets"][name].get("field")
    attrs = {"formulation": "external", "origin": {origin: "0123456789abcdef"}, "unknowns": None, "residual": None}
    if origin is None:
        residual = [1e-6 * (n + 1) for n in range(len(frequency))]
        attrs = {"formulation": "efie", "unknowns": [792] * len(frequency), "residual": residual}
    dataset = xr.Dataset(
        {
            "field": (axes, field, {"units": "m", "long_name": "scattering amplitude"}),
        },
        {
            "polarization": np.array(polarizations),
            "frequency": _coordinate("frequency", frequency, "Hz"),
            "elevation": _coordinate("elevation", elevation, "degrees"),
            "azimuth": _coordinate("azimuth", azimuth, "degrees"),
        },
        attrs,
    )
    stores.write(dataset, path)


def _images(folder, settings, elevation, azimuth):
    """Random pixels, each image with its peak at 1."""
    random = np.random.default_rng(5)
    pixels = (settings["radar"]["frequencies"], settings["imaging"]["aperture"])
    noise = settings["noise"]
    for store in ("clean", *map(sweep.snr_label, noise["snr_db"])):
        lead = () if store == "clean" else (noise["realizations"],)
        image = random.normal(size=(*lead, len(elevation), len(azimuth), *pixels, 2)) @ [1, 1j]
        image = (image / np.abs(image).max(axis=(-2, -1), keepdims=True)).astype(np.complex64)
        axes = ("realization",) * len(lead) + ("elevation", "azimuth")
        dataset = xr.Dataset(
            {
                "image": ((*axes, "range", "crossrange"), image),
                "peak": (axes, np.ones(image.shape[:-2], np.float32)),
            },
            {
                "elevation": _coordinate("elevation", elevation, "degrees"),
                "azimuth": _coordinate("azimuth", azimuth, "degrees"),
                "range": _coordinate("range", 0.3 * (np.arange(pixels[0]) - pixels[0] // 2), "m"),
                "crossrange": _coordinate("crossrange", 0.2 * (np.arange(pixels[1]) - pixels[1] // 2), "m"),
            },
            {
                "aperture_angle": 75.0,
                "range_resolution": 0.3,
                "crossrange_resolution": 0.2,
                "range_extent": 1.5,
                "crossrange_extent": 1.0,
                "snr_definition_offset_db": 2.1,
            },
        )
        stores.write(dataset, folder / f"{store}.zarr")


def _learning(folder, settings):
    """Accuracy that rises with SNR; every score with an interval around it; a curve for every network."""
    roles = {name: target["role"] for name, target in settings["targets"].items()}
    labels = sorted(name for name, role in roles.items() if role == "known")
    rows, cells, times = [], [], []
    for name, run in runs(settings).items():
        subsets = ("all",) if run["elevation"] == "all" else ("all", "trained")
        for (place, model), snr, subset in itertools.product(
            enumerate(run["models"]), settings["noise"]["snr_db"], subsets
        ):
            head = [run["experiment"], model, run["split"], training(run), train_snr_db(run), snr, subset]
            right = 1 - 0.5 / (1 + np.exp((snr + 6 + 3 * place) / 3)) - 0.01 * (subset == "all")
            bounds = [right, right - 0.03, min(right + 0.03, 1), 400]
            known = SCORES.get(model, ["softmax"]) if run["open"] else ()
            opened = [[score, protocol] for score in known for protocol in ("thesis", "blind")]
            for kind in (["", ""], *opened):
                classes = [*labels, "other"] if kind[0] else labels
                metrics = ["accuracy", "f1_weighted", "f1_macro"]
                metrics += [f"{what}_{label}" for label in classes for what in ("precision", "recall")]
                rows += [[*head, *kind, metric, *bounds] for metric in metrics]
                targets = [*labels, *(name for name, role in roles.items() if role == "unknown")] if kind[0] else labels
                for target, predicted in itertools.product(targets, classes):
                    truth = target if target in labels else "other"
                    share = right if predicted == truth else (1 - right) / (len(classes) - 1)
                    cells.append([*head, *kind, target, predicted, IMAGES * share])
            rows += [[*head, score, "", metric, *bounds] for score in known for metric in ("auroc", "fpr95", "oscr")]
            rows += [[*head, *kind, "threshold", _threshold(kind[0], snr), np.nan, np.nan, 400] for kind in opened]
        for place, model in enumerate(run["models"]):
            times.append(
                {
                    "experiment": run["experiment"],
                    "run": name,
                    "model": model,
                    "training_observations": 1234,
                    "single": {"size": 1, "repeats": 200, "milliseconds_per_observation": 0.2 * (place + 1)},
                    "batch": {"size": 256, "repeats": 20, "milliseconds_per_observation": 0.01 * (place + 1)},
                }
            )
            if run["open"] and model in DECODERS:
                _decoded(folder, run, model, roles, settings["noise"]["snr_db"])
            if model == "fcnn":
                path = folder / "models" / name / model
                path.mkdir(parents=True)
                curve = {
                    "epoch": [1, 2, 3],
                    "loss": [0.5, 0.1, 0.01],
                    "accuracy": [0.7, 0.9, 1.0],
                }
                curve |= {"validation_loss": [0.6, 0.2, 0.02], "validation_accuracy": [0.6, 0.8, 0.9]}
                pd.DataFrame(curve).to_csv(path / "curve.csv", index=False)
                seconds = pd.DataFrame({"epoch": [1, 2, 3], "seconds": [1.5, 3.0, 4.5]})
                seconds.to_csv(path / "seconds.csv", index=False)
    folder.mkdir(parents=True, exist_ok=True)
    machine = {"cpu": "A processor", "cores": 2}
    (folder / "times.json").write_text(json.dumps({"machine": machine, "threads": 1, "models": times}))
    scores = pd.DataFrame(rows, columns=COLUMNS)
    pd.concat([scores, _gains(scores)]).to_csv(folder / "scores.csv", index=False)
    compared = (scores["metric"] == "f1_weighted") | ((scores["metric"] == "accuracy") & (scores["score"] == ""))
    # On the validation images some models do worse on known targets than others that they beat on the test images.
    worse = scores["model"].isin(WORSE_HELD_OUT) & (scores["score"] == "")
    held_out = scores.assign(value=scores["value"] - 0.2 * worse)
    held_out[compared][VALIDATION].to_csv(folder / "validation.csv", index=False)
    pd.DataFrame(cells, columns=CONFUSION).to_csv(folder / "confusion.csv", index=False)


def _threshold(score, snr):
    """Below 0 for the MSE, whose known score is minus it."""
    return -0.02 - 0.001 * (24 - snr) if score == "mse" else 0.6


def _gains(scores):
    """What every open row is better than the thesis's method, with an interval that now and then is all above 0."""
    opened = scores[(scores["metric"] == "f1_weighted") & (scores["threshold"] != "")]
    same = ["split", "test_snr_db", "elevation", "threshold"]
    own = (opened["model"] == "capsule") & (opened["training"] == "clean") & (opened["score"] == "zncc")
    both = opened.merge(opened[own][[*same, "value"]], on=same, suffixes=("", "_reference"))
    gain = both["value"] - both["value_reference"]
    both = both.assign(metric="f1_weighted_gain", value=gain, low=gain - 0.02, high=gain + 0.02)
    return both[COLUMNS]


def _decoded(folder, run, model, roles, snrs):
    """Predictions with known scores that tell known from unknown targets, and reconstructions of noise."""
    random, snrs = np.random.default_rng(9), decoded_snrs(snrs)
    targets, known = sorted(roles), sorted(name for name, role in roles.items() if role == "known")
    for snr in snrs:
        frame = pd.DataFrame({"target": np.repeat(targets, 2 * TESTED)})
        frame["role"] = frame["target"].map(roles)
        frame["side"] = np.tile(np.repeat(["test", "validation"], TESTED), len(targets))
        far = (frame["role"] != "known").to_numpy() * 1.0
        for score in SCORES[model]:
            sign = -1 if score == "mse" else 1
            frame[f"known_{score}"] = sign * (random.uniform(0, 0.03, len(frame)) + (far if sign < 0 else 1 - far))
        store = folder / "predictions" / run["name"] / model / f"{sweep.snr_label(snr)}.csv"
        store.parent.mkdir(parents=True, exist_ok=True)
        frame.to_csv(store, index=False)
    sizes, pixels = (len(snrs), len(targets), 5), (16, 16)
    axes = ("snr", "target", "example", "range", "crossrange")
    dataset = xr.Dataset(
        {
            "truth": (axes[1:], random.uniform(size=(*sizes[1:], *pixels)).astype(np.float32)),
            "seen": (axes, random.uniform(size=(*sizes, *pixels)).astype(np.float32)),
            "made": (axes, np.full((*sizes, *pixels), 0.5, np.float32)),
            "predicted": (axes[:3], np.full(sizes, known[0])),
        },
        {
            "snr": _coordinate("snr", snrs, "dB"),
            "target": targets,
            "elevation": ("example", [-30, 0, 0, 30, 30]),
            "azimuth": ("example", [15.0, 30.0, 90.0, 180.0, 345.0]),
        },
        {"run": run["name"], "model": model},
    )
    stores.write(dataset, folder / "reconstructions" / run["name"] / f"{model}.zarr")
