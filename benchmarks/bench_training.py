"""How good the thesis's capsule network becomes with steps of training, by several readings: `make bench-training`.

    bench_training.py                       all READINGS, 130,000 steps: 15 minutes on a GPU, a day on a processor
    bench_training.py program --epochs 2    one of them, for so many epochs
    bench_training.py --draw                the figure of docs/method.md, of the table that is kept

Images are made from the fields of resources/fields as config/thesis.yaml makes them. After some epochs the network is
judged on all images that do not train, those of validation and test azimuths, one realization of the noise. Closed: the
weighted F1, the AUROC of the difference of both lengths, and the F1 with the best zero of that difference. Open, with
the unknown targets: the F1 by ZNCC with the best threshold on the same images, and the AUROC. A row of
results/benchmarks/capsule_training.csv for each epoch and SNR, in place of earlier ones of a reading.
"""

from functools import cache
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pandas as pd
import xarray as xr
from runner import options_of
from sklearn.metrics import f1_score, roc_auc_score

from isarflow.core.compiled import keep_compiled
from isarflow.imaging.formation import apertures, form_images
from isarflow.imaging.geometry import imager_of
from isarflow.imaging.noise import generator, signal_power, variances, white_noise
from isarflow.learning import confidence
from isarflow.learning.classifier import OTHER
from isarflow.learning.data.split import divisions, split
from isarflow.learning.evaluation import thresholds
from isarflow.learning.networks import capsules
from isarflow.setup.config import load_config
from isarflow.setup.yaml_file import read_yaml

OUT, KEPT = Path("results/benchmarks/capsule_training.csv"), Path("resources/results/capsule_training.csv")
CONFIG = load_config(*map(read_yaml, ("config/thesis.yaml", "config/thesis-fields.yaml")))
TARGETS = load_config(read_yaml("config/fields.yaml"))["targets"]  # all of the dataset
KNOWN, UNKNOWN, REALIZATIONS = ("drone", "missile"), ("aircraft", "ufo"), 3
MODEL = CONFIG["learning"]["models"]["capsule"]
SNRS = 24, 15, 6, 0, -3, -6  # dB, of the images judged
EPOCHS = 1, 4, 8, 16, 32, 64, 100  # after which, and after the last
# What the thesis's program states (listing D.1), and what a reading changes: training at 24 dB in batches of 114, the
# learning rate times 0.9 after every `per` batches, which are called an epoch.
PROGRAM = {"snr_db": 24, "batch": 114, "per": 169, "epochs": 64, "decay": 0.9, "seed": 0, "known": KNOWN}
PROGRAM |= {"split": "random", "reformat": "polar", "warm_up": 0}
CLEAN = {"snr_db": "clean", "per": 56, "epochs": 40}
LONG = {"decay": 0.98, "epochs": 150}  # the epochs of the thesis's text
READINGS = {
    "program": {},
    "program, another seed": {"seed": 1, "epochs": 32},
    "without noise": CLEAN,
    # Without a warm-up, which the project's own trainings have, its loss may stay at 0.41.
    "batches of 16": {"batch": 16, "epochs": 32, "warm_up": 1024},
    "decay 0.98": LONG,
    "decay 0.98, without noise": LONG | {"snr_db": "clean"},
    "shuffled": {"split": "shuffled", "epochs": 16},
    "reformat none": {"reformat": "none", "epochs": 16},
    "hexacopter, plain missile, decay 0.98": LONG | {"known": ("drone_hexa", "missile_plain")},
    "guarded drone, plain missile, decay 0.98": LONG | {"known": ("drone_guarded", "missile_plain")},
    "first drone, plain missile": {"known": ("drone", "missile_plain"), "epochs": 8},
    "hexacopter, cruciform missile": {"known": ("drone_hexa", "missile_cruciform"), "epochs": 8},
}


@cache
def sweep(target):
    dataset = xr.open_zarr(f"resources/fields/{target}.zarr")
    return dataset.field.sel(polarization="VV").transpose("elevation", "frequency", "azimuth").load()


