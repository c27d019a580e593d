"""Stiffness of the driven node across its drive, from the tangent along a path."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import cfmkit.elastica as el
from cfmkit.elastica.results.cross_stiffness import cross_stiffness

MODULUS, WIDTH, THICKNESS, LENGTH = 200e9, 10e-3, 1e-3, 0.1
RIGIDITY = MODULUS * WIDTH * THICKNESS**3 / 12


def straight(end: el.Support = el.FREE_SUPPORT, axial: bool = True) -> el.Network:
    beam = el.Beam("root", "tip", el.Section(MODULUS, WIDTH, THICKNESS, axial=axial))
    return el.Network({"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "tip": el.Node(LENGTH, 0, end)}, {"x": beam})


@pytest.mark.parametrize(
    ("end", "factor"), [(el.FREE_SUPPORT, 3.0), (el.slider_support(0.0), 12.0)], ids=["free", "guided"]
)
@pytest.mark.parametrize("axial", [True, False])
def test_a_straight_beam_resists_across_as_the_closed_form_says(end: el.Support, factor: float, axial: bool) -> None:
    """3 or 12 EI/L^3, as the support leaves the rotation; what guides the node across is taken away."""
    path = el.trace(straight(end, axial), el.Loading((el.PointLoad("tip", fx=1e-6),), np.array([1.0])))
    assert cross_stiffness(path, "tip", 0.0)[-1] == pytest.approx(factor * RIGIDITY / LENGTH**3, rel=1e-6)


def test_thrust_takes_it_away_and_a_pull_adds_to_it() -> None:
    """EI q^3 / (2 tan(qL/2) - qL) of a beam between clamp and guide under a thrust P, with q^2 = P/EI."""
    euler = np.pi**2 * RIGIDITY / LENGTH**2
    thrust = np.array([0.5, 0.9]) * euler
    path = el.trace(straight(el.slider_support(0.0), axial=False), el.Loading((el.PointLoad("tip", fx=-1.0),), thrust))
    q = np.sqrt(thrust / RIGIDITY)
    wanted = RIGIDITY * q**3 / (2 * np.tan(q * LENGTH / 2) - q * LENGTH)
    assert cross_stiffness(path, "tip", 0.0)[path.at_requested] == pytest.approx(wanted, rel=1e-6)


def test_it_is_what_a_small_push_across_meets_in_any_pose() -> None:
    """An arch with a link and a spring, far from rest: the force of the guide by its place, as differences."""

    def path(shift: float) -> tuple[float, np.ndarray]:
        top = el.Support(across=True, direction=np.pi / 2, displacement=(0.0, shift, 0.0))
        nodes = {
            "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
            "top": el.Node(0.05, 0.02, top),
            "eye": el.Node(0.055, 0.03),
        }
        beams = {"x": el.Beam("a", "eye", el.Section(2e9, WIDTH, THICKNESS), el.arc(-0.8))}
        net = el.Network(nodes, beams, (el.Link("top", "eye"),), (el.SlideSpring("eye", 0.3, 20.0),))
        found = el.trace(net, el.Displacement("top", -np.pi / 2, np.array([0.004, 0.008])))
        assert found.status is el.PathStatus.COMPLETE
        return float(found.reaction("top")[-1, 0]), cross_stiffness(found, "top", -np.pi / 2)

    small = 1e-7
    (more, _), (less, _), (_, here) = path(small), path(-small), path(0.0)
    # across is to the left of the support's direction: against x; the reaction is what the guide exerts
    assert here[-1] == pytest.approx((less - more) / (2 * small), rel=1e-5)


def test_it_does_not_depend_on_whether_a_displacement_or_a_force_drives() -> None:
    moved = el.trace(straight(), el.Displacement("tip", np.pi / 2, np.array([0.02])))
    pushed = el.trace(straight(), el.Loading((el.PointLoad("tip", fy=1.0),), moved.effort[-1:]))
    one, other = (cross_stiffness(path, "tip", np.pi / 2, [len(path) - 1]) for path in (moved, pushed))
    assert one == pytest.approx(other, rel=1e-6)


def eighty_beams() -> el.Path:
    """Eighty beams in a row, hardly pulled."""
    places = np.linspace(0.0, LENGTH, 81)
    nodes = {f"n{k}": el.Node(float(x), 0, el.FREE_SUPPORT if k else el.CLAMPED_SUPPORT) for k, x in enumerate(places)}
    beams = {f"b{k}": el.Beam(f"n{k}", f"n{k + 1}", el.Section(MODULUS, WIDTH, THICKNESS)) for k in range(80)}
    return el.trace(el.Network(nodes, beams), el.Loading((el.PointLoad("n80", fx=1e-6),), np.array([1.0])))


def test_matrices_of_large_networks_are_not_all_held_at_once() -> None:
    path, poses = eighty_beams(), 30
    size = 8 * len(path.mesh.free) ** 2
    cross_stiffness(path, "n80", 0.0)
    tracemalloc.start()
    try:
        cross_stiffness(path, "n80", 0.0, np.zeros(poses, dtype=np.int64))
        held = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert held < 0.5 * poses * size  # a fifth; all at once took three times as much as they need


def test_there_is_none_where_nothing_gives_way() -> None:
    """A straight beam that does not stretch, pushed sideways by nothing yet: along itself it is rigid."""
    path = el.trace(straight(axial=False), el.Loading((el.PointLoad("tip", fy=1e-3),), np.array([0.0, 1.0])))
    found = cross_stiffness(path, "tip", np.pi / 2)
    assert path.drive[0] == 0.0
    assert np.isnan(found[0])
    assert found[-1] > 1e6 * RIGIDITY / LENGTH**3
