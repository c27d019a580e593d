"""The V-beam of Ding, Li and Li (2022), Table I, as an exact beam: bifurcations, stable branch, stresses.

Reference values: geometrically exact shooting with fixed fine steps, agreeing with a three-node Simo-Reissner finite
element program to 1e-6 of the force.
"""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit.elastica as el

MM = 1e-3
LENGTH, ANGLE, WIDTH, YOUNG = 35 * MM, np.radians(7), 6 * MM, 1477e6
DOWN = -np.pi / 2

# displacement [mm], force of one beam with shear, Euler-Bernoulli with stretching
STABLE = np.array(
    [
        [0.25, 0.893304, 0.893426],
        [0.50, 1.588791, 1.589465],
        [0.75, 2.076449, 2.079247],
        [1.00, 2.215245, 2.233777],
        [1.50, 1.879536, 1.895259],
        [2.00, 1.542101, 1.555001],
        [2.50, 1.203244, 1.213310],
        [3.00, 0.863273, 0.870495],
        [3.50, 0.522502, 0.526874],
        [4.00, 0.181246, 0.182762],
        [4.50, -0.160179, -0.161519],
        [5.00, -0.364942, -0.380169],
        [6.00, -0.071857, -0.083690],
        [7.00, 1.235364, 1.246904],
    ]
)
# the point-symmetric branch that a perfect mesh stays on
SYMMETRIC = np.array(
    [
        [1.0, 2.340071],
        [1.5, 2.244461],
        [2.0, 1.746629],
        [2.5, 1.203377],
        [3.0, 0.709864],
        [4.0, -0.037437],
        [4.5, -0.262961],
    ]
)


def v_beam(thickness: float = 1 * MM, shear: bool = True) -> el.Network:
    section = el.Section(YOUNG, WIDTH, thickness, shear=shear, poisson_ratio=0.3)
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "shuttle": el.Node(LENGTH * np.cos(ANGLE), LENGTH * np.sin(ANGLE), el.slider_support(np.pi / 2)),
    }
    return el.Network(nodes, {"v": el.Beam("wall", "shuttle", section)})


def pressed(network: el.Network, points: np.ndarray, **control: object) -> el.Path:
    return el.trace(network, el.Displacement("shuttle", DOWN, points), el.Control(**control))  # type: ignore[arg-type]


@pytest.mark.parametrize(("shear", "column"), [(True, 1), (False, 2)])
def test_v_beam_follows_the_stable_branch(shear: bool, column: int) -> None:
    p = pressed(v_beam(shear=shear), STABLE[:, 0] * MM, tolerance=1e-8)
    assert p.status is el.PathStatus.COMPLETE
    assert p.stable.all()
    np.testing.assert_allclose(p.effort[p.at_requested], STABLE[:, column], atol=6e-7)
    names = p.branch[p.at_requested]
    assert all(name == "primary" for name in names[:3])
    assert all(name.startswith("bifurcated") for name in names[3:11])
    assert all(name == "primary" for name in names[11:])


@pytest.mark.parametrize(("shear", "places"), [(True, (0.912302, 4.750175)), (False, (0.920548, 4.773455))])
def test_v_beam_bifurcations_are_located(shear: bool, places: tuple[float, float]) -> None:
    p = pressed(v_beam(shear=shear), np.linspace(0.5, 6, 12) * MM)
    assert [event.kind for event in p.events] == ["bifurcation", "bifurcation"]
    np.testing.assert_allclose([event.drive / MM for event in p.events], places, atol=1e-6)


@pytest.mark.parametrize(
    ("thickness", "first", "last"), [(0.6, 0.291898, 5.383347), (0.8, 0.543216, 5.126420), (1.2, 1.492126, 4.161679)]
)
def test_v_beam_bifurcations_of_other_thicknesses(thickness: float, first: float, last: float) -> None:
    p = pressed(v_beam(thickness * MM), np.linspace(0.1, 6, 30) * MM)
    np.testing.assert_allclose([event.drive / MM for event in p.events], [first, last], atol=1e-6)


def test_a_thick_v_beam_does_not_bifurcate() -> None:
    p = pressed(v_beam(1.4 * MM), np.linspace(0.1, 6, 30) * MM)
    assert p.events == ()
    assert p.stable.all()


