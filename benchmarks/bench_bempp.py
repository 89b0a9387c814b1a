"""The same sphere by bempp-cl 0.4.2 and here: `make bench-bempp`.

Both assemble the EFIE matrix of one icosphere in one run, one after the other, on all processors; the second assembly
of each counts, so that neither pays for compilation. The backscatter of both is compared with the closed form.
"""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import mie
import numpy as np
import pandas as pd
from runner import options_of

from isarflow.scattering.mom.assembly import Entries, assemble
from isarflow.scattering.mom.basis import fundamental_domain, rwg
from isarflow.scattering.mom.factorization import SymmetricMatrix
from isarflow.scattering.mom.farfield import Excitation
from isarflow.scattering.mom.operators import efie

K = 2 * np.pi  # wavelength 1 m


def ours(vertices, triangles):
    """The same figures as the peer's."""
    times = []
    for _ in range(6):
        start = time.perf_counter()
        surface = fundamental_domain(vertices, triangles, [])
        bases = [rwg(surface, surface.parities[0])]
        matrix = SymmetricMatrix(len(bases[0]), np.complex64)
        assemble(Entries(efie, surface, bases, K, efie.near_terms(surface), np.complex64), [matrix], os.cpu_count())
        times.append(time.perf_counter() - start)
    start = time.perf_counter()
    matrix.factorize(os.cpu_count())
    wave = Excitation(surface, bases, np.complex64)(K, np.array([[0.0, 0, 1]]), np.array([[1.0, 0, 0]]))[0]
    amplitude = -matrix.between(wave, wave, [slice(0, 1)], os.cpu_count())[0][0, 0]
    return {
        "unknowns": len(bases[0]),
        "assembly_cold_s": times[0],
        "assembly_s": np.median(times[1:]),
        "solution_s": time.perf_counter() - start,
        "amplitude_m": abs(amplitude),
    }


def main():
    peer_python = {"default": ".venv-bempp/bin/python", "help": "of an environment with bempp-cl 0.4.2"}
    options = options_of(__doc__, python=peer_python)
    radius = 0.66
    vertices, triangles = mie.icosphere(radius, 0.09)
    with tempfile.TemporaryDirectory() as folder:
        sphere, result = Path(folder, "sphere.npz"), Path(folder, "peer.json")
        np.savez(sphere, vertices=vertices, triangles=triangles, wavenumber=K)
        peer = Path(__file__).with_name("peer_bempp.py")
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        subprocess.run([options.python, peer, sphere, result], check=True, env=environment)
        table = pd.DataFrame(
            [json.loads(result.read_text()), ours(vertices, triangles)], ["bempp-cl 0.4.2", "isarflow"]
        )
    table["error_db"] = 20 * np.log10(table.pop("amplitude_m") / abs(mie.backscatter(K, radius)))
    print(table.round(3).to_string())
    ratio = table.assembly_s.iloc[0] / table.assembly_s.iloc[1]
    print(
        f"assembly: {ratio:.0f} times faster than the peer (sphere of {len(triangles)} triangles, radius {radius} "
        "wavelengths)"
    )
    table.to_csv(options.out / "bempp.csv", index_label="solver")


if __name__ == "__main__":
    main()
