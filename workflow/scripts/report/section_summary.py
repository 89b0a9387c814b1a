"""The first screen: three sentences, whether the physics is right, and how a run of full size did."""

import pandas as pd

from isarflow.core import sweep
from isarflow.imaging.geometry import planned
from isarflow.learning.experiments import REFERENCE
from isarflow.report import section_headline, thesis
from isarflow.report.layout import number, table
from isarflow.report.section_mesh import missed
from isarflow.report.vocabulary import POWERS, PROTOCOLS, SPLITS, at_snrs, select, split_text

# Within these a run's numbers are taken for right.
SPHERE_DB = 0.2  # of the exact backscatter; with ten edges a wavelength it is 0.01
RESIDUAL = 1e-3  # relative; ten times what compressed matrices are allowed to leave out at most
SNRS = (-6, 0, 12, 24)  # dB, of the table beside a run of full size
BESIDE = {"sector": "far from all in training", "random": "with near copies in training"}  # beside the first split


def sentences(results):
    """(what was done, how well it works, what bounds it), each a sentence or two."""
    return [text for text in (_done(results), *_reached(results), _bounds(results)) if text]


def _done(results):
    settings = results.settings
    frequency = sweep.frequencies(settings["radar"]) / 1e9
    elevation, azimuth = sweep.elevations(settings["aspect"]), sweep.azimuths(settings["aspect"])
    band = f"{frequency[0]:g} GHz" if len(frequency) == 1 else f"{frequency[0]:.3g} to {frequency[-1]:.3g} GHz"
    text = f"The radar echo of {_several(len(results.targets), 'target')} at {band} from {len(elevation)} × "
    text += f"{len(azimuth)} directions"
    if results.meshed:
        some = len(results.meshed) < len(results.targets)
        text += f", solved on {f'the meshes of {len(results.meshed)} of them' if some else 'their meshes'}"
    if results.images_are_made:
        images, snrs = planned(settings), settings["noise"]["snr_db"]
        text += f"; ISAR images of {images['range_pixels']} × {images['crossrange_pixels']} pixels made of it, "
        text += f"without noise and at {_several(len(snrs), 'SNR')}"
    if results.learns:
        known, unknown = (" and ".join(results.of_role(role)) for role in ("known", "unknown"))
        count = len({model for run in results.runs.values() for model in run["models"]})
        text += f"; {_several(count, 'model')} trained to tell {known} apart"
        text += f" and to reject {unknown}" if results.opened else ""
    return f"{text}."


def _reached(results):
    """Weighted F1 of the best method under the first split that was tested, beside the others."""
    if not results.learns:
        return []
    drawn = section_headline.lead(results, results.names, "")
    drawn = drawn[~drawn["theirs"]]
    opened = select(drawn, threshold=PROTOCOLS[0])
    case, kind = (opened, "open set") if len(opened) else (select(drawn, threshold=""), "closed set")
    split = next(split for split in SPLITS if split in set(case["split"]))
    snr = min(case["test_snr_db"], key=lambda one: (abs(one - 12), one))
    best = select(case, split=split, test_snr_db=snr).iloc[0]
    level = (results.rejecting if kind == "open set" else results.guessing)([best["experiment"]])
    words = f"{results.names.method(best['model'], best['score'])}, the best one on the validation images, reaches a"
    words += f" weighted F1 of {_f1(best)}"
    chance = "rejecting everything" if kind == "open set" else "naming one class for all"
    text = (
        f"At {snr:g} dB by {POWERS[results.definition]}, {split_text(split)}"
        f"{', with blind thresholds' if len(opened) else ''}, {words} on the {kind}"
    )
    text += f", where {chance} has {level[-1]:.2f}" if level else ""
    others, tested = [], next(part for name, part, _ in section_headline.sets_of(results) if name == best["set"])
    most = select(tested, split=split, test_snr_db=snr).sort_values("value").iloc[-1]
    if most["value"] > best["value"]:
        others.append(f"on the test images most has {results.names.method(most['model'], most['score'])}, {_f1(most)}")
    for other, words in BESIDE.items():
        there = select(case, split=other, test_snr_db=snr)
        if split != other and len(there):
            others.append(f"{split_text(other)}, {words}, the same has {there.iloc[0]['value']:.2f}")
    closed = select(drawn, threshold="", split=split, test_snr_db=snr)
    if len(opened) and len(closed):
        alone = closed.iloc[0]
        model = results.names.method(alone["model"], alone["score"])
        others.append(
            f"{split_text(split)} on the known targets alone {model}, chosen likewise, has {alone['value']:.2f}"
        )
    return [f"{'; '.join([text, *others])}."]


