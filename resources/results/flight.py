"""Publish the run in flight, or one of those that lead there: `make flight`, `make flight-steps`.

    flight.py results/flight
    flight.py results/flight-metal
    flight.py results/flight-still

Writes a run's scores into the folder of its name beside this file, compressed (xz), and, of all three as they are kept,
the tables of docs/flight.md between their marks, and its figure, which the repository's README.md shows.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import pandas as pd
from recognition import ROOT, head, keep, put, whole

METAL, STILL, FLIGHT = "flight-metal", "flight-still", "flight"
STEPS = {  # words of a curve: run, experiment, model, its score
    "laboratory": (METAL, "laboratory", "likelihood", "likelihood"),
    "+ place unknown": (METAL, "place", "likelihood", "likelihood"),
    "+ drift, jitter, lost pulses": (METAL, "drift", "likelihood", "likelihood"),
    "+ other models": (METAL, "models", "sum", "sum"),
    "+ materials": (STILL, "still", "sum", "sum"),
    "+ turning blades: in flight": (FLIGHT, "flight", "sum", "sum"),
}
LIBRARY = "likelihood_other", "likelihood"  # a model, its score
HELP = {  # what would help: run, experiment
    "as it is": (FLIGHT, "flight"),
    "in VV alone": (FLIGHT, "flight_vv"),
    "blades that stand still": (STILL, "still"),
    "its place known, all pulses": (STILL, "placed"),
}
MODELS = {"likelihood_other": "likelihood", "cnn": "margin", "sum": "sum", "zncc": "correlation"}  # with their score
LOOKS = 1, 3, 5
THRESHOLD = "blind"
SHOWN_SNR = 12  # dB
COLOURS = ("C0", "C9", "C2", "C4", "C1", "C3")
METRICS = {"accuracy": "Drone, bird or missile: accuracy", "f1_weighted": "And nothing else: weighted F1, open set"}


def main():
    here, run = Path(__file__).parent, Path(sys.argv[1])
    keep(run / "learning", here / run.name)
    tables = {name: whole(here / name / "scores.csv.xz") for name in (METAL, STILL, FLIGHT)}
    draw(tables, ROOT / "docs/img/flight.svg")
    page = ROOT / "docs/flight.md"
    for metric in METRICS:
        put(page, metric, ladder(tables, metric))
        put(page, f"{metric} in flight", in_flight(tables[FLIGHT], metric))
        put(page, f"{metric} by help", helped(tables, metric))
    confusion = pd.read_csv(here / FLIGHT / "confusion.csv.xz", keep_default_na=False)
    put(page, "taken for", taken_for(confusion))


def of(table, experiment, model, score, metric, count=1):
    """Values and intervals of a metric of so many looks by SNR. Of a known target's label there is no score."""
    name, threshold = metric if count == 1 else f"{metric}_{count}_looks", THRESHOLD
    score, threshold = ("", "") if metric == "accuracy" else (score, threshold)
    rows = table[(table["experiment"] == experiment) & (table["model"] == model) & (table["metric"] == name)]
    rows = rows[(rows["score"] == score) & (rows["threshold"] == threshold)].set_index("test_snr_db").sort_index()
    return rows[["value", "low", "high"]].apply(pd.to_numeric)


def ladder(tables, metric):
    """A metric of one look at each of STEPS against SNR with its 95 % interval, in Markdown."""
    return _table({words: of(tables[run], *what, metric) for words, (run, *what) in STEPS.items()}, "what is lifted")


def in_flight(table, metric):
    """The same of each model, and of several looks, in flight."""
    rows = {}
    for model, score in MODELS.items():
        for count in LOOKS:
            found = of(table, FLIGHT, model, score, metric, count)
            if len(found):
                rows[f"{model}, {count} look{'s' if count > 1 else ''}"] = found
    return _table(rows, "model")


def helped(tables, metric):
    """The same of the library, where something is otherwise."""
    return _table(
        {words: of(tables[run], name, *LIBRARY, metric) for words, (run, name) in HELP.items()}, "otherwise"
    )


def _table(rows, first):
    snrs = sorted(set().union(*(values.index for values in rows.values())))
    lines = head([f"{snr:g} dB" for snr in snrs], first)
    for words, values in rows.items():
        lines.append(f"| {words} | {' | '.join(_cell(values.loc[snr]) for snr in snrs)} |")
    return "\n".join(lines) + "\n"


def _cell(row):
    interval = "" if pd.isna(row.low) else f" ({row.low:.2f}\N{EN DASH}{row.high:.2f})"
    return f"{row.value:.3f}{interval}"


def taken_for(confusion):
    """What images of each kind are taken for in flight at SHOWN_SNR, in shares, in Markdown."""
    rows = confusion[(confusion["experiment"] == FLIGHT) & (confusion["model"] == "sum")]
    rows = rows[(rows["threshold"] == THRESHOLD) & (rows["test_snr_db"] == SHOWN_SNR) & (rows["elevation"] == "all")]
    rows = rows.assign(kind=rows["target"].str.replace(r"_\d+$", "", regex=True))
    counts = rows.pivot_table(index="kind", columns="predicted", values="count", aggfunc="sum").fillna(0)
    shares = counts.div(counts.sum(axis=1), axis=0)
    labels = [label for label in ("drone", "bird", "missile", "other") if label in shares]
    lines = head(labels, "kind")
    for kind, row in shares.sort_values(labels, ascending=False).iterrows():
        lines.append(f"| {kind} | {' | '.join(f'{row[label]:.2f}' for label in labels)} |")
    return "\n".join(lines) + "\n"


def draw(tables, path):
    """Draw METRICS of each of STEPS against SNR with 95 % intervals, and of five looks in flight."""
    plt.rcParams.update({"svg.hashsalt": "isarflow", "font.size": 10})
    figure, columns = plt.subplots(1, 2, figsize=(10, 4.2), sharex=True, layout="constrained")
    for axes, (metric, title) in zip(columns, METRICS.items(), strict=True):
        for colour, (words, (run, *what)) in zip(COLOURS, STEPS.items(), strict=True):
            rows = of(tables[run], *what, metric)
            axes.plot(rows.index, rows["value"], "o-", color=colour, label=words, ms=4)
            axes.fill_between(rows.index, rows["low"], rows["high"], color=colour, alpha=0.1, lw=0)
        five = of(tables[FLIGHT], *STEPS["+ turning blades: in flight"][1:], metric, LOOKS[-1])
        axes.plot(five.index, five["value"], "s--", color=colour, label="in flight, five looks", ms=4)
        axes.set(title=title, xlabel="SNR [dB]", xticks=five.index, ylim=(None, 1.01))
        axes.grid(alpha=0.3)
    columns[0].legend(loc="lower right", fontsize=8)
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


if __name__ == "__main__":
    main()
