"""What is recognised by kind over what trained: models, other kinds, channels, resolution: `make kinds-growth`.

The hundred models of config/families-fields.yaml at one SNR, others by kind (the experiment `novel` of
config/kinds.yaml), folds 1 to 3, each with a draw of its own of what trains. Every view trains the library, a random
part of them the network, which has about as many steps in every case. The noise of a sample is the same, so that half
the bandwidth and aperture also focus less energy. Rows are appended to kinds-growth.csv as they are done, and done ones
are not done again (delete it after a change); the figure is kinds-growth.png beside it.
"""

import itertools

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import xarray as xr
from imaged import Imaged
from joblib import Parallel, delayed
from runner import options_of, show
from sklearn.metrics import roc_auc_score

from isarflow.core.sweep import azimuths, elevations, frequencies
from isarflow.learning.classifier import OTHER, build_classifier
from isarflow.learning.data.split import Division, apart, by_family
from isarflow.scattering.fields.given_store import read_store
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

DRAWS, SNR = (1, 2, 3), 12  # which are folds, too; dB of the mean power of VV
ALL = {"models": 12, "kinds": 10, "channels": "VV+HH+HV", "resolution": 1.0}
OVER = {
    "models": (1, 2, 4, 8, 12),
    "kinds": (1, 2, 4, 8, 10),
    "channels": ("VV", "VV+HH", "VV+HH+HV"),
    "resolution": (0.5, 1.0),
}
METHODS = {"likelihood_other": 1.0, "cnn": 1 / 6}  # and the share of the views that train
PASSES = 100_000  # images that a network sees
LABELS = {"likelihood_other": "likelihood", "cnn": "network"}
LOOKS = (1, 3)
KEY = ["method", "over", "value", "draw"]


def images_of(config, channels, resolution):
    """The `Imaged` of all targets, of some channels and at some share of the bandwidth and of the aperture."""
    imaging, every = config["imaging"] | {"polarizations": channels}, frequencies(config["radar"])
    if resolution < 1:
        imaging["aperture"] = round(imaging["aperture"] * resolution) // 2 * 2 + 1
    kept = round(len(every) * resolution)
    first = (len(every) - kept) // 2
    axes = {"frequency": every[first : first + kept], "elevation": elevations(config["aspect"])}
    axes["azimuth"] = azimuths(config["aspect"])
    coords, fields = {"polarization": channels, **axes}, {}
    for target, settings in config["targets"].items():
        field, _ = read_store(settings["field"], channels, axes, settings["symmetry"])
        fields[target] = xr.DataArray(field, coords, [*coords])
    return Imaged(fields, imaging)


def row(config, case):
    """What a method recognises in a case: AUROC of one or more looks at random views, and the closed set's accuracy."""
    method, draw = case["method"], case["draw"]
    given = ALL | {case["over"]: type(ALL[case["over"]])(case["value"])}
    random = np.random.default_rng([draw, *method.encode(), *str(given).encode()])
    images = images_of(config, given["channels"].split("+"), given["resolution"])
    targets = {name: {**of, "class": of.get("class", name)} for name, of in config["targets"].items()}
    # By the aperture of the config views that test are apart, whatever the resolution.
    division = Division("family", draw, {"others": "novel"}, config["seed"], config["imaging"]["aperture"])
    sides = by_family(targets, division)
    truth = {name: of["class"] if of["role"] == "known" else OTHER for name, of in targets.items()}
    trained = _chosen(targets, truth, sides, given, np.random.default_rng([draw, *b"chosen"]))
    every, count = range(len(images.elevation)), round(METHODS[method] * len(images.azimuth))
    views = {name: [np.sort(random.permutation(len(images.azimuth))[:count]) for _ in every] for name in trained}
    parts = [images.of(name, every, views[name]) for name in trained]
    labels = np.repeat([truth[name] for name in trained], [len(part) for part in parts])
    settings = dict(config["learning"]["models"][method])
    of_kind = settings.pop("kind", method)
    if "epochs" in settings:
        settings["epochs"] = round(PASSES / len(labels))
    model = build_classifier(of_kind, settings, config["seed"])
    model.noise = images.of_noise(random)
    model.fit(np.concatenate(parts), labels)

    random = np.random.default_rng([draw, *b"test"])  # the same noise and looks in every case
    tested = [name for name, side in sides.items() if side == "test"]
    found = []
    for name in tested:
        views = [apart(images.azimuth, name, division)] * len(images.elevation)
        found.append(_by_looks(model, images.of(name, every, views, SNR, random), random))
    classes, result = model.classes_[model.classes_ != OTHER], case | {"images": len(labels)}
    for count in LOOKS:
        margins = [of[count][1] for of in found]
        known = np.repeat([truth[name] != OTHER for name in tested], [len(of) for of in margins])
        result[f"auroc_{count}"] = roc_auc_score(known, np.concatenate(margins))
        named = [classes[of[count][0].argmax(axis=1)] == truth[name] for name, of in zip(tested, found, strict=True)]
        result[f"accuracy_{count}"] = np.concatenate(named)[known].mean()
    return result


