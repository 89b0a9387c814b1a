"""Check a solver's arguments, its sweep and its mesh, and that computed numbers are finite.

What makes a result wrong is an InputError. What makes it less exact, or may be a mistake, is a warning with the number.
"""

import warnings
from dataclasses import replace
from numbers import Real

import numpy as np

from isarflow.core.errors import InputError, refusal
from isarflow.core.sweep import C0
from isarflow.core.words import check_words, number
from isarflow.mesh import topology
from isarflow.mesh.measures import ideal_unknowns
from isarflow.mesh.read.target import LARGEST, SMALLEST, hides
from isarflow.scattering.materials import SKIN_DEPTHS, is_opaque, skin_depth

WAYS = "VV", "VH", "HV", "HH"
HIGHEST_ELEVATION = 90 + 1e-6  # degrees of elevation, with the rounding of angles in steps
FLAT_SHARE = 1e-12  # of the longest side squared: a triangle of a smaller area is three corners in a line
# Edges in wavelengths. Measured with meshes of even triangles, mean (longest) edge: spheres of radius 0.5 to 1.5, the
# largest error; a plate of 2 and a cube of 1.2, the mean error of both polarizations within 30 dB of the peak.
#   sphere  0.20 (0.22) 0.2 dB    0.34 (0.38) 0.8 dB    0.40 (0.42) 0.9 dB    0.50 (0.55) 1.3 dB    0.62 (0.62) 7 dB
#   plate   0.19 (0.24) 0.5 dB    0.28 (0.35) 1.0 dB    0.38 (0.47) 1.7 dB    0.45 (0.57) 2.9 dB    0.56 (0.71) 5 dB
#   cube    0.20 (0.24) 0.3 dB    0.27 (0.34) 0.6 dB    0.34 (0.42) 1.2 dB    0.46 (0.57) 3.9 dB    0.68 (0.85) 6 dB
LONG_EDGE = 1 / 3  # a longer one is warned of
LONGEST_EDGE = 1.0  # one as long is refused
LONGEST_MEAN_EDGE = 0.5  # a mesh of so long a mean edge is refused
THIN_SHARE = 0.05  # of an opaque body's area: where it may be thin, as at edges
PROBES = 400  # places at which an opaque body's thickness is looked for
USUAL_EDGES = 10  # edges in a wavelength


def check_tolerance(tolerance, formulation, precision):
    """Raise InputError unless a tolerance, if there is one, is a number and matrices of this method are compressed."""
    if tolerance is None:
        return
    if not (isinstance(tolerance, Real) and 0 < tolerance < 1):
        raise InputError(
            f"'tolerance' is a number between 0 and 1, as 1e-5, or None for whole matrices; not {tolerance!r}."
        )
    if formulation == "cfie" or precision != "single":
        raise InputError("'tolerance': matrices are compressed in single precision, and not of the CFIE; write None.")


def checked_impedance(name, impedance, shape, formulation):
    """Return the impedance of sheets or surfaces, ohm, complex: of `shape`, that of (frequencies, triangles).

    Raises InputError for one that is none, that gives power, or that is not 0 with the CFIE.
    """
    array = _array(name, impedance)
    if array.dtype.kind not in "iufc" or array.shape not in ((), shape[:1], shape) or not np.isfinite(array).all():
        each = "one for each of {} frequencies, or of {} frequencies and {} triangles".format(shape[0], *shape)
        raise InputError(f"'{name}' is a finite number, or {each}, not {_said(impedance, array)}.")
    if array.real.min() < 0:
        raise InputError(f"'{name}': {array.real.min():g} ohm; what takes power has a real part of 0 or more.")
    if formulation != "efie" and array.any():
        raise InputError(f"'{name}' is solved by 'formulation' efie alone.")
    array = array.astype(complex)
    return np.broadcast_to(array[:, None] if array.ndim == 1 else array, shape)


