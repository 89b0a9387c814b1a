"""The numbers that the report works out itself: range profiles, selections, what a published statement says."""

import matplotlib.colors
import numpy as np
import pytest

from common.radar import C0
from report import draw_images, draw_mesh, layout
from report.draw_learning import holds
from report.section_scattering import range_profiles, rcs_dbsm
from report.selection import evenly, noise_snrs, noise_target, target_order


@pytest.mark.parametrize("distance", [-0.4, 0.0, 0.55])
def test_point_scatterer_stands_at_its_range(distance):
    frequency = np.linspace(2e9, 3.5e9, 14)
    # Farther from the radar than the origin: positive range, phase exp(-2jkd).
    field = np.exp(-4j * np.pi * frequency / C0 * distance)[:, None]
    ranges, profile = range_profiles(field, frequency)
    found = ranges[np.abs(profile[:, 0]).argmax()]
    assert abs(found - distance) <= np.diff(ranges)[0] / 2 + 1e-9
    assert np.abs(profile).max() == pytest.approx(1, abs=0.02)
    assert np.ptp(ranges) + np.diff(ranges)[0] == pytest.approx(C0 / 2 / np.diff(frequency)[0])


def test_rcs_of_a_scattering_amplitude():
    assert rcs_dbsm(np.array([1 / np.sqrt(4 * np.pi)])) == pytest.approx([0], abs=1e-12)
    assert np.isfinite(rcs_dbsm(np.zeros(1))).all()


def test_evenly_keeps_both_ends_and_the_count():
    values = list(range(-24, 25, 3))
    picked = evenly(values, 7)
    assert (picked[0], picked[-1], len(picked)) == (-24, 24, 7)
    assert evenly([5], 7) == [5]
    assert noise_snrs([12, -3, 0]) == [-3, 0, 12]


def test_order_of_targets_does_not_depend_on_the_file():
    targets = {"z": {"role": "other"}, "b": {"role": "known"}, "u": {"role": "unknown"}, "a": {"role": "known"}}
    assert target_order(targets) == target_order(dict(reversed(targets.items()))) == ["a", "b", "u", "z"]
    assert noise_target(targets) == "a"


@pytest.mark.parametrize(
    ("ours", "relation", "printed", "expected"),
    [
        (0.9996, ">=", "1.00", True),
        (0.994, ">=", "1.00", False),
        (0.991, ">", "0.99", True),
        (0.99, ">", "0.99", False),
        (0.634, "<=", "0.63", True),
        (0.64, "<=", "0.63", False),
        (0.79814, "=", "0.7981", True),
    ],
)
def test_published_statement_counts_to_its_printed_decimals(ours, relation, printed, expected):
    assert holds(ours, relation, printed) == expected


def test_projection_keeps_lengths_and_hands():
    right, up, depth = draw_mesh.project(np.eye(3), *draw_mesh.OBLIQUE)
    np.testing.assert_allclose(right**2 + up**2 + depth**2, 1)
    # x to the right, y up, z towards the eye: from above, right-handed.
    right, up, depth = draw_mesh.project(np.eye(3), *draw_mesh.TOP)
    np.testing.assert_allclose([right[0], up[1], depth[2]], 1)


def _luminance(color):
    rgb = np.array(matplotlib.colors.to_rgb(color))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return linear @ [0.2126, 0.7152, 0.0722]


def test_colours_stand_out_from_white():
    """Graphics need a contrast of 3 to 1 (WCAG 2.1, 1.4.11)."""
    for color in layout.PALETTE:
        assert 1.05 / (_luminance(color) + 0.05) >= 3, color


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (0, "0"), (0.03654, "0.0365"), (48.8, "48.8"), (1234, "1234"), (5e-6, "5.00×10⁻⁶")],
)
def test_numbers_read_as_numbers(value, text):
    assert layout.number(value) == text


def test_outline_of_a_box_is_its_shadow_and_a_sheet_on_edge_has_one():
    corners = np.array([[x, y, 0.0] for x in (-0.3, 0.3) for y in (-0.1, 0.1)])
    plate = np.array([[0, 2, 1], [1, 2, 3]])
    cross, distance, covered = draw_images.outline(corners, plate, 0.0, 0.0)
    inside = covered > draw_images.OUTLINE
    assert np.ptp(distance[inside.any(axis=1)]) == pytest.approx(0.6, rel=0.03)  # along x, towards the radar
    assert np.ptp(cross[inside.any(axis=0)]) == pytest.approx(0.2, rel=0.06)
    for turn in (0.0, 30.0, 45.0):  # a vertical sheet in the plane of x and z, seen along its edge from above
        upright = corners[:, [0, 2, 1]]
        assert draw_images.outline(upright, plate, 0.0, turn)[2].max() > draw_images.OUTLINE