def _chosen(targets, truth, sides, given, random):
    """The targets that train: so many models of each known class, and all of so many other kinds, at random."""
    training, chosen = [name for name in sides if sides[name] == "train"], []
    for label in sorted(set(truth.values()) - {OTHER}):
        chosen += list(random.permutation([name for name in training if truth[name] == label])[: given["models"]])
    kinds = random.permutation(sorted({targets[name]["kind"] for name in training if truth[name] == OTHER}))
    return chosen + [
        name for name in training if truth[name] == OTHER and targets[name]["kind"] in kinds[: given["kinds"]]
    ]


def _by_looks(model, images, random):
    """Scores of the known classes and margins, sums over so many looks, which are random views of a target."""
    outcome = model.evaluate(images)
    scores, (margins, *_) = outcome.scores[:, model.classes_ != OTHER], outcome.known.values()
    orders = [random.permutation(len(images)) for _ in range(max(LOOKS))]
    return {count: tuple(sum(of[order] for order in orders[:count]) for of in (scores, margins)) for count in LOOKS}


def cases():
    """One for each method, value and draw; the case of all models, kinds, channels and bandwidth is among them once."""
    values = [(over, value) for over, every in OVER.items() for value in every if value != ALL[over]]
    values = [("models", ALL["models"]), *values]
    return [
        {"method": method, "over": over, "value": str(value), "draw": draw}
        for method, (over, value), draw in itertools.product(METHODS, values, DRAWS)
    ]


def draw_figure(table, path):
    """Draw AUROC over each quantity: the mean of the draws, and each of them as a dot."""
    figure, axes = plt.subplots(1, len(OVER), figsize=(11, 3.6), layout="constrained", sharey=True)
    heads = "models of each known class", "kinds of other things", "polarizations", "share of bandwidth and aperture"
    whole = table[(table["over"] == "models") & (table["value"] == str(ALL["models"]))]
    for ax, (over, values), head in zip(axes, OVER.items(), heads, strict=True):
        parts = [table[table["over"] == over], whole.assign(value=str(ALL[over]))]
        rows = pd.concat(parts).drop_duplicates(KEY[:1] + KEY[2:])
        places = np.arange(len(values)) if over == "channels" else np.array(values, float)
        rows = rows.assign(place=rows["value"].map(dict(zip(map(str, values), places, strict=True))))
        for method, count in itertools.product(METHODS, LOOKS):
            of_method = rows[rows["method"] == method]
            line = of_method.groupby("place")[f"auroc_{count}"].mean()
            label = f"{LABELS[method]}, {count} look{'s' * (count > 1)}"
            color, style = f"C{list(METHODS).index(method)}", "-" if count == 1 else "--"
            ax.plot(line.index, line, style, color=color, marker="o", ms=4, label=label)
            if count == 1:
                ax.plot(of_method["place"], of_method["auroc_1"], ".", color=color, alpha=0.4, ms=4)
        ax.set(xlabel=head, xticks=places, xmargin=0.15)
        ax.set_xticklabels([str(value).replace("+HV", "\n+HV") for value in values])
        ax.grid(alpha=0.3)
    axes[0].set(ylabel="AUROC, other things of new kinds", ylim=(0.45, 1))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.savefig(path, dpi=90)


def main():
    options = options_of(__doc__, blas_threads=1)
    path = options.out / "kinds-growth.csv"
    config = load_config(read_yaml("config/families-fields.yaml"), read_yaml("config/kinds.yaml"))
    done = pd.read_csv(path, dtype={"value": str}) if path.exists() else pd.DataFrame(columns=KEY)
    finished = {*done[KEY].astype(str).itertuples(index=False, name=None)}
    left = [case for case in cases() if tuple(map(str, case.values())) not in finished]
    parallel = Parallel(n_jobs=options.threads, return_as="generator_unordered")
    for made in parallel(delayed(row)(config, case) for case in left):
        pd.DataFrame([made]).to_csv(path, mode="a", header=not path.exists(), index=False, float_format="%.4f")
        show(made)
    draw_figure(pd.read_csv(path, dtype={"value": str}), options.out / "kinds-growth.png")


if __name__ == "__main__":
    main()
