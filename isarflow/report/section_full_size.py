"""The headline's methods beside the same methods in the full-size runs whose scores the repository keeps."""

import pandas as pd

from isarflow.report.layout import Section, table
from isarflow.report.section_headline import lead
from isarflow.report.selection import TABLE_SNRS, evenly
from isarflow.report.vocabulary import F1, METHOD, SPLITS, at_snrs, select

PLACE, NEEDS = ("recognition", 0.5), "learns"  # on the page, see page.py
SAME = ["split", "model", "training", "score", "threshold", "polarizations"]  # of a method, however it is called


def section(results):
    tables = full_size_table(results)
    return Section("full", "At full size", tables=tables) if tables else ()


def full_size_table(results):
    """Return weighted F1 of the headline's methods here and at full size, by mean power: one table, or none.

    A method has rows where a full-size run has the same method.
    """
    experiments, case = results.settings["learning"]["experiments"], {"metric": F1, "elevation": "all"}
    # Other experiments learn from fewer views or targets than the full-size runs.
    whole = [name for name, of in experiments.items() if of["train"]["elevation"] == "all" and not of.get("without")]
    methods = select(lead(results), experiment=whole)[["set", "threshold", *METHOD]].drop_duplicates()
    seen = {name: ", ".join(sorted(of.get("channels", results.polarizations))) for name, of in experiments.items()}
    methods["polarizations"] = methods["experiment"].map(seen).astype(str)  # of none the map is not of text
    sized = select(results.full_size, **case).drop(columns="experiment").drop_duplicates([*SAME, "test_snr_db"])
    here = methods.merge(select(results.mean_scores, **case), on=[*METHOD, "threshold"])
    pairs = {"this run": here, "full size": methods.merge(sized, on=SAME)}
    shared = set.intersection(*(set(of["test_snr_db"]) for of in pairs.values()))
    snrs, shown, data = evenly(shared, TABLE_SNRS) if shared else [], [], []
    for row in methods.itertuples(index=False):
        of_method = {"set": row.set, **{name: getattr(row, name) for name in METHOD}}
        curves = {run: select(of, **of_method) for run, of in pairs.items()}
        for run, curve in curves.items() if all(map(len, curves.values())) else ():
            head = {"images": f"{row.set}, {SPLITS[row.split]}", "method": results.names.method(row.model, row.score)}
            shown.append(head | {"run": run} | at_snrs(curve, snrs))
            data.append(curve.assign(run=run))
    caption = (
        "Weighted F1 with 95 % intervals of the headline's methods, here and at full size: the same model, confidence "
        "score, thresholds, split, training SNRs, polarizations and targets. docs/recognition.md and "
        "docs/results.md have the runs of full size. SNR by mean power."
    )
    return (table("full_size", pd.concat(data), shown, caption),) if shown else ()
