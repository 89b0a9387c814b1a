"""Measure the time that each fitted model takes to classify an observation."""

import json
import os
import platform
import time
from pathlib import Path

import numpy as np
import threadpoolctl

from isarflow.learning.classifier import config_of, load_classifier
from isarflow.learning.data import images

BATCH_IMAGES = 256
SIZES = {"single": 1, "batch": BATCH_IMAGES}  # images a call
CALLS = {1: (20, 100), BATCH_IMAGES: (2, 10)}  # by number of images: calls before the timed ones, and timed ones
LIMIT_SECONDS = 2.0  # for each number of images; a slow model gets fewer repeats


def measure(stores, planes, folders, threads, output):
    """Time the models in `folders` (models/<run>/<model>) on test images; write milliseconds per observation.

    The median over calls counts, each from complex images to labels. stores: the known targets' without noise; planes:
    each one's mirror planes. `output` is a JSON file: machine, threads, and a list `models` with a record for each.
    """
    records = []
    for folder in folders:
        model, config = load_classifier(folder), config_of(folder)
        run, name = config["run"], config["model"]
        # Where no target has a class's name, as of families, those of all known ones are timed.
        learned = [store for store in stores if images.target_of(store) in config["classes"]] or stores
        divided = images.divide(learned, planes, run)
        pool, _ = images.read_side(learned, divided, run, "test")
        record = {"experiment": run["experiment"], "run": run["name"], "model": name}
        record |= {"training_observations": sum(config["observations"].values()), "image_shape": config["image_shape"]}
        with threadpoolctl.threadpool_limits(threads):
            record |= {kind: time_batches(model.predict, pool, size) for kind, size in SIZES.items()}
        records.append(record)
        single, batch = (record[kind]["milliseconds_per_observation"] for kind in SIZES)
        print(
            f"{run['name']}/{name}: {single:.4f} ms per observation alone, {batch:.4f} ms in batches of {BATCH_IMAGES}"
        )
    result = {"machine": {"cpu": cpu(), "cores": os.cpu_count()}, "threads": threads, "models": records}
    Path(output).write_text(json.dumps(result, indent=1) + "\n")


def time_batches(predict, pool, size):
    """Median time per observation of calls with `size` images, each call with the next images of the pool.

    predict: a function of images; pool: images, used again from the first after the last.
    """
    seconds, begin, (warm_up, repeats) = [], time.perf_counter(), CALLS[size]
    for call in range(warm_up + repeats):
        batch = np.take(pool, np.arange(call * size, (call + 1) * size), axis=0, mode="wrap")
        start = time.perf_counter()
        predict(batch)
        end = time.perf_counter()
        if call >= warm_up:
            seconds.append(end - start)
            if end - begin > LIMIT_SECONDS:
                break
    milliseconds = float(np.median(seconds)) / size * 1e3
    return {"size": size, "repeats": len(seconds), "milliseconds_per_observation": milliseconds}


def cpu():
    """The processor's name."""
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
