"""How fine a target's meshes are to be, and whether that is enough for its size."""

from math import ceil

from core import sweep
from core.errors import InputError

COARSEST, FINEST = 5, 2000  # edges in a wavelength, the least and the most that the config allows
ACROSS = 10  # mean edges in a target's largest extent; a plate with five of them was seen to be 2 dB wrong
SINGLE = 300  # edges in a wavelength; with 500 a plate was not solved in single precision, with 302 it was to 4e-4


def wanted_edges(mesh, radar):
    """The mean edge in metres that each band's mesh is to have, lowest band first."""
    return [sweep.C0 / band[-1] / mesh["edges_per_wavelength"] for band in sweep.bands(radar, mesh["bands"])]


def check_resolution(box, mesh, radar, name):
    """Refuse a target of lengths `box` along x, y and z (metres) with too few edges across it in one of the bands."""
    length, edge = float(max(box)), wanted_edges(mesh, radar)[0]  # the lowest band has the longest edges
    if length >= ACROSS * edge:
        return
    density, frequency = mesh["edges_per_wavelength"], sweep.bands(radar, mesh["bands"])[0][-1]
    # a little more than just enough, in round numbers
    finer = max(ceil(1.001 * ACROSS * edge / length * density), ceil(density))
    advice = (
        f"'mesh.edges_per_wavelength: {finer}' would do (now {density:g})"
        + (" with 'scattering.precision: double'" if finer > SINGLE else "")
        if finer <= FINEST
        else f"even the {FINEST} that 'mesh.edges_per_wavelength' may be are too few: raise the frequency"
    )
    raise InputError(
        f"{name} is {length:.4g} m long, {length * frequency / sweep.C0:.3g} wavelengths at {frequency / 1e9:g} GHz: "
        f"edges of {edge * 1000:.3g} mm fit only {length / edge:.2g} times into it, and {ACROSS} are the least that "
        f"give a field to rely on; {advice}. If it should be larger, see its 'unit'."
    )
