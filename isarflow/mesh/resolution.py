"""Wanted edges of a target's meshes: from the wavelength, or from the target's own size if that gives less."""

from isarflow.core import sweep
from isarflow.core.errors import InputError

COARSEST = 5  # edges in a wavelength, the least that the config allows
ACROSS = 20  # mean edges in a target's largest extent, at least: its field is then right for any long wave
AS_DRAWN = 100  # the same of a mesh that keeps the CAD file's triangles: these are divided
OF_PIECE = 12  # and in the largest extent of each of its pieces
SINGLE = 300  # edges in a wavelength; with 500 a plate was not solved in single precision, with 302 it was to 4e-4
FINEST = 10_000  # edges in a wavelength: beyond, double precision too loses the current's loops


def wanted_edges(mesh, radar, box):
    """The mean edge in metres of each band's mesh, lowest band first, of a target of lengths `box` along x, y and z."""
    if not mesh.get("remesh", True):
        return [float(max(box)) / AS_DRAWN] * mesh["bands"]
    most = float(max(box)) / ACROSS
    return [min(most, wave / mesh["edges_per_wavelength"]) for wave in wavelengths(mesh, radar)]


def wavelengths(mesh, radar):
    """The shortest wavelength in metres of each band, lowest band first: the one inside a solid body of `index`."""
    return [sweep.C0 / band[-1] / mesh.get("index", 1) for band in sweep.bands(radar, mesh["bands"])]


def check_resolution(box, mesh, radar, name, precision="double"):
    """Refuse a target of lengths `box` along x, y and z (metres) that its solve's precision cannot do at its size."""
    reason = too_fine(box, mesh, radar, precision)
    if reason:
        raise InputError(f"{name} is too small for its solve: {reason}, or mend its 'unit'.")


def too_fine(box, mesh, radar, precision):
    """Say why a target (see `check_resolution`) is not solvable, and what would make it so; '' if it is."""
    frequency, edge = sweep.bands(radar, mesh["bands"])[0][-1], wanted_edges(mesh, radar, box)[0]
    density, length = sweep.C0 / frequency / edge, float(max(box))
    most = SINGLE if precision == "single" else FINEST
    if density <= most:
        return ""
    remedy = "raise the frequency" if density > FINEST else "set 'scattering.precision: double'"
    waves = f"{length:.4g} m are {length * frequency / sweep.C0:.3g} wavelengths at {frequency / 1e9:g} GHz"
    edges = f"with {length / edge:.0f} edges across it there are {density:.0f} in a wavelength"
    return f"{waves}, so that {edges}, and {most} are the most for {precision} precision: {remedy}"
