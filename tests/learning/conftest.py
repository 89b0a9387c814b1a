import numpy as np
import pytest
from scenes import aspects, noisy, scene, write


@pytest.fixture(scope="session")
def stores(tmp_path_factory):
    """A function of label and target names: the stores of images, made once."""
    folder = tmp_path_factory.mktemp("results") / "imaging"
    snrs = {"snr_30dB": 30, "snr_0dB": 0, "snr_-6dB": -6}

    def make(label, targets=("dart", "disc")):
        paths = []
        for name in targets:
            path = folder / name / f"{label}.zarr"
            if not path.exists():
                images = scene(name) if label == "clean" else noisy(name, snrs[label])
                write(path, images / np.abs(images).max(axis=(-2, -1), keepdims=True), aspects())
            paths.append(str(path))
        return paths

    return make
