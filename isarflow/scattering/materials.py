"""Materials: the impedance of a thin sheet, and where a sheet is no longer one; the permittivity of a solid body.

A material is a mapping, as a target of the config has it, of one of these forms, in SI units:

    resistance                           Z = resistance, ohm a square
    conductivity, thickness              Z = 1 / (sigma t), a film thinner than its skin depth
    permittivity, loss_tangent, thickness    Z = 1 / (j omega eps_0 (eps_r - 1) t), eps_r = eps' (1 - j tan delta)
    permittivity, loss_tangent           a solid body of eps_r, which the mesh bounds (see `mom.dielectric`)

(Harrington, Mautz, IEEE Trans. AP-23, 1975), with exp(+j omega t).
"""

import numpy as np

from isarflow.core.sweep import C0

ETA = 376.730313668  # impedance of vacuum, ohm (CODATA 2018)
SOLID = ("permittivity", "loss_tangent")
FORMS = ("resistance",), ("conductivity", "thickness"), (*SOLID, "thickness"), SOLID
UNITS = {
    "resistance": " ohm a square",
    "conductivity": " S/m",
    "permittivity": "",
    "loss_tangent": "",
    "thickness": " m",
}
# Of the wavelength, that in the material if it is a dielectric: the thickness, at most. A slab as thick, of eps_r 2 to
# 4, reflects and transmits within 1.4 to 2.4 % of the incident field as its sheet at normal incidence; at 60 degrees,
# where the wave polarizes it across, within 18 %.
THICKEST = 1 / 10
NEARLY_METAL = 0.01  # of the impedance of vacuum: a half space of such a conductor reflects all but 0.2 dB


def impedance(material, frequency):
    """Return the impedance of a material's sheet in ohm a square, complex, of the shape of `frequency` in Hz."""
    wavenumber = 2 * np.pi * np.asarray(frequency, float) / C0
    if "resistance" in material:
        return np.full(wavenumber.shape, complex(material["resistance"]))
    if "conductivity" in material:
        return np.full(wavenumber.shape, complex(1 / (material["conductivity"] * material["thickness"])))
    return ETA / (1j * wavenumber * (permittivity(material) - 1) * material["thickness"])


def equation(settings):
    """Return the name of the integral equation of a target's settings: pmchwt of a solid body, or its `formulation`."""
    return "pmchwt" if is_solid(settings.get("material", {})) else settings.get("formulation")


def is_solid(material):
    """Tell whether a material is that of a solid body: a dielectric without a wall's thickness."""
    return "permittivity" in material and "thickness" not in material


def permittivity(material):
    """Return a dielectric's relative permittivity, complex."""
    return material["permittivity"] * (1 - 1j * material["loss_tangent"])


def index(material):
    """Return how many wavelengths in a dielectric one outside is: the absolute value of its refractive index."""
    return float(abs(np.sqrt(permittivity(material))))


def described(material):
    """Describe a material: 'abs (permittivity 2.7, loss tangent 0.008, thickness 0.0015 m)'."""
    numbers = ", ".join(f"{key.replace('_', ' ')} {material[key]:g}{UNITS[key]}" for key in UNITS if key in material)
    return f"{material['name']} ({numbers})" if "name" in material else numbers


def why_no_sheet(material, frequency):
    """Say in one sentence why a material is too thick for a sheet at a frequency in Hz; None if it is not."""
    if "thickness" not in material:
        return None
    wavelength, solid = C0 / frequency, "so thick a wall is not solved"
    if "conductivity" in material:
        depth = np.sqrt(wavelength / (np.pi * ETA * material["conductivity"]))
        # Z of the half space is (1 + j) / (sigma depth): far below that of vacuum it is nearly metal.
        is_metal = 1 / (material["conductivity"] * depth) < NEARLY_METAL * ETA
        like_metal = "so thick a conductor scatters like metal: leave 'material' out"
        skin = depth, "its skin depth", like_metal if is_metal else solid
        limits = [skin, (THICKEST * wavelength, "a tenth of the wavelength", solid)]
    else:
        inside = wavelength / index(material)
        limits = [(THICKEST * inside, "a tenth of the wavelength in it", solid)]
    most, what, instead = min(limits)
    if material["thickness"] <= most:
        return None
    limit = f"{what} at {frequency / 1e9:g} GHz, {1000 * most:.3g} mm"
    return f"{1000 * material['thickness']:.3g} mm is more than {limit}; {instead}."