def opaque(vertices, triangles, sheets, surfaces, permittivity):
    """Return True for triangles that have a surface impedance, (T,); sheets, surfaces: impedances (F, T).

    Raises InputError unless they bound bodies, by themselves or with metal, and are nothing else.
    """
    if permittivity is not None:
        raise InputError(
            "'surface_impedance' is of an opaque body, and 'normal_impedance' of a sheet; leave the 'permittivity' of "
            "a solid body out."
        )
    is_opaque, is_sheet = (surfaces != 0).all(0), sheets.any(0)
    if (surfaces.any(0) & (is_sheet | ~is_opaque)).any():
        raise InputError("'surface_impedance' is 0 at all frequencies on metal and on a sheet, and on others at none.")
    if not is_opaque.any():
        return is_opaque
    try:
        topology.check_closed(vertices, triangles[is_opaque], "ibc")
    except InputError:
        topology.check_closed(vertices, triangles[~is_sheet], "ibc")
    return is_opaque


def dielectric_sheets(triangles, sheets, across, is_opaque):
    """Return True for triangles with a current across them, (T,); sheets, across: impedances (F, T); is_opaque: (T,).

    Raises InputError unless they are sheets at all frequencies. Warns where neighbours are turned to different sides.
    """
    chosen = across.any(0)
    if (is_opaque | ~across.all(0) | ~sheets.all(0))[chosen].any():
        raise InputError(
            "'normal_impedance' is across a sheet that has an 'impedance', at all frequencies or at none; it is 0 on "
            "other triangles."
        )
    edges = topology.edges(triangles[chosen])
    if count := topology.turned(triangles[chosen], edges).sum():
        _warn(
            f"at {count} edges of dielectric sheets the normals of both triangles are on different sides: there the "
            "sheets have no current across them."
        )
    return chosen


def check_bodies(vertices, triangles, part, made_of, frequency):
    """Raise InputError unless opaque bodies are closed, by themselves or with metal, and thick at `frequency` in Hz.

    part: (T,), the number of each triangle's part in the order of `made_of`, the materials by the parts' names.
    """
    bounds = triangles[np.array([hides({"material": kind}) for kind in made_of.values()])[part]]
    for number_of, (name, kind) in enumerate(made_of.items()):
        if not is_opaque(kind) or number_of not in part:
            continue
        own, said = triangles[part == number_of], f"part '{name}': " if name else ""
        if refusal(topology.check_closed, vertices, own, "ibc") and (
            why := refusal(topology.check_closed, vertices, bounds, "ibc")
        ):
            raise InputError(f"{said}{why}")
        if "surface" in kind:
            _check_depth(said, vertices, own, bounds, SKIN_DEPTHS * skin_depth(kind, frequency))


def _check_depth(said, vertices, triangles, bounds, least):
    """Raise InputError if an opaque body is less than `least` m thick under more than THIN_SHARE of its triangles.

    said: what a message begins with; bounds: all triangles (T, 3) that bound the body, outwards.
    """
    area, corners = np.cumsum(topology.areas(vertices, triangles)), vertices[triangles]
    places = np.searchsorted(area, area[-1] * (np.arange(PROBES) + 0.5) / PROBES)
    probes = (corners.mean(1) - least * topology.unit(topology.normals(corners)))[places]
    thin = np.mean([topology.winding_number(probe, vertices, bounds) < 1 / 2 for probe in probes])
    if thin > THIN_SHARE:
        raise InputError(
            f"{said}on {100 * thin:.0f} % of its area the opaque body is less than three "
            f"skin depths ({1000 * least:.3g} mm) thick, and waves pass it."
        )


def checked_permittivity(permittivity, count, impedance, formulation):
    """Return the relative permittivity of a body at each of `count` frequencies, (count,) complex.

    Raises InputError for one that is none, that gives power, or that is not alone.
    """
    if np.any(impedance) or formulation != "efie":
        raise InputError(
            "'permittivity' is that of a solid body, which has no 'impedance' and is solved by its own equation alone."
        )
    array = _array("permittivity", permittivity)
    if array.dtype.kind not in "iufc" or array.shape not in ((), (count,)) or not np.isfinite(array).all():
        raise InputError(
            f"'permittivity' is a finite number, or one for each of {count} frequencies, not "
            f"{_said(permittivity, array)}."
        )
    if array.imag.max() > 0 or array.real.min() <= 0:
        raise InputError(
            "'permittivity' has a real part above 0 and, with exp(+j omega t), an imaginary part of 0 or, where there "
            f"are losses, less; not {_said(permittivity, array)}."
        )
    return np.broadcast_to(array.astype(complex), (count,))


