"""The first screen: what was run, how well it works and whether it is right; at the page's end facts and the config."""

import platform
from contextlib import suppress
from importlib import metadata

import numpy as np
import pandas as pd
import yaml

from isarflow import __version__
from isarflow.core import sweep
from isarflow.core.code import commit
from isarflow.core.words import duration, number, several
from isarflow.imaging.geometry import planned
from isarflow.learning.caveats import warnings
from isarflow.mesh import measures
from isarflow.report import section_headline, thesis
from isarflow.report.layout import Section, canvas, figure
from isarflow.report.plots import OBLIQUE, draw_mesh
from isarflow.report.section_mesh import missed
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import LEAD, POWERS, SPLITS, listed, select
from isarflow.scattering import needs

PLACE, NEEDS = ("run", 2), "targets"  # on the page, see page.py
PACKAGES = ("snakemake", "numpy", "scipy", "jax", "pymeshlab", "scikit-learn", "xarray", "zarr", "matplotlib")
LOOKS = 5  # of which is said what they name together
KINDS_SNR = 12  # dB, of what is said of models that never trained
# Within these a run's numbers are taken for right.
SPHERE_DB = 0.2  # of the exact backscatter; with ten edges a wavelength it is 0.01
RESIDUAL = 1e-3  # relative; ten times what compressed matrices are allowed to leave out at most
# Beside the first split.
BESIDE = {"sector": "far from all in training", "random": "with near copies in training"}
BESIDE["elevation, moved"] = "their place unknown"


def facts(results):
    """Yield the run in pairs of what and how much, as the page lists them."""
    settings = results.settings
    yield "Run", f"{settings['name']}, seed {settings['seed']}; its whole config is at the end of the page"
    if not results.images_are_made:
        yield "Images", f"none: {sweep.why_no_images(settings)}"
    records = results.benchmarks
    own = records["run"] == results.folder.name
    if own.any():
        yield "Computed in", _took(records[own])
    if "from" in settings:
        took = "" if own.all() else f", where they took {_took(records[~own])}"
        yield "Meshes and fields", f"taken from the run {settings['from']}{took}"
    made = [f"isarflow {__version__}", f"commit {commit()}", f"Python {platform.python_version()}"]
    for package in PACKAGES:
        with suppress(metadata.PackageNotFoundError):
            made.append(f"{package} {metadata.version(package)}")
    yield "Made with", ", ".join(made)


def _took(records):
    """Return as text the seconds of jobs, in all and by stage. records: as of Results.benchmarks."""
    seconds = records.groupby("stage", sort=False)["s"].sum()
    parts = ", ".join(f"{stage} {duration(total)}" for stage, total in seconds.items())
    return f"{duration(seconds.sum())} of jobs ({parts})"


def warned(results):
    """Return the warnings of the run, (what it is about, sentence), each once: of meshes, fields, then images."""
    found = [(name, text) for name, measured in results.meshes.items() for text in measures.warnings(measured)]
    given = (name for name in results.targets if name not in results.meshed)
    found += [(name, text) for name in given for text in results.scattering(name).attrs.get("warnings", ())]
    if results.images_are_made:
        found += warnings(results.settings, {name: results.reach(name) for name in results.meshed})
    about = {}
    for name, text in found:
        about.setdefault(text, []).append(name)
    return [(", ".join(names), text) for text, names in about.items()]


def cards(results):
    """Return (name, a small picture or None, lines of text) of every target that is drawn: role, size, unknowns."""
    made = []
    for name in results.drawn:
        drawn, lines = None, ["given by its field"]
        if name in results.meshed:
            size = np.ptp(results.surfaces[name][0], axis=0).tolist()
            drawing = canvas(2.2, 1.5)
            axes = drawing.add_subplot()
            draw_mesh(axes, *results.surfaces[name], OBLIQUE, edges=False)
            axes.set_axis_off()
            data = pd.DataFrame([[name, *size]], columns=["target", "x_m", "y_m", "z_m"])
            drawn = figure(f"target_{name}", drawing, data, f"The target {name}, seen obliquely from above.")
            lines = [" × ".join(f"{length:.2f}" for length in size) + " m"]
            each = needs.unknowns_per_function(needs.method(results.settings, name))
            about = "" if isinstance(each, int) else "about "
            lines.append(f"{about}{round(each * results.meshes[name]['bands'][-1]['unknowns']):,} unknowns")
        made.append((name, drawn, [results.settings["targets"][name]["role"], *lines]))
    return made


