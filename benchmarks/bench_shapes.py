"""From the CAD file to the field of targets with fine features: `make bench-shapes`.

The shapes of tests/scattering/fine_made.py, meshed at the default ten edges a wavelength and at fourteen, beside their
fields at twenty. A table goes to results/benchmarks/shapes.csv, for docs/validation.md, and a figure beside it.
"""

import tempfile
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
from fine_made import AZIMUTH, ELEVATION, REFERENCE, SHAPES, apart, field
from runner import options_of, show

matplotlib.use("Agg")
import matplotlib.pyplot as plt

OUTPUT = Path("results/benchmarks")
DENSITIES = 10, 14


def main():
    options = options_of(__doc__, shapes={"nargs": "+", "choices": SHAPES, "default": list(SHAPES)})
    rows = []
    figure, panels = plt.subplots(2, 3, figsize=(12, 6), layout="constrained", sharex=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, panel in zip(options.shapes, panels.ravel(), strict=False):
            reference, _ = field(folder, name, REFERENCE, options.threads)
            draw(panel, reference, f"{REFERENCE} edges a wavelength", color="black", linewidth=2)
            for density in DENSITIES:
                found, band = field(folder, name, density, options.threads)
                mean, largest = apart(found, reference)
                changed = {kind: band[kind]["after"] / band[kind]["before"] - 1 for kind in ("area", "volume")}
                row = {"shape": name, "edges": density, "unknowns": band["unknowns"], **changed}
                rows.append(row | {"mean_db": mean, "largest_db": largest})
                show(rows[-1])
                draw(panel, found, f"{density} edges", linestyle="--", linewidth=1)
            panel.set_title(name)
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
    figure.supxlabel("azimuth [degrees], elevation 0")
    figure.supylabel("RCS, VV [dBsm]")
    figure.savefig(options.out / "shapes.png", dpi=120)
    pd.DataFrame(rows).to_csv(options.out / "shapes.csv", index=False, float_format="%.4g")


def draw(panel, found, label, **look):
    level = 20 * np.log10(np.abs(found[0].reshape(len(ELEVATION), -1)[ELEVATION == 0][0])) + 10 * np.log10(4 * np.pi)
    panel.plot(AZIMUTH, level, label=label, **look)
    panel.grid(True, alpha=0.3)
    panel.set_ylim(max(level.max() - 45, panel.get_ylim()[0]), level.max() + 3)


if __name__ == "__main__":
    main()
