"""How long one fitted model takes to classify an observation."""

import json
import os
import platform
import time
from pathlib import Path

import numpy as np
import threadpoolctl

from learning import images
from learning.train import CONFIG, load, unseen_azimuths

BATCH = 256
WARM_UP = 3  # calls that are not counted
REPEATS = {1: 200, BATCH: 20}  # timed calls by number of images
LIMIT = 20.0  # seconds for one number of images; a slow model gets fewer repeats


def measure(stores, folder, threads, output):
    """Time the model in `folder` on images of the stores that it has not seen; write milliseconds per observation.

    A call goes from complex images to labels and scores, features included. The figure is the median over calls.
    """
    folder = Path(folder)
    config = json.loads((folder / CONFIG).read_text())
    model = load(folder)
    pool = images.read(stores, unseen_azimuths(folder)).images
    with threadpoolctl.threadpool_limits(threads):
        single, batch = (time_batches(model.evaluate, pool, size) for size in (1, BATCH))
    result = {
        "experiment": config["experiment"],
        "model": config["model"],
        "training_observations": sum(config["observations"].values()),
        "image_shape": config["image_shape"],
        "single": single,
        "batch": batch,
        "machine": {"cpu": cpu(), "cores": os.cpu_count()},
        "threads": threads,
    }
    Path(output).write_text(json.dumps(result, indent=1) + "\n")
    for kind in ("single", "batch"):
        print(f"{kind}: {result[kind]['milliseconds_per_observation']:.4f} ms per observation")


def time_batches(evaluate, pool, size):
    """Median time per observation of calls with `size` images, each call with the next images of the pool."""
    seconds, begin = [], time.perf_counter()
    for call in range(WARM_UP + REPEATS[size]):
        batch = np.take(pool, np.arange(call * size, (call + 1) * size), axis=0, mode="wrap")
        start = time.perf_counter()
        evaluate(batch)
        end = time.perf_counter()
        if call >= WARM_UP:
            seconds.append(end - start)
            if end - begin > LIMIT:
                break
    return {
        "size": size,
        "repeats": len(seconds),
        "milliseconds_per_observation": float(np.median(seconds)) / size * 1e3,
    }


def cpu():
    """The processor's name."""
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