def sentences(results):
    lead = section_headline.lead(results) if results.learns else None
    reached = () if lead is None else (_reached(results, lead), _named(results, lead))
    return list(filter(None, (_done(results), *reached, _bounds(results))))


def _done(results):
    settings = results.settings
    frequency = sweep.frequencies(settings["radar"]) / 1e9
    elevation, azimuth = sweep.elevations(settings["aspect"]), sweep.azimuths(settings["aspect"])
    band = f"{frequency[0]:g} GHz" if len(frequency) == 1 else f"{frequency[0]:.3g} to {frequency[-1]:.3g} GHz"
    without = len({*results.targets} - {*results.meshed})
    meshes = f"the meshes of {len(results.targets) - without} of them" if without else "their meshes"
    solved = f", solved on {meshes}" if results.meshed else ""
    directions = f"{len(elevation)} × {len(azimuth)} directions"
    echo = f"The radar echo of {several(len(results.targets), 'target')} at {band} from {directions}{solved}"
    first = " (the first model of each kind is drawn)" if len(results.drawn) < len(results.targets) else ""
    parts = [echo + first]
    if results.images_are_made:
        images, snrs = planned(settings), several(len(settings["noise"]["snr_db"]), "SNR")
        pixels = f"{images['range_pixels']} × {images['crossrange_pixels']} pixels"
        parts.append(f"ISAR images of {pixels} made of it, without noise and at {snrs}")
    if results.learns:
        known, unknown = listed(results.classes), listed(results.of_role("unknown") or [""])
        models = several(len({model for run in results.runs.values() for model in run["models"]}), "model")
        parts.append(f"{models} trained to tell {known} apart{f' and to reject {unknown}' if results.opened else ''}")
    return f"{'; '.join(parts)}."


def _reached(results, lead):
    drawn = select(lead, best=True, threshold=[LEAD, ""])
    snr = nearest(drawn["test_snr_db"], 12)
    at = select(drawn, test_snr_db=snr)
    opened, method = LEAD in set(at["threshold"]), results.names.method
    case = select(at, threshold=LEAD if opened else "").drop_duplicates("split").set_index("split")
    first, *others = [split for split in SPLITS if split in case.index]
    best, images, how, by, least = case.loc[first], "closed", "", "", "naming one class for all"
    if opened:
        how, by = ", with thresholds chosen by known targets alone", " by its main confidence score"
        images, least = "open", "rejecting everything"
    level = (results.rejecting if opened else results.guessing)([best["experiment"]])[-1]
    parts = [
        f"At {snr:g} dB by {POWERS[results.definition]}, {SPLITS[first]}{how}, "
        f"{method(best['model'], best['score'])}, the best model on the validation images{by}, reaches a weighted F1 "
        f"of {_f1(best)} on the {images} set, where {least} has {level:.2f}"
    ]
    for split in (split for split in others if split in BESIDE):
        parts.append(f"{SPLITS[split]}, {BESIDE[split]}, the same has {case.loc[split, 'value']:.2f}")
    closed = select(at, threshold="", split=first).to_dict("records")
    if opened and closed:
        words = f"on the known targets alone {method(closed[0]['model'], closed[0]['score'])}, chosen likewise"
        parts.append(f"{words}, has {closed[0]['value']:.2f}")
    return f"{'; '.join(parts)}."