def checked_sweep(sweep):
    """Return a Sweep with arrays of float64. Raises InputError, with the name, for an argument that cannot be right."""
    frequency = _numbers("frequencies", sweep.frequency)
    if frequency.min() <= 0:
        raise InputError(f"'frequencies': {frequency.min():g} Hz; frequencies are above 0.")
    check_words("polarizations", sweep.polarizations, WAYS)
    if len(sweep.polarizations) == 0:
        raise InputError(f"'polarizations' names none of {', '.join(WAYS)}.")
    elevation, azimuth = _directions("", sweep.elevation, sweep.azimuth, sweep.paired)
    receivers = tuple(sweep.receivers)
    if receivers:
        if len(receivers) != 2:
            raise InputError(f"'receivers' are elevations and azimuths, two lists; here are {len(receivers)}.")
        receivers = _directions("receivers: ", *receivers, True)
    return replace(sweep, frequency=frequency, elevation=elevation, azimuth=azimuth, receivers=receivers)


def _directions(prefix, elevation, azimuth, paired):
    """Return elevations and azimuths as arrays; prefix: words before their names in a message."""
    elevation, azimuth = _numbers(f"{prefix}elevation", elevation), _numbers(f"{prefix}azimuth", azimuth)
    beyond = np.abs(elevation) > HIGHEST_ELEVATION
    if beyond.any():
        raise InputError(
            f"'{prefix}elevation': {elevation[beyond.argmax()]:g} degrees; elevations are angles above the horizon, "
            "from -90 to 90."
        )
    if paired and len(elevation) != len(azimuth):
        raise InputError(
            f"'{prefix}elevation' and 'azimuth' are one direction each: {len(elevation)} and {len(azimuth)}."
        )
    return elevation, azimuth


def _numbers(name, values):
    """Return a list of one or more finite numbers as an array (N,) of float64."""
    array = _array(name, values)
    if array.dtype.kind not in "iuf" or array.ndim != 1 or array.size == 0:
        raise InputError(f"'{name}' is a list of one or more numbers, not {_shown(array)}.")
    if not np.isfinite(array).all():
        raise InputError(f"'{name}': number {np.isfinite(array).argmin()} is {array[np.isfinite(array).argmin()]}.")
    return array.astype(float)


def _array(name, values):
    try:
        return np.asarray(values)
    except ValueError:  # rows of several lengths
        raise InputError(f"'{name}' is an array of numbers, and rows of it have several lengths.") from None


def _said(value, array):
    return repr(value) if array.size < 9 else _shown(array)


def _shown(array):
    return f"{array.dtype} of shape {array.shape}"


def checked_mesh(vertices, triangles):
    """Return the vertices that triangles use, (V, 3) float64 in m, and the triangles (T, 3) int64.

    Raises InputError for arrays of another kind or shape, vertices that are not finite or do not exist, and triangles
    without area or doubled.
    """
    vertices, triangles = _array("vertices", vertices), _array("triangles", triangles)
    if vertices.dtype.kind not in "iuf" or vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError(f"'vertices' are numbers (V, 3) in metres, not {_shown(vertices)}.")
    if triangles.dtype.kind not in "iu" or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise InputError(f"'triangles' are whole numbers (T, 3), of three vertices each, not {_shown(triangles)}.")
    if len(triangles) == 0:
        raise InputError("the mesh has no triangles.")
    outside = (triangles < 0) | (triangles >= len(vertices))
    if outside.any():
        numbering = f"there are {len(vertices)}, numbered from 0"
        raise InputError(f"{_some(outside.any(1))} have a vertex number {triangles[outside][0]}; {numbering}.")
    vertices, triangles = topology.compact(vertices.astype(float), triangles.astype(np.int64))
    infinite = ~np.isfinite(vertices).all(1)[triangles].all(1)
    if infinite.any():
        raise InputError(f"{_some(infinite)} have corners that are not finite (NaN or infinite).")
    corners, triangles = vertices[triangles], triangles.astype(np.int64)
    longest = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(2).max(1)
    flat = np.linalg.norm(topology.normals(corners), axis=1) / 2 <= FLAT_SHARE * longest
    if flat.any():
        where = topology.place(corners[flat.argmax()].mean(0))
        raise InputError(f"{_some(flat)} have no area, as near {where}; leave them out.")
    places = np.unique(vertices + 0.0, axis=0, return_inverse=True)[1].reshape(-1)
    repeated = ~topology.first_of_each(places[triangles])
    if repeated.any():
        where = topology.place(corners[repeated.argmax()].mean(0))
        raise InputError(f"{_some(repeated)} have the corners of another, as near {where}; keep one of each.")
    return vertices, triangles


