"""The first screen: three sentences, whether the physics is right, and how a run of full size did."""

import pandas as pd

from isarflow.core import sweep
from isarflow.imaging.geometry import planned
from isarflow.report import section_headline, thesis
from isarflow.report.layout import number, several, table
from isarflow.report.section_mesh import missed
from isarflow.report.selection import nearest
from isarflow.report.vocabulary import POWERS, PROTOCOLS, SPLITS, at_snrs, select

# Within these a run's numbers are taken for right.
SPHERE_DB = 0.2  # of the exact backscatter; with ten edges a wavelength it is 0.01
RESIDUAL = 1e-3  # relative; ten times what compressed matrices are allowed to leave out at most
SNRS = (-6, 0, 12, 24)  # dB, of the table beside a run of full size
BESIDE = {"sector": "far from all in training", "random": "with near copies in training"}  # beside the first split


def sentences(results):
    """Return (what was done, how well it works, what bounds it), each a sentence or two."""
    return [text for text in (_done(results), _reached(results), _bounds(results)) if text]


def _done(results):
    settings = results.settings
    frequency = sweep.frequencies(settings["radar"]) / 1e9
    elevation, azimuth = sweep.elevations(settings["aspect"]), sweep.azimuths(settings["aspect"])
    band = f"{frequency[0]:g} GHz" if len(frequency) == 1 else f"{frequency[0]:.3g} to {frequency[-1]:.3g} GHz"
    every = len(results.meshed) == len(results.targets)
    meshes = "their meshes" if every else f"the meshes of {len(results.meshed)} of them"
    solved = f", solved on {meshes}" if results.meshed else ""
    directions = f"{len(elevation)} × {len(azimuth)} directions"
    parts = [f"The radar echo of {several(len(results.targets), 'target')} at {band} from {directions}{solved}"]
    if results.images_are_made:
        images, snrs = planned(settings), several(len(settings["noise"]["snr_db"]), "SNR")
        pixels = f"{images['range_pixels']} × {images['crossrange_pixels']} pixels"
        parts.append(f"ISAR images of {pixels} made of it, without noise and at {snrs}")
    if results.learns:
        known, unknown = (" and ".join(results.of_role(role)) for role in ("known", "unknown"))
        models = several(len({model for run in results.runs.values() for model in run["models"]}), "model")
        parts.append(f"{models} trained to tell {known} apart{f' and to reject {unknown}' if results.opened else ''}")
    return f"{'; '.join(parts)}."


def _reached(results):
    """Return the weighted F1 of the best method near 12 dB: of the first set and split tested, then of others."""
    if not results.learns:
        return ""
    drawn = section_headline.lead(results, results.names)
    drawn = drawn[~drawn["theirs"] & drawn["threshold"].isin(("", PROTOCOLS[0]))]
    snr = nearest(drawn["test_snr_db"], 12)
    at = select(drawn, test_snr_db=snr)
    opened = PROTOCOLS[0] in set(at["threshold"])
    case = select(at, threshold=PROTOCOLS[0] if opened else "")
    first, *others = [split for split in SPLITS if split in set(case["split"])]
    best, images, blind, least = select(case, split=first).iloc[0], "closed", "", "naming one class for all"
    if opened:
        images, blind, least = "open", ", with blind thresholds", "rejecting everything"
    level = (results.rejecting if opened else results.guessing)([best["experiment"]])[-1]
    parts = [
        f"At {snr:g} dB by {POWERS[results.definition]}, {SPLITS[first]}{blind}, "
        f"{results.names.method(best['model'], best['score'])}, the best one on the validation images, reaches a "
        f"weighted F1 of {_f1(best)} on the {images} set, where {least} has {level:.2f}"
    ]
    for split in (split for split in others if split in BESIDE):
        value = select(case, split=split).iloc[0]["value"]
        parts.append(f"{SPLITS[split]}, {BESIDE[split]}, the same has {value:.2f}")
    closed = select(at, threshold="", split=first)
    if opened and len(closed):
        method = results.names.method(closed.iloc[0]["model"], closed.iloc[0]["score"])
        parts.append(f"on the known targets alone {method}, chosen likewise, has {closed.iloc[0]['value']:.2f}")
    return f"{'; '.join(parts)}."


def _f1(row, to=" to "):
    return f"{row['value']:.2f}" + ("" if pd.isna(row["low"]) else f" ({row['low']:.2f}{to}{row['high']:.2f})")


def _bounds(results):
    """Return what bounds it, as far as the run itself knows."""
    parts, settings = [], results.settings
    if results.images_are_made:
        images, window = planned(settings), settings["imaging"].get("window", "boxcar")
        coarser = "" if window == "boxcar" else f", less by their {window} window,"
        parts.append(
            f"images resolve {images['range_resolution']:.2f} × {images['crossrange_resolution']:.2f} m{coarser} over "
            f"an unambiguous {images['range_extent']:.2f} × {images['crossrange_extent']:.2f} m"
        )
        reach = {name: mesh["source"]["reach"] for name, mesh in results.meshes.items()}
        folded = [name for name in reach if 2 * reach[name] > min(images["range_extent"], images["crossrange_extent"])]
        if folded:
            reaches = "reaches" if len(folded) == 1 else "reach"
            parts.append(f"{' and '.join(folded)} {reaches} beyond that, so that parts fold over")
    if results.learns:
        known = several(len(results.of_role("known")), "class", "classes")
        parts.append(f"{known}, each of one model of its kind, without clutter")
        if not all(thesis.full_size(model, settings) for run in results.runs.values() for model in run["models"]):
            parts.append("the capsule network is smaller than the thesis's")
    return f"What bounds it: {'; '.join(parts)}." if parts else ""


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


def full_size_table(results):
    """Return weighted F1 of the best method and of the thesis's, here and in the full-size run that is kept, if any."""
    if not results.learns or results.full_size is None:
        return ()
    runs = {"this run": results, "full size": results.full_size}
    data = pd.concat(section_headline.lead(of, results.names).assign(run=run) for run, of in runs.items())
    shown, snrs = [], sorted({nearest(data["test_snr_db"], aim) for aim in SNRS})
    for (name, split, theirs, run), curve in data.groupby(["set", "split", "theirs", "run"], sort=False):
        method = results.names.method(curve["model"].iloc[0], curve["score"].iloc[0])
        head = {"images": f"{name}, {SPLITS[split]}", "run, and its SNR": f"{run}, {runs[run].definition}"}
        head["method"] = f"{'thesis’s: ' if theirs else ''}{method}"
        shown.append(head | at_snrs(curve, snrs, lambda row: _f1(row, "–")))
    shown.sort(key=lambda row: row["images"])
    caption = (
        "Weighted F1 of the method that is best on the validation images and of the thesis's, with 95 % intervals, "
        "here and in the run of full size (config/thesis.yaml, docs/results.md). By peak_3db power the same noise has "
        "more dB."
    )
    return (table("full_size", data, shown, caption),)
