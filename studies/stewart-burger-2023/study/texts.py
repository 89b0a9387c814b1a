"""Parts of the thesis's figures that are tables and sentences, as of `figures`; and the overview of all statements."""

from itertools import product

import numpy as np
from sklearn.metrics import roc_auc_score, roc_curve

from isarflow.core.words import number
from isarflow.report.published import holds, value_at
from isarflow.report.vocabulary import ACCURACY, F1, at_snrs, select, title, with_interval
from study import anew, pairs
from study.markdown import NONE, table
from study.selection import LOW_SNR, PAGE, networks_of
from study.statements import SPLIT, ours, read, rows

NEARLY = 0.1  # relative: a setting tried that is so near to the published one stands for it
KEPT = {None: NONE, True: "yes", False: "no"}  # whether a statement holds, in words


def value_text(value, snr):
    """Return a value as of `value_at` with its interval, and its SNR where that is not the one asked for."""
    if value is None:
        return NONE
    other = f" (at {value['here_at_snr_db']:.3g} dB)" if value["here_at_snr_db"] != snr else ""
    return f"{with_interval(value | {'value': value['ours']})}{other}"


def _statement(line):
    """Return a judged statement as cells of a table."""
    cells = {"what": f"{line['name']}, {line['words']}", "stated": line["stated"], "published": line["published"]}
    return cells | {"here": value_text(line["here"], line["snr_db"]), "as published": KEPT[line["holds"]]}


def overview(built):
    """Return what holds under which reading, and a table of all statements. built: figures as of `page.build`."""
    lines = [(figure.link, line) for figure in built for line in figure.found]
    every = [(link, line) for link, line in lines if line["holds"] is not None]
    stated = []
    for link, line in lines:
        values = [(f"{name} {value_text(here, line['snr_db'])}", holds) for name, here, holds in line["otherwise"]]
        others = "; ".join(f"**{text}**" if holds else text for text, holds in values) or NONE
        stated.append({"": link, **_statement(line), "read otherwise": "" if line["holds"] else others})
    if not every:
        return f"This run has none of them.\n\n{table(stated)}"
    read = []
    for name, reading in PAGE["readings"].items():
        own = [(link, line["holds"], holds) for link, line in every for of, _, holds in line["otherwise"] if of == name]
        if own:
            row = {"reading": name, "what it changes": reading["words"], "statements": len(own)}
            row |= {"hold by the text": sum(of[1] for of in own), "hold by it": sum(of[2] for of in own)}
            links = dict.fromkeys(link for link, by_text, by_it in own if by_it and not by_text)
            read.append(row | {"by it, not by the text": ", ".join(links) or NONE})
    of_text = [name for name, reading in PAGE["readings"].items() if "models" not in reading]
    by_text, by_any, with_models = (
        sum(line["holds"] or any(holds for name, _, holds in line["otherwise"] if name in names) for _, line in every)
        for names in ((), of_text, PAGE["readings"])
    )
    held = PAGE["held"].format(text=by_text, read=by_any, models=with_models, all=len(every))
    readings = [PAGE["readings_are"], table(read)] if read else []
    return "\n\n".join([held, *readings, "## All published scores", PAGE["read_otherwise"], table(stated)])


def models_of_targets(built):
    """Say what holds with each pair of known targets, by any of the readings of other models."""
    lines = [line for figure in built for line in figure.found if line["experiment"] not in PAGE["pairs"]["without"]]
    readings, stated = [reading for reading in PAGE["readings"].values() if "models" in reading], []
    for pair in pairs.EVERY:
        there, models = pairs.results(*pair.values()), {"models": pair.values()}
        found = [[read(there, line, reading | models) for reading in readings] for line in lines]
        judged = [[holds(here, line) for here in own if here] for own, line in zip(found, lines, strict=True)]
        row = pair | {"statements": sum(map(bool, judged)), "hold": sum(map(any, judged))}
        for words, (snr, *case) in PAGE["pairs"]["shown"].items():
            row[words] = value_text(value_at(there, ours(there, *case), snr), snr)
        stated.append(row)
    return f"{PAGE['pairs']['words']}\n\n{table(stated)}"


def statements(results, figure):
    """Say what the document states in numbers and what this run has: a row for each statement."""
    is_open, has_sector = (any(line[key] for line in figure.found) for key in ("score", "sector"))
    heads, stated = {"blind": "`blind` thresholds"} if is_open else {}, []
    heads |= {"sector": f"split by sector{', `blind` thresholds' * is_open}"} if has_sector else {}
    for line in figure.found:
        row = _statement(line) | {"read at": f"{line['snr_db']:g} dB".replace("inf dB", "no noise")}
        stated.append(row | {head: value_text(line[name], line["snr_db"]) for name, head in heads.items()})
    yield table(stated)


def times(results, figure):
    """List published prediction times beside ours."""
    listed = []
    for experiment, model in ((name, model) for name, models in figure.uses.items() for model in models):
        printed = select(results.published_times, model=model, experiment=experiment).iloc[0]
        there, images_there = printed["milliseconds_per_observation"], printed["training_observations"]
        row = {"model": results.names.model(model).label, "experiment": title(experiment)}
        row |= {"published [ms]": number(there, 5), "training images there": number(images_there, 6)}
        here = rows(results, "times", experiment=experiment, model=model)
        if len(here):  # of an experiment that trains at each of several SNRs all, which are of one size
            row["training images here"] = f"{here['training_observations'].iloc[0]}"
            row["here, one at a time [ms]"] = number(here["single_ms"].mean())
            row["here, in batches [ms]"] = number(here["batch_ms"].mean())
            row["published / here in batches"] = number(there / here["batch_ms"].mean(), 2)
        listed.append(row)
    yield table(listed)


