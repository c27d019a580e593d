"""The largest stress along a beam against its section forces integrated anew and searched densely."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from functional_paths import beam_stress
from scipy.integrate import solve_ivp

import cfmkit.elastica as el

UP = np.pi / 2
TAPER = el.Taper(np.array([0, 0.35, 1]), np.array([1.1e-3, 0.8e-3, 1.2e-3]))


def pressed(shape: object, thickness: object, travel: float, tolerance: float = 1e-7) -> el.Path:
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "b": el.Node(0.08, 0.02, el.slider_support(UP, rotates=True))}
    beam = el.Beam("a", "b", el.Section(2e9, 8e-3, thickness), shape)  # type: ignore[arg-type]
    drive = el.Displacement("b", -UP, np.linspace(0, travel, 41))
    return el.trace(el.Network(nodes, {"x": beam}), drive, el.Control(tolerance=tolerance))


def densely(path: el.Path, point: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places, bending and axial stress at them, by Reissner's equations from the clamped end."""
    fitted, section = path.fits["x"], path.network.beams["x"].section
    h, v, m = path.end_force("x", 0)[point]

    def forces(t: float, turn: float) -> tuple[float, float, float]:
        angle = fitted.angle(t, 0.5) + turn
        return np.cos(angle), np.sin(angle), h * np.cos(angle) + v * np.sin(angle)

    def slopes(t: float, y: np.ndarray, inside: float) -> list[float]:
        bending, axial, _ = section.rigidities(fitted.arc(t), inside)
        c, s, normal = forces(t, y[0])
        stretched = fitted.speed(t, 0.5) * (1 + normal * axial)
        return [fitted.speed(t, 0.5) * y[1] / bending, stretched * (h * s - v * c)]

    y, places, bending, axial = np.array([0.0, m]), [], [], []
    marks = [fitted.parameter(float(share)) for share in section.stations]
    for left, right in pairwise(marks):
        t = np.linspace(left, right, 2001)
        inside = float(fitted.arc(0.5 * (left + right)))
        found = solve_ivp(slopes, (left, right), y, "DOP853", t, args=(inside,), rtol=1e-10, atol=1e-13).y
        thick, place = section.thickness_at(fitted.arc(t), inside), fitted.arc(t)
        y = found[:, -1]
        places.append(place)
        bending.append(6 * found[1] / (section.width * thick**2))
        axial.append(forces(t, found[0])[2] / (section.width * thick))
    return np.concatenate(places), np.concatenate(bending), np.concatenate(axial)


@pytest.mark.parametrize(
    ("shape", "thickness", "travel"),
    [
        (el.Polynomial((0, 6.5, -6.0)), 1e-3, 0.03),  # from 10 to 12 mm two humps change places
        (el.Polynomial((0, 4.0, -9.0, 5.0)), TAPER, 0.02),
        (el.CosineArch(0.008), TAPER, 0.03),
    ],
)
def test_no_place_has_more_stress_than_the_largest(shape: object, thickness: object, travel: float) -> None:
    path = pressed(shape, thickness, travel)
    value, place = beam_stress(path, "x")
    found = path.stress_extremes("x")
    inside = 0
    for point in range(4, len(path), 3):
        where, bending, axial = densely(path, point)
        total = np.abs(bending) + np.abs(axial)
        assert value[point] == pytest.approx(total.max(), rel=2e-6)
        assert np.interp(place[point], where, total) == pytest.approx(total.max(), rel=2e-6)
        for side, stress in enumerate((bending + axial, axial - bending)):
            want = [stress.max(), stress.min()]
            np.testing.assert_allclose(found.value[point, side], want, atol=2e-6 * total.max())
        inside += 0.0 < place[point] < 1.0
    assert inside > 3, "the largest stress is meant to lie inside the beam at some points"


def test_of_two_humps_of_nearly_one_height_the_higher_is_found() -> None:
    """Where they change places the lower one has the higher sample."""
    path = pressed(el.Polynomial((0, 6.5, -6.0)), 1e-3, 0.03)
    value, place = beam_stress(path, "x")
    near = np.flatnonzero((path.drive > 9e-3) & (path.drive < 12e-3))
    assert len(near) >= 3
    assert np.ptp(place[near]) < 0.02
    for point in near:
        _, bending, axial = densely(path, int(point))
        assert value[point] == pytest.approx((np.abs(bending) + np.abs(axial)).max(), rel=1e-6)


def test_a_peak_beside_the_end_of_a_segment_is_found_at_a_loose_tolerance() -> None:
    """There the states of the two segments that meet differ by the tolerance."""
    loose, fine = (pressed(el.CosineArch(0.008), 1e-3, 0.03, tolerance) for tolerance in (1e-4, 1e-10))
    found, exact = (path.stress_extremes("x").value[path.at_requested] for path in (loose, fine))
    np.testing.assert_allclose(found, exact, atol=3e-4 * np.abs(exact).max())
