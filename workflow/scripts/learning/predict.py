"""Predictions of one fitted model at one SNR."""

from pathlib import Path

import numpy as np
import pandas as pd

from learning import images
from learning.train import load, unseen_azimuths

BATCH = 1024  # images at a time: bounds the memory, and as a constant keeps results the same bit for bit
SCORE = "score_"


def predict(stores, folder, output):
    """Classify the images of the stores at the azimuths that the model in `folder` has not seen; write a table.

    Columns of the table: target, elevation, azimuth (degrees), realization, truth, predicted, score_<class>...
    Rows: all elevations and realizations, sorted by the first four columns.
    """
    model = load(folder)
    observations = images.read(stores, unseen_azimuths(folder))
    table = pd.DataFrame(observations._asdict() | {"images": None}).drop(columns="images")
    predicted, scores = classify(model, observations.images)
    table["truth"] = observations.target
    table["predicted"] = predicted
    for name, column in zip(model.classes_, scores.T, strict=True):
        table[SCORE + name] = column
    Path(output).parent.mkdir(parents=True, exist_ok=True)
    # Nine digits keep a single-precision number exactly.
    table.to_csv(output, index=False, float_format="%.9g")
    print(f"{len(table)} images, {np.mean(table['truth'] == table['predicted']):.4f} of them right")


def classify(model, images):
    """Labels (n,) and scores (n, classes) of images (n, range, crossrange), in batches."""
    parts = [model.evaluate(images[start : start + BATCH]) for start in range(0, len(images), BATCH)]
    predicted, scores = zip(*parts, strict=True)
    return np.concatenate(predicted), np.concatenate(scores)