@cache
def images(target, scheme, side, snr, realization, reformat):
    """Magnitudes (n, 32, 32, 1) of a side of a target's views by this split: 0 those that train, 1 the others."""
    field, definition, azimuths = sweep(target), CONFIG["noise"]["definition"], divided(target, scheme)[side]
    how = CONFIG["imaging"] | {"reformat": reformat, "upsample": 32}
    imager, random = imager_of(field.frequency.values, field.azimuth.values, how), generator(0, target, 0, realization)
    made = []
    for of_elevation in field.values:
        samples = apertures(of_elevation, field.azimuth.values, how["aperture"])[azimuths].astype(np.complex64)
        if snr != "clean":
            variance = variances(signal_power(samples, definition), snr, "image")
            samples = samples + white_noise(variance, samples.shape[1], random)
        made.append(np.abs(form_images(imager, samples)[0]))
    return np.concatenate(made)[..., None].astype(np.float32)


def divided(target, scheme):
    """Numbers of the azimuths that train, and of the others."""
    (division,) = divisions(scheme, CONFIG["learning"]["split"], CONFIG["seed"], CONFIG["imaging"]["aperture"])
    field = sweep(target)
    sides = split(field.elevation.values, field.azimuth.values, TARGETS[target]["symmetry"], division)
    return sides["train"].azimuth, np.sort(np.concatenate([sides[name].azimuth for name in ("validation", "test")]))


def judged(evaluate, weights, seen, truth, classes):
    """Scores of a network on images of an SNR; truth: labels, OTHER of unknown targets."""
    parts = [evaluate(weights, seen[begin : begin + 512]) for begin in range(0, len(seen), 512)]
    lengths, made = (np.concatenate([np.asarray(part[n]) for part in parts]) for n in range(2))
    zncc = confidence.zncc(seen.reshape(made.shape), made)
    known, predicted = truth != OTHER, classes[lengths.argmax(1)]
    difference, second = (lengths[:, 1] - lengths[:, 0])[known], truth[known] == classes[1]
    zeros = np.unique(np.quantile(difference, np.linspace(0.02, 0.98, 49)))
    opened = thresholds.apply(zncc, predicted, thresholds.best(zncc, truth, predicted))
    values = {
        "closed_f1": f1_score(truth[known], predicted[known], average="weighted"),
        "closed_auroc": roc_auc_score(second, difference),
        "closed_f1_best_zero": max(f1_score(second, difference > zero, average="weighted") for zero in zeros),
        "zncc_f1": f1_score(truth, opened, average="weighted"),
        "zncc_auroc": roc_auc_score(known, zncc),
    }
    return {name: round(float(value), 4) for name, value in values.items()}