def _f1(row, to=" to "):
    return f"{row['value']:.2f}" + ("" if pd.isna(row["low"]) else f" ({row['low']:.2f}{to}{row['high']:.2f})")


def _bounds(results):
    """What bounds it, as far as the run itself knows."""
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
        known = results.of_role("known")
        parts.append(f"{_several(len(known), 'class', 'classes')}, each of one model of its kind, without clutter")
        reduced = [name for name in sorted({m for run in results.runs.values() for m in run["models"]})]
        if any(not thesis.full_size(name, settings) for name in reduced):
            parts.append("the capsule network is smaller than the thesis's")
    return f"What bounds it: {'; '.join(parts)}." if parts else ""


def checks(results, warnings):
    """Rows of 'is it right?': (whether it is; None where nothing says so, what, finding, where it is shown)."""
    rows = []
    if results.sphere and "refused" in results.sphere:
        rows.append((False, "Sphere", f"not solved in this run: {results.sphere['refused']}", "scattering"))
    elif results.sphere:
        found = results.sphere
        text = f"{abs(found['error_db']):.3f} dB and {abs(found['phase_deg']):.2f}° from the Mie series"
        text += f", {number(found['unknowns'])} unknowns" if found["unknowns"] else ""
        rows.append((abs(found["error_db"]) <= SPHERE_DB, "Sphere, solved in this run", text, "scattering"))
    residuals = [
        value
        for name in results.targets
        for value in results.scattering(name).attrs["residual"] or ()
        if value is not None
    ]
    if residuals:
        text = f"at most {number(max(residuals), 2)}, over {_several(len(residuals), 'system')}"
        rows.append((max(residuals) <= RESIDUAL, "Residuals", text, "scattering"))
    if results.meshed:
        wanting, every = missed(results), sum(len(mesh["bands"]) for mesh in results.meshes.values())
        count = sum(wanting.values())
        names = ", ".join(name for name, bands in wanting.items() if bands)
        text = f"{every - count} of {every} meet all their goals{f'; some missed by {names}' if count else ''}"
        rows.append((not count, "Meshes", text, "meshes"))
    text = f"{len(warnings)} on this run, below" if warnings else "none on this run"
    rows.append((not warnings, "Warnings", text, ""))
    return rows


def full_size_table(results):
    """Weighted F1 of the best method and of the thesis's, here and in the full-size run that the repository keeps.

    Nothing while it keeps none.
    """
    if not results.learns or results.full_size is None:
        return ()
    runs = {"this run": results, "full size": results.full_size}
    drawn = []
    for where, tables in runs.items():
        rows = section_headline.lead(tables, results.names, thesis.network(REFERENCE[0], results))
        drawn.append(rows.assign(run=where))
    data = pd.concat(drawn)
    shown, snrs = [], {aim: min(set(data["test_snr_db"]), key=lambda snr: abs(snr - aim)) for aim in SNRS}
    for (name, split, theirs, run), curve in data.groupby(["set", "split", "theirs", "run"], sort=False):
        best = results.names.method(curve["model"].iloc[0], curve["score"].iloc[0])
        head = {
            "images": f"{name}, {split_text(split)}",
            "run, and its SNR": f"{run}, {runs[run].definition}",
            "method": f"{'thesis’s: ' if theirs else ''}{best}",
        }
        shown.append(head | at_snrs(curve, sorted(set(snrs.values())), lambda row: _f1(row, "–")))
    shown.sort(key=lambda row: row["images"])
    caption = (
        "Weighted F1 of the method that is best on the validation images and of the thesis's, in this run and in the "
        "run of full size (config/thesis.yaml), whose scores the repository keeps: docs/results.md; with 95 % "
        "intervals. The same SNR by "
        "another power is another one: by peak_3db power the same noise has more dB."
    )
    return (table("full_size", data, shown, caption),)


def _several(count, singular, plural=None):
    return f"{count} {singular if count == 1 else plural or f'{singular}s'}"
