"""Materials: impedances of thin sheets and of opaque bodies, and where they hold; the permittivity of a solid body.

A material is a mapping, as a target of the config has it, of one of these forms, in SI units:

    resistance                           Z = resistance, ohm a square
    conductivity, thickness              Z = 1 / (sigma t), a film thinner than its skin depth
    permittivity, loss_tangent, thickness    Z = 1 / (j omega eps_0 (eps_r - 1) t), eps_r = eps' (1 - j tan delta)
    permittivity, loss_tangent           a solid body of eps_r, which the mesh bounds (see `mom.dielectric`)
    permittivity, loss_tangent, surface: leontovich             the same, but opaque: of the surface impedance
                                         Z = eta / sqrt(eps_r)  (see `mom.opaque`)
    permittivity, loss_tangent, thickness, backing: metal       a coating on metal, whose face the mesh is:
                                         Z = eta / sqrt(eps_r) tanh(j k sqrt(eps_r) t)

(Harrington, Mautz, IEEE Trans. AP-23, 1975; of surfaces Senior, Volakis, Approximate Boundary Conditions in
Electromagnetics, 1995), with exp(+j omega t).
"""

import numpy as np

from isarflow.core.sweep import C0

ETA = 376.730313668  # impedance of vacuum, ohm (CODATA 2018)
SOLID = ("permittivity", "loss_tangent")
FORMS = (
    ("resistance",),
    ("conductivity", "thickness"),
    (*SOLID, "thickness"),
    SOLID,
    (*SOLID, "surface"),
    (*SOLID, "thickness", "backing"),
)
UNITS = {
    "resistance": " ohm a square",
    "conductivity": " S/m",
    "permittivity": "",
    "loss_tangent": "",
    "thickness": " m",
}
# Of the wavelength, that in the material if it is a dielectric: the thickness, at most. A slab as thick, of eps_r 2 to
# 4, reflects and transmits within 1.4 to 2.4 % of the incident field as its sheet at normal incidence, and within 0.2
# to 2.5 % at 60 degrees; there, where the wave polarizes it across, within 18 % if the current across is left out.
THICKEST = 1 / 10
# Least refractive index of an opaque body, and largest thickness of a coating in wavelengths, over its refractive index
# and by itself. There spheres of a radius of 0.5 to 2 wavelengths are off by 5 % of their largest backscatter at most.
LEAST_INDEX = 2.5
MOST_COATING = 1 / 125
THICKEST_COATING = 1 / 52
SKIN_DEPTHS = 3  # of an opaque body's thickness, at least
METAL = {"resistance": 0.0}
NEARLY_METAL = 0.01  # of the impedance of vacuum: a half space of such a conductor reflects all but 0.2 dB


def impedance(material, frequency):
    """Return the impedance of a material's sheet in ohm a square, complex, of the shape of `frequency` in Hz."""
    wavenumber = 2 * np.pi * np.asarray(frequency, float) / C0
    if "resistance" in material:
        return np.full(wavenumber.shape, complex(material["resistance"]))
    if "conductivity" in material:
        return np.full(wavenumber.shape, complex(1 / (material["conductivity"] * material["thickness"])))
    return ETA / (1j * wavenumber * (permittivity(material) - 1) * material["thickness"])


def surface_impedance(material, frequency):
    """Return the impedance of an opaque body's surface, or of coated metal, in ohm; as `impedance`."""
    root = np.sqrt(permittivity(material))
    if "surface" in material:
        return np.full(np.shape(frequency), ETA / root)
    return ETA / root * np.tanh(2j * np.pi * np.asarray(frequency, float) / C0 * root * material["thickness"])


def normal_impedance(material, frequency):
    """Return the impedance across a dielectric's sheet, E_n / J_n = eps_r Z, as `impedance`; 0 of what is none."""
    if not is_dielectric_sheet(material):
        return np.zeros(np.shape(frequency), complex)
    return permittivity(material) * impedance(material, frequency)


def of_parts(settings):
    """Return the materials of a target's settings by its parts' names, or of '' alone."""
    return {name: own.get("material", METAL) for name, own in settings.get("parts", {"": settings}).items()}


def equation(settings):
    """Return the integral equation of a target's settings: pmchwt of a solid body, ibc of opaque ones, or stated.

    Of sheets with a current across them it is tds.
    """
    made_of = of_parts(settings).values()
    if any(map(is_solid, made_of)):
        return "pmchwt"
    if any(map(is_opaque, made_of)):
        return "ibc"
    return "tds" if has_normal_current(settings) else settings.get("formulation")


def has_normal_current(settings):
    """Tell whether a target has dielectric sheets with a current across: by the default solver, unless left out."""
    of_solver = settings.get("normal_current", settings.get("solver", "mom") == "mom")
    return of_solver and any(map(is_dielectric_sheet, of_parts(settings).values()))


def is_solid(material):
    """Tell whether a material is that of a solid body: a dielectric without a wall's thickness, which is not opaque."""
    return "permittivity" in material and "thickness" not in material and not is_opaque(material)


def is_opaque(material):
    """Tell whether a material is of a surface impedance: an opaque body, or a coating on metal."""
    return "surface" in material or "backing" in material


def is_dielectric_sheet(material):
    """Tell whether a material is a dielectric's thin wall."""
    return "permittivity" in material and "thickness" in material and "backing" not in material


def permittivity(material):
    """Return a dielectric's relative permittivity, complex."""
    return material["permittivity"] * (1 - 1j * material["loss_tangent"])


def index(material):
    """Return how many wavelengths in a dielectric one outside is: the absolute value of its refractive index."""
    return float(abs(np.sqrt(permittivity(material))))


def skin_depth(material, frequency):
    """Return in metres how far into a dielectric a wave falls to 1 / e."""
    return C0 / (2 * np.pi * frequency * max(-np.sqrt(permittivity(material)).imag, 1e-12))


def described(material):
    """Describe a material: 'a sheet of abs (permittivity 2.7, loss tangent 0.008, thickness 0.0015 m)'."""
    kinds = {"opaque": "surface" in material, "metal coated with": "backing" in material, "solid": is_solid(material)}
    kind = next((kind for kind, holds in kinds.items() if holds), "a sheet of")
    numbers = ", ".join(f"{key.replace('_', ' ')} {material[key]:g}{UNITS[key]}" for key in UNITS if key in material)
    return f"{kind} {material['name']} ({numbers})" if "name" in material else f"{kind} {numbers}"


def why_not(material, frequency):
    """Say, after the key, why a material is no sheet, coating or opaque body at a frequency in Hz; None if it is."""
    if "surface" in material and index(material) < LEAST_INDEX:
        least = f"an opaque body of leontovich has {LEAST_INDEX:g} or more"
        return f".surface': {least}, and here the refractive index is {index(material):.3g}; leave it out."
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
        if "backing" in material:
            most = min(MOST_COATING * index(material), THICKEST_COATING) * wavelength
            limits.append((most, "a thin coating of this permittivity has", "so thick a coating is not solved"))
    most, what, instead = min(limits)
    if material["thickness"] <= most:
        return None
    limit = f"{what} at {frequency / 1e9:g} GHz, {1000 * most:.3g} mm"
    return f".thickness': {1000 * material['thickness']:.3g} mm is more than {limit}; {instead}."
