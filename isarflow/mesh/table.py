"""The measures of a target's meshes as a table."""

import re

import pandas as pd

# Entries of a band in the mesh's JSON, with their units.
COLUMNS = (
    "vertices triangles unknowns ideal_unknowns wanted_edge_m edge_mean_m edge_max_m edge_p99_m edge_mean_wavelengths "
    "edge_max_wavelengths edge_p99_wavelengths smallest_angle_min_deg smallest_angle_p1_deg smallest_angle_median_deg "
    "thin_triangles smallest_angle_elsewhere_min_deg smallest_angle_elsewhere_p1_deg "
    "smallest_angle_elsewhere_median_deg watertight components boundary_edges junction_edges mirror_error_m "
    "area_before_m2 area_after_m2 area_of_rods_m2 volume_before_m3 volume_after_m3 hausdorff_to_source_m "
    "hausdorff_from_source_m hausdorff_to_source_wavelengths hausdorff_from_source_wavelengths"
)


def table_of_bands(target, measures):
    """Return a row per band of a target's mesh, in full precision; units end the columns. measures: its JSON."""
    bands = pd.json_normalize(measures["bands"], sep="_")
    data = {"target": target, "band": bands.index}
    data |= {f"frequency_{end}_hz": bands[f"frequencies_{end}"] for end in ("first", "last")}
    for column in COLUMNS.split():
        values = bands[re.sub("_(m|m2|m3|deg|wavelengths)$", "", column)]
        data[column] = values / bands["wavelength"] if column.endswith("_wavelengths") else values
    return pd.DataFrame(data).astype(dict.fromkeys(("mirror_error_m", "volume_before_m3", "volume_after_m3"), float))