def test_v_beam_symmetric_branch_is_there_on_request_and_marked_unstable() -> None:
    p = pressed(v_beam(), SYMMETRIC[:, 0] * MM, branch="primary")
    np.testing.assert_allclose(p.effort[p.at_requested], SYMMETRIC[:, 1], atol=2e-6)
    assert not p.stable[p.at_requested].any()


def test_v_beam_force_vanishes_at_the_height_by_symmetry() -> None:
    p = pressed(v_beam(), np.array([4.265427]) * MM)
    assert p.effort[-1] == pytest.approx(0, abs=1e-6)


def test_v_beam_mirror_branches_have_the_same_force_and_mirrored_shapes() -> None:
    up, down = (pressed(v_beam(), np.array([2.0, 3.0]) * MM, sign=sign) for sign in (1, -1))
    np.testing.assert_allclose(up.effort[up.at_requested], down.effort[down.at_requested], rtol=1e-7)
    assert np.abs(up.shape("v", -1) - down.shape("v", -1)).max() > 0.1 * MM


@pytest.mark.parametrize(("travel", "stress"), [(2.0, 17.584), (3.0, 20.888), (4.0, 22.138)])
def test_v_beam_largest_stress(travel: float, stress: float) -> None:
    p = pressed(v_beam(), np.array([travel]) * MM)
    assert p.peak_stress().value[-1] / 1e6 == pytest.approx(stress, abs=6e-4)


def test_v_beam_in_tension() -> None:
    p = pressed(v_beam(), -np.array([0.1, 0.2, 0.5, 1.0]) * MM)
    np.testing.assert_allclose(p.effort[p.at_requested], [-0.411976, -0.855246, -2.374869, -5.559783], atol=2e-6)


def cosine_half(ratio: float) -> tuple[el.Network, float, float]:
    """Half a cosine arch whose rise is a hundredth of the span, `ratio` = rise / thickness."""
    span, thickness = 200 * MM, 2 * MM / ratio
    rise = span / 100
    section = el.Section(1e9, 10 * MM, thickness)
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "shuttle": el.Node(0.5 * span, rise, el.slider_support(np.pi / 2)),
    }
    beams = {"v": el.Beam("wall", "shuttle", section, el.CosineArch(rise, 0.5))}
    unit = 1e9 * 10 * MM * thickness**3 / 12 * rise / span**3
    return el.Network(nodes, beams), rise, unit


@pytest.mark.parametrize(
    ("ratio", "top", "at_top", "low", "at_low"),
    [(6, 707.06, 0.205, -332.70, 1.87), (10, 737.30, 0.16, -363.26, 1.915)],
)
def test_cosine_arch_normalised_extremes(ratio: float, top: float, at_top: float, low: float, at_low: float) -> None:
    """Normalised force f = F L^3 / (E I h) over D = d/h (Qiu, Lang, Slocum 2004: 740 and -370 for thin arches).

    The finite elements that the numbers come from had an imperfection of a thousandth of the thickness, which takes
    0.5 to 2 % off the corners; the perfect arch is slightly higher and never lower.
    """
    network, rise, unit = cosine_half(ratio)
    p = pressed(network, np.arange(0.005, 1.9999, 0.005) * rise, tolerance=1e-5)
    assert p.status is el.PathStatus.COMPLETE
    force, place = 2 * p.effort[p.at_requested] / unit, p.drive[p.at_requested] / rise
    assert 1.0 < force.max() / top < 1.01
    assert place[force.argmax()] == pytest.approx(at_top, abs=0.006)
    assert 1.0 < force.min() / low < 1.02
    assert place[force.argmin()] == pytest.approx(at_low, abs=0.006)


def test_cosine_arch_line_between_its_bifurcations() -> None:
    """Held in the mode 1 - cos(4 pi s), the shallow arch obeys f = 64 pi^2 (4/3 - D)."""
    network, rise, unit = cosine_half(10)
    p = pressed(network, np.array([0.6, 0.8, 1.0, 1.2]) * rise)
    place = p.drive[p.at_requested] / rise
    slope, level = np.polyfit(place, 2 * p.effort[p.at_requested] / unit, 1)
    assert slope == pytest.approx(-64 * np.pi**2, rel=2e-3)
    assert -level / slope == pytest.approx(4 / 3, rel=1e-3)