def hyper_parameters(results, figure):
    """List published settings beside ours, and beside those that searches on validation images choose."""
    chosen = {own.split("/")[1]: tuple(of.split("/")) for own, of in PAGE["readings"]["tuned"]["rows"].items()}
    listed = []
    for line in results.published_settings.to_dict("records"):
        name, model = line["setting"], line["model"]
        own, search = results.settings["learning"]["models"].get(model, {}), results.searches.get(chosen.get(model), ())
        row = {"model": results.names.model(model).label, "setting": name}
        row |= {"published": f"{line['value']} ({line['source']})", "here": own.get(name, NONE)}
        if name in search:
            best = search.loc[search["validation_accuracy"].idxmax()]
            tried = ", ".join(f"{value:g}" for value in sorted(search[name].unique()))
            alike = search[np.isclose(search[name], float(line["value"]), rtol=NEARLY)]["validation_accuracy"]
            row["chosen on validation images"] = f"{best[name]:g} of {tried}"
            row["accuracy there"] = f"{best['validation_accuracy']:.4f}"
            row["at most with the published value"] = f"{alike.max():.4f}" if len(alike) else NONE
        listed.append(row)
    yield table(listed)


def tuned(results, figure):
    """List the accuracy on the test images with published settings and with those chosen on validation images."""
    networks = [network.split("/") for pair in PAGE["readings"]["tuned"]["rows"].items() for network in pair]
    curves = [(results.names.model(model).label, ours(results, name, model, ACCURACY)) for name, model in networks]
    yield values_table(curves, "accuracy on test images")


def by_thresholds(results, figure):
    """List what thresholds from test images add to those from validation images, by the scores of figure.effects."""
    listed = []
    for model, (score, aim) in product(figure.there[:1], figure.effects.items()):
        snr = anew.nearest_snr(results, aim)
        found = anew.judged(results, figure.experiment, model, score, snr)
        case = {"experiment": figure.experiment, "split": SPLIT, "model": model, "score": score, "metric": "auroc"}
        area = select(results.scores, **case, elevation="all", test_snr_db=snr).to_dict("records")
        row = {"weighted F1 of": f"{results.names.method(model, score)}, {snr:g} dB"}
        for name, level in found.thresholds.items():
            row[PAGE["headings"][name]] = f"{found.metrics[name][F1]:.4f} at {number(anew.plain(score, level))}"
        listed.append(row | {"what that adds": found.gain, "AUROC": with_interval(area[0]) if area else NONE})
    yield table(listed)


def values_table(curves, head=""):
    """Return a table of our values at some SNRs, with intervals. curves: (words, rows by SNR); head: over words."""
    every = sorted({snr for _, of in curves for snr in of["test_snr_db"]})
    snrs = [snr for snr in PAGE["snrs"] if snr in every] or every
    return table([{head: words} | at_snrs(of, snrs, with_interval) for words, of in curves if len(of)])


def epochs(results, figure):
    """Say how long a network trained, and when it first knew most of its training images."""
    curve = results.curves.get((figure.experiment, *figure.models))
    if curve is not None:
        best = curve.loc[curve["accuracy"].round(4).idxmax()]  # the first of equals
        theirs = select(results.published_settings, model=figure.models[0], setting="epochs")["value"].iloc[0]
        yield {"model": results.names.model(figure.models[0]).words, "count": len(curve), "theirs": theirs, **best}


def class_bias(results, figure):
    """Say how well capsule networks rank images of two classes at -6 dB, and how many lie on the right side of zero."""
    known, snr = results.of_role("known"), anew.nearest_snr(results, LOW_SNR)
    networks = [network for network in networks_of(results.runs) if network[1].startswith("capsule")]
    for run, model in networks if len(known) == 2 else ():
        test = select(results.predictions(run, model, snr), side="test", target=known)
        first, difference = test["target"] == known[0], test[f"score_{known[0]}"] - test[f"score_{known[1]}"]
        others, own, _ = roc_curve(first, difference)
        values = {"right": ((difference > 0) == first).mean(), "best": (own + 1 - others).max() / 2}
        values |= {"auroc": roc_auc_score(first, difference), "named": known[0], "share": (difference > 0).mean()}
        yield values | {"model": results.names.model(model).words, "snr": snr}


def measured(results, says, values):
    """Fill a sentence with values of this run; leave it out where the run lacks one. values: `_value` by place."""
    found = {place: _value(results, **case) for place, case in values.items()}
    if all(found.values()):
        yield says.format(**{place: value["ours"] for place, value in found.items()})


def _value(results, snr_db, **case):
    """Return a value as of `value_at`; case: as of `ours`, or reading, epoch and column of `pairs.TRAININGS`."""
    if "reading" in case:
        column = case.pop("column")
        return {"ours": select(pairs.TRAININGS, **case, snr_db=snr_db)[column].iloc[0]}
    return value_at(results, ours(results, **case), snr_db)


def power_offsets(results, figure):
    """Say how much higher SNRs read by the power of an aperture's peak than by mean power."""
    every = results.of_role("known") + results.of_role("unknown") if results.images_are_made else []
    offsets = {name: results.images(name, "clean").attrs["snr_definition_offset_db"] for name in every}
    if offsets:
        yield {"offsets": ", ".join(f"{name} {offset:.1f} dB" for name, offset in offsets.items())}
