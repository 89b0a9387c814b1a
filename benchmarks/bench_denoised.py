"""Why a Wiener filter in front of ZNCC helps so little, after `make recommended`: `make bench-denoised`.

COUNT images of each target by elevation, of the first fold of results/recommended, are compared with its library by
ZNCC of magnitudes: as they are; after the filter, with the library as it is (the model `wiener`), and with the library
after the filter for as much noise as signal; and as they are, with the noise's power added to that of each view.
Accuracy of drone and missile, and AUROC against aircraft and ufo.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
from runner import options_of, show
from sklearn.metrics import roc_auc_score

from isarflow.learning import noise
from isarflow.learning.classifier import load_classifier
from isarflow.learning.data import images
from isarflow.learning.data.features import standardized, unit_rows

RUN, FOLD = Path("results/recommended"), "elevation_fold1"
KNOWN, UNKNOWN = ("drone", "missile"), ("aircraft", "ufo")
SNRS, COUNT, AZIMUTHS, SHARE = (-6, 0, 6), 180, 40, 0.5  # dB; images a target; of so many azimuths; noise of a view


def main():
    options, rows = options_of(__doc__), []
    models = RUN / "learning/models" / FOLD
    wiener, library = (load_classifier(models / name) for name in ("wiener", "likelihood"))
    sides = json.loads((models / "likelihood/split.json").read_text())["targets"]
    views, names = library.templates_, np.repeat(library.classes_, np.diff(library.starts_))
    gain = (1 - SHARE) * wiener.powers_ / ((1 - SHARE) * wiener.powers_ + SHARE)
    filtered = views @ wiener.basis_ * gain @ wiener.back_
    for snr in SNRS:
        random = np.random.default_rng(0)
        parts = [drawn(target, snr, sides.get(target, {}).get("test", {}), random) for target in (*KNOWN, *UNKNOWN)]
        seen, truth = np.concatenate(parts), np.repeat((*KNOWN, *UNKNOWN), COUNT)
        clean = wiener.denoised(seen.reshape(-1, *library.shape_)).reshape(seen.shape)
        power = noise.share(np.abs(seen), wiener.noise_)[:, None] * wiener.noise_
        noisy = (
            zncc(one[None], np.sqrt((1 - of.sum()) * np.abs(views) ** 2 + of))
            for one, of in zip(seen, power, strict=True)
        )
        ways = {
            "as they are": zncc(seen, views),
            "images filtered": zncc(clean, views),
            "images and library filtered": zncc(clean, filtered),
            "noise added to the library": np.concatenate([*noisy]),
        }
        for way, likeness in ways.items():
            known, named = np.isin(truth, KNOWN), names[likeness.argmax(axis=1)]
            row = {"snr_db": snr, "way": way, "accuracy": float((named == truth)[known].mean())}
            rows.append(row | {"auroc": float(roc_auc_score(known, likeness.max(axis=1)))})
            show(rows[-1])
    pd.DataFrame(rows).to_csv(options.out / "denoised.csv", index=False, float_format="%.4g")


def drawn(target, snr, side, random):
    """COUNT images of a target as unit rows, of its test elevations if it has any."""
    store = RUN / f"imaging/{target}/snr_{snr}dB.zarr"
    azimuth = random.choice(images.azimuths(store), AZIMUTHS, replace=False)
    found, _ = images.read([store], {target: azimuth}, side.get("elevation", "all"), realizations=1)
    return unit_rows(found[random.choice(len(found), COUNT, replace=False)])


def zncc(one, other):
    return standardized(np.abs(one)) @ standardized(np.abs(other)).T


if __name__ == "__main__":
    main()