def _named(results, lead):
    """What one look and several together name rightly of models that never trained; nothing without such a split."""
    closed = select(lead, best=True, threshold="")
    closed = closed[closed["split"].str.startswith("family")]
    if closed.empty:
        return ""
    case = closed.iloc[-1][["split", "experiment", "model", "training"]].to_dict()
    rows = select(results.scores, **case, elevation="all", threshold="", metric=["accuracy", f"accuracy_{LOOKS}_looks"])
    parts = []
    for snr, of_snr in rows.groupby("test_snr_db"):
        values = of_snr.drop_duplicates("metric").set_index("metric")["value"]
        values = [f"{value:.2f}" for value in values.reindex(rows["metric"].unique()).dropna()]
        parts.append(f"{' and '.join(values)} at {snr:g} dB")
    also = f" and of {LOOKS} looks together" if rows["metric"].nunique() > 1 else ""
    model = results.names.model(case["model"]).label
    return f"Of models that never trained {model} names rightly, of single looks{also}: {', '.join(parts)}."


def _f1(row):
    return f"{row['value']:.2f}" + ("" if pd.isna(row["low"]) else f" ({row['low']:.2f} to {row['high']:.2f})")


def _bounds(results):
    parts, settings = [], results.settings
    if results.images_are_made:
        images, window = planned(settings), settings["imaging"].get("window", "boxcar")
        coarser = "" if window == "boxcar" else f", less by their {window} window,"
        parts.append(
            f"images resolve {images['range_resolution']:.2f} × {images['crossrange_resolution']:.2f} m{coarser} over "
            f"an unambiguous {images['range_extent']:.2f} × {images['crossrange_extent']:.2f} m"
        )
        extent = min(images["range_extent"], images["crossrange_extent"])
        if folded := [name for name in results.meshed if 2 * results.reach(name) > extent]:
            reaches = "reaches" if len(folded) == 1 else "reach"
            parts.append(f"{' and '.join(folded)} {reaches} beyond that, so that parts fold over")
    if results.learns:
        known, models = several(len(results.classes), "class", "classes"), len(results.of_role("known"))
        kinds = f"of {models} models in all" if models > len(results.classes) else f"each {_copies(results)}"
        parts.append(f"{known}, {kinds}, without clutter")
        if not all(thesis.full_size(model, settings) for run in results.runs.values() for model in run["models"]):
            parts.append("the capsule network is smaller than the thesis's")
    return f"What bounds it: {'; '.join(parts)}." if parts else ""


def _copies(results):
    """What a class of one model is, and what is recognised of models that never trained, by the repository's scores."""
    case = {"split": "family, novel others", "metric": "auroc", "elevation": "all", "test_snr_db": KINDS_SNR}
    (row,) = select(results.by_family, **case, model="sum").to_dict("records")
    told = f"with an AUROC of {_f1(row)} at {KINDS_SNR} dB (docs/kinds.md)"
    return f"a copy of what trained (models that never trained are told from other things {told})"


def checks(results, warnings):
    """Return rows of 'is it right?': (whether it is, what, finding, where it is shown)."""
    rows, found = [], results.sphere
    if found and "refused" in found:
        rows.append((False, "Sphere", f"not solved in this run: {found['refused']}", "scattering"))
    elif found:
        text = f"{abs(found['error_db']):.3f} dB and {abs(found['phase_deg']):.2f}° from the Mie series"
        text += f", {number(found['unknowns'])} unknowns" if found["unknowns"] else ""
        rows.append((abs(found["error_db"]) <= SPHERE_DB, "Sphere, solved in this run", text, "scattering"))
    stated = [results.scattering(name).attrs["residual"] or () for name in results.targets]
    residuals = [value for values in stated for value in values if value is not None]
    if residuals:
        text = f"at most {number(max(residuals), 2)}, over {several(len(residuals), 'system')}"
        rows.append((max(residuals) <= RESIDUAL, "Residuals", text, "scattering"))
    if results.meshed:
        wanting, every = missed(results), sum(len(mesh["bands"]) for mesh in results.meshes.values())
        count, names = sum(wanting.values()), ", ".join(name for name, bands in wanting.items() if bands)
        text = f"{every - count} of {every} meet all their goals{f'; some missed by {names}' if count else ''}"
        rows.append((not count, "Meshes", text, "meshes"))
    text = f"{len(warnings)} on this run, below" if warnings else "none on this run"
    return [*rows, (not warnings, "Warnings", text, "")]


def section(results):
    code = yaml.safe_dump(results.settings, sort_keys=True, default_flow_style=None, width=100)
    return Section(id="made", title="How this was made", code=code)
