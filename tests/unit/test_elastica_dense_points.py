"""However densely points are requested, a V-beam buckles once, straightens once, and reaches the last of them."""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit.elastica as el

MM = 1e-3


def pressed(points, sign=1):
    section = el.Section(1477e6, 6 * MM, 1 * MM, shear=True, poisson_ratio=0.3)
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "shuttle": el.Node(
            35 * MM * np.cos(np.radians(7)), 35 * MM * np.sin(np.radians(7)), el.slider_support(np.pi / 2)
        ),
    }
    return el.trace(
        el.Network(nodes, {"v": el.Beam("wall", "shuttle", section)}),
        el.Displacement("shuttle", -np.pi / 2, points * MM),
        el.Control(sign=sign),
    )


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("count", [120, 480, 600, 960])
def test_points_next_to_a_bifurcation_are_reached_on_their_branch(count, sign):
    """Among them 4.75 mm, 0.0002 mm before the leaf straightens, and 0.9125 mm, 0.0002 mm after it buckles."""
    path = pressed(np.linspace(0, 6, count + 1)[1:], sign)
    assert path.status is el.PathStatus.COMPLETE
    assert len(path.at_requested) == count
    assert path.stable.all()
    assert [event.drive / MM for event in path.events] == pytest.approx([0.912302, 4.750175], abs=1e-6)
    assert (np.diff(path.drive) > 0).all()


@pytest.mark.parametrize(("length", "slenderness"), [(80, 3.3), (192, 5), (192, 3.6), (35, 3.15)])
def test_leaves_that_lie_almost_flat_or_hardly_buckle_keep_their_stable_branch(length, slenderness):
    """A leaf of rise h and thickness h/Q buckles and straightens at 2h/3 (1 -/+ sqrt(1 - (pi/Q)^2)), nearly."""
    rise = 4.265 * MM
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "shuttle": el.Node(np.sqrt((length * MM) ** 2 - rise**2), rise, el.slider_support(np.pi / 2)),
    }
    leaf = el.Beam("wall", "shuttle", el.Section(1477e6, 6 * MM, rise / slenderness))
    path = el.trace(
        el.Network(nodes, {"v": leaf}), el.Displacement("shuttle", -np.pi / 2, np.linspace(0.02, 1.4, 70) * rise)
    )
    assert path.status is el.PathStatus.COMPLETE
    assert path.stable.all()
    root = np.sqrt(1 - (np.pi / slenderness) ** 2)
    expected = 2 / 3 * rise * np.array([1 - root, 1 + root])
    assert [event.drive for event in path.events] == pytest.approx(expected, abs=0.015 * rise)