def _some(wrong):
    """Say how many triangles are wrong, and which is the first. wrong: (T,) booleans."""
    return f"{wrong.sum()} of {len(wrong)} triangles (the first is number {wrong.argmax()})"


def check_edges(vertices, triangles, frequency, index=1.0):
    """Refuse a mesh too coarse for its currents; warn of a coarse one, an unusual size, and seams without current.

    vertices (V, 3) in m and triangles (T, 3) as of `checked_mesh`; frequency: the highest, in Hz; index: how many
    wavelengths in a solid body one outside is.
    """
    ends = topology.rims(triangles)[0]
    places = np.unique(vertices[ends].reshape(-1, 3) + 0.0, axis=0, return_inverse=True)[1].reshape(-1, 2)
    seams = (np.unique(np.sort(places, axis=1), axis=0, return_counts=True)[1] > 1).sum()
    if seams:
        _warn(
            f"at {seams} places rims of the mesh lie on each other without common vertices, so that no current crosses "
            "there. If they are one surface, merge the vertices."
        )
    wavelength, lengths = C0 / frequency, topology.edge_lengths(vertices, triangles)
    size = np.ptp(vertices, axis=0).max()
    usual = SMALLEST <= size / wavelength <= LARGEST
    long = f"{size:.4g} m ({number(size / wavelength)} wavelengths) long{'' if usual else ': is this in metres?'}"
    wavelength, inside = wavelength / index, " in it" if index != 1 else ""
    mean, longest = lengths.mean() / wavelength, lengths.max() / wavelength
    said = (
        f"at {frequency / 1e9:g} GHz the mesh has {number(1 / mean, 2)} edges in a wavelength{inside} ({USUAL_EDGES} "
        f"are usual), the longest of {lengths.max():.3g} m ({number(longest, 2)} wavelengths)"
    )
    if longest >= LONGEST_EDGE or mean >= LONGEST_MEAN_EDGE:
        unknowns = ideal_unknowns(topology.areas(vertices, triangles).sum(), wavelength / USUAL_EDGES)
        unknowns *= 2 if inside else 1  # a body has magnetic currents, too
        raise InputError(
            f"{said}: too few to carry its currents. It is {long}{'.' if usual else ''} With {USUAL_EDGES} edges in a "
            f"wavelength it has about {number(unknowns)} unknowns, whose whole matrix takes "
            f"{number(4 * unknowns**2 / 1e9)} GB."
        )
    if longest > LONG_EDGE:
        _warn(f"{said}: the field errs by a decibel and more.")
    if not usual:
        _warn(f"at {frequency / 1e9:g} GHz the mesh is {long}")


def _warn(text):
    """Warn the caller of `solve`, which calls `check_edges`."""
    warnings.warn(text, stacklevel=4)


def finite(values, what, wavenumber):
    """Return an array as it is; InputError if it holds what is not finite. wavenumber: rad/m.

    Compiled kernels assume that there is no such number, so that they cannot look for it themselves.
    """
    with np.errstate(all="ignore"):
        total = values.sum()  # in which NaN and infinity stay: quick, and without an array of booleans
    if not np.isfinite(total):
        at = f"at {wavenumber * C0 / (2 * np.pi) / 1e9:g} GHz {what} holds numbers that are not finite"
        raise InputError(f"{at}: the mesh may have slivers, or be too large or small; 'precision: double' may help.")
    return values