def train(name, reading):
    """Train by a reading, and yield rows of the table as they are there."""
    how = PROGRAM | reading
    realizations = range(1 if how["snr_db"] == "clean" else REALIZATIONS)
    scheme, reformat = how["split"], how["reformat"]
    learned = [images(target, scheme, 0, how["snr_db"], n, reformat) for target in how["known"] for n in realizations]
    counts = np.reshape([len(part) for part in learned], (2, -1)).sum(1)
    truth = np.repeat(np.eye(2, dtype=np.float32), counts, axis=0)
    x, y = jnp.asarray(np.concatenate(learned)), jnp.asarray(truth)
    classes, held_out = np.array(how["known"]), {}
    for snr in SNRS:
        seen = [images(target, scheme, 1, snr, "judged", reformat) for target in (*how["known"], *UNKNOWN)]
        labels = [*how["known"], OTHER, OTHER]
        held_out[snr] = np.concatenate(seen), np.repeat(np.array(labels), [len(part) for part in seen])

    random, adam = np.random.default_rng(how["seed"]), optax.scale_by_adam(eps=1e-7)  # Keras's
    weights = capsules.initial_weights(random, (32, 32, 1), 2, MODEL["width"], MODEL["capsules"], MODEL["decoder"])
    weights = jax.tree.map(jnp.asarray, weights)
    state, order = adam.init(weights), np.zeros(0, int)

    def loss(weights, x, y):
        vectors = capsules.activations(weights, x, MODEL["routings"])
        error = ((capsules.reconstruct(weights, vectors, y, True) - x.reshape(len(x), -1)) ** 2).mean(-1)
        return (capsules.margin_loss(vectors, y) + 0.392 * error).mean(), error.mean()  # its weight, listing D.1

    def step(carried, batch):
        (weights, state), (rows, rate) = carried, batch
        values, gradient = jax.value_and_grad(loss, has_aux=True)(weights, x[rows], y[rows])
        change, state = adam.update(gradient, state)
        return (jax.tree.map(lambda weight, by: weight - rate * by, weights, change), state), values

    @jax.jit
    def epoch(weights, state, rows, rates):
        return jax.lax.scan(step, (weights, state), (rows, rates))

    @jax.jit
    def evaluate(weights, seen):
        vectors = capsules.activations(weights, seen, MODEL["routings"])
        lengths = capsules.lengths(vectors)
        mask = (lengths.argmax(-1)[:, None] == jnp.arange(2)).astype(jnp.float32)
        return lengths, capsules.reconstruct(weights, vectors, mask, True)

    for number in range(1, how["epochs"] + 1):
        while len(order) < how["per"] * how["batch"]:
            order = np.concatenate([order, random.permutation(len(x))])
        rows, order = np.split(order, [how["per"] * how["batch"]])
        risen = np.minimum(1, (how["per"] * (number - 1) + 1 + np.arange(how["per"])) / (how["warm_up"] + 1))
        rates = np.float32(MODEL["learning_rate"] * how["decay"] ** (number - 1) * risen)
        (weights, state), (cost, error) = epoch(weights, state, rows.reshape(how["per"], -1), rates)
        if number in EPOCHS or number == how["epochs"]:
            about = {"reading": name, "drone": how["known"][0], "missile": how["known"][1], "batch": how["batch"]}
            about |= {"epoch": number, "steps": number * how["per"]}
            about |= {"loss": f"{cost.mean():.3g}", "squared_error": f"{error.mean():.3g}"}
            for snr, (seen, labels) in held_out.items():
                yield about | {"snr_db": snr} | judged(evaluate, weights, seen, labels, classes)


def draw(table, path):
    """Closed and open F1 against steps, a curve for each reading, dashed with other models of the known targets."""
    import matplotlib.pyplot as plt

    panels = [("closed_f1", snr, f"closed set, {snr} dB") for snr in (0, -3, -6)] + [
        ("zncc_f1", 6, "open set, ZNCC, 6 dB")
    ]
    figure, axes = plt.subplots(1, len(panels), figsize=(12, 3.6), sharey=True, layout="constrained")
    for axis, (column, snr, title) in zip(axes, panels, strict=True):
        for name, rows in table[table["snr_db"] == snr].groupby("reading", sort=False):
            dash = "-" if {*rows["drone"], *rows["missile"]} == set(KNOWN) else "--"
            axis.plot(rows["steps"], rows[column], dash, marker=".", label=name)
        axis.set(title=title, xlabel="steps", xscale="log", ylim=(0.3, 1.01))
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("weighted F1")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(path, dpi=110)


def main():
    readings = {"positional": True, "nargs": "*", "metavar": "READING", "help": ", ".join(READINGS)}
    epochs = {"type": int, "help": "instead of the reading's own"}
    figure = {"action": "store_true", "help": f"the figure of {KEPT} alone"}
    options = options_of(__doc__, readings=readings, epochs=epochs, draw=figure)
    if options.draw:
        return draw(pd.read_csv(KEPT), Path("docs/img/capsule-training.png"))
    print(keep_compiled())
    table = pd.read_csv(OUT) if OUT.exists() else pd.DataFrame({"reading": []})
    for name in options.readings or READINGS:
        table = table[table["reading"] != name]
        for row in train(name, READINGS[name] | ({"epochs": options.epochs} if options.epochs else {})):
            print(row, flush=True)
            table = pd.DataFrame([*table.to_dict("records"), row])
            table.to_csv(OUT, index=False)
    draw(table, OUT.with_suffix(".png"))


if __name__ == "__main__":
    main()
