"""Prediction times at the reference experiment's size: 6,460 training images of 27 x 21 pixels (make bench-learning).

The images are noise: a prediction takes as long whatever they show. The support vector machine is left out, as its
time depends on how many support vectors real images leave.
"""

import numpy as np
import yaml
from runner import options_of

from isarflow.learning.classifier import build_classifier
from isarflow.learning.evaluation.timing import BATCH_IMAGES, cpu, time_batches
from isarflow.setup.config import BASE

SHAPE, IMAGES = (27, 21), 6460
PUBLISHED = {"lr": 0.0376, "knn": 48.8, "fcnn": 0.0445}  # ms, the thesis's tables 4.2 and 5.1
MODELS = ("lr", "knn", "matched_filter", "fcnn")


def main():
    threads = options_of(__doc__).threads
    random = np.random.default_rng(0)
    parts = random.standard_normal((IMAGES + 2048, *SHAPE, 2), dtype=np.float32)
    images = parts.view(np.complex64)[..., 0]
    labels = np.where(np.arange(IMAGES) % 2, "drone", "missile")
    settings = yaml.safe_load(BASE.read_text())["learning"]["models"]
    print(f"{cpu()}, {threads} threads; milliseconds an image")
    print(f"{'model':16} {'alone':>9} {f'in {BATCH_IMAGES}':>9} {'thesis':>9}")
    for name in MODELS:
        model = build_classifier(name, settings[name], 0).fit(images[:IMAGES], labels)
        times = [time_batches(model.predict, images[IMAGES:], size) for size in (1, BATCH_IMAGES)]
        alone, batch = (one["milliseconds_per_observation"] for one in times)
        print(f"{name:16} {alone:9.4f} {batch:9.4f} {PUBLISHED.get(name, float('nan')):9.4f}")


if __name__ == "__main__":
    main()
