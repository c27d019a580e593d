"""Loads that turn with their node: what diverges is reported, where it does; whether it flutters depends on masses.

A column, clamped at its foot, under a load P at its top of which a share a stays tangential, and a small dead force F
across. With q^2 = P/(EI), c = cos(qL) its top turns by F/P (1 - c)/(c + a (1 - c)): it diverges where c = -a/(1 - a),
and not at all if a is more than a half; M. Beck, Z. angew. Math. Phys. 3 (1952) 225, and V. V. Bolotin, Nonconservative
Problems of the Theory of Elastic Stability, 1963.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import cfmkit.elastica as el

LENGTH, RIGIDITY = 0.1, 2e9 * 8e-3 * 1e-9 / 12
EULER = np.pi**2 * RIGIDITY / (4 * LENGTH**2)  # of a column clamped at its foot, free at its top
NODES = {"foot": el.Node(0, 0, el.CLAMPED_SUPPORT), "top": el.Node(LENGTH, 0)}


def column(loads: Any = ()) -> el.Network:
    beam = el.Beam("foot", "top", el.Section(2e9, 8e-3, 1e-3, axial=False))
    return el.Network(NODES, {"column": beam}, loads=loads)


@pytest.mark.parametrize("ratio", [3.9, 4.1, 6.0, 8.0])
def test_a_column_under_a_tangential_load_never_diverges(ratio: float) -> None:
    """From 4 times Euler's load on the symmetric part of the tangent is indefinite: that is no loss of stability."""
    tangential = el.PointLoad("top", fx=-ratio * EULER, follows=True)
    push = el.Loading((el.PointLoad("top", fy=1e-6 * EULER),), np.array([0.5, 1.0]))
    path = el.trace(column((tangential,)), push)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.events == ()
    assert path.stable.all()
    angle = np.pi / 2 * np.sqrt(ratio)
    assert path.motion("top")[-1, 2] == pytest.approx(1e-6 / ratio * (1 - np.cos(angle)), rel=1e-6)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
@pytest.mark.parametrize("share", [0.0, 0.25, 0.4, 0.45])
def test_a_column_under_a_partly_tangential_load_diverges_where_its_tangent_is_singular(
    share: float, tolerance: float
) -> None:
    loads = (el.PointLoad("top", fx=-(1 - share) * EULER), el.PointLoad("top", fx=-share * EULER, follows=True))
    press = el.Loading(loads, np.array([1.0, 2.0, 3.5]))
    path = el.trace(column(), press, el.Control(tolerance=tolerance, branch="primary"))
    expected = (np.arccos(-share / (1 - share)) / (np.pi / 2)) ** 2
    assert [(event.kind, event.before, event.after) for event in path.events] == [("bifurcation", 0, 1)]
    assert path.events[0].drive == pytest.approx(expected, rel=10 * tolerance)
    beside = np.abs(path.drive - expected) > 1e-9 * expected
    assert (path.stable == (path.drive < expected))[beside].all()


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_a_limit_point_under_a_load_that_follows_is_told_as_one(tolerance: float) -> None:
    """The symmetric part of the tangent is singular before: no bifurcation is there."""
    network = column((el.PointLoad("top", fx=-1.3 * EULER),))
    drive = el.Loading((el.PointLoad("top", fy=0.1 * EULER, follows=True),), np.array([0.5, 1.0, 2.0]))
    ends, passed = (
        el.trace(network, drive, el.Control(tolerance=tolerance, through_folds=folds)) for folds in (False, True)
    )
    assert ends.status is el.PathStatus.LIMIT_POINT
    assert [event.kind for event in ends.events] == ["bifurcation under constant loads"]
    assert [event.kind for event in passed.events] == ["bifurcation under constant loads", "limit point"]
    assert passed.events[1].drive == pytest.approx(ends.drive[-1], rel=max(10 * tolerance, 2e-6))


@pytest.mark.parametrize("ratio", [3.9, 6.0])
def test_two_columns_under_tangential_loads_diverge_no_more_than_one(ratio: float) -> None:
    """The symmetric part of the tangent has two negative eigenvalues: the sign of the determinant does not show it."""
    tangential = tuple(el.PointLoad(name, fx=-ratio * EULER, follows=True) for name in ("top", "end"))
    push = el.Loading((el.PointLoad("top", fy=1e-6 * EULER),), np.array([0.5, 1.0]))
    path = el.trace(two_columns(tangential), push)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.events == ()
    assert path.stable.all()


def test_two_columns_under_partly_tangential_loads_diverge_both() -> None:
    share = 0.25
    loads = [
        (el.PointLoad(name, fx=-(1 - share) * EULER), el.PointLoad(name, fx=-share * EULER, follows=True))
        for name in ("top", "end")
    ]
    path = el.trace(two_columns(()), el.Loading(sum(loads, ()), np.array([1.0, 3.0])), el.Control(branch="primary"))
    expected = (np.arccos(-share / (1 - share)) / (np.pi / 2)) ** 2
    assert 1.0 < expected < 3.0
    assert path.unstable[path.at_requested].tolist() == [0, 2]


def two_columns(loads: Any) -> el.Network:
    """Return two columns side by side whose tops a weak spring joins."""
    nodes = NODES | {"other": el.Node(0, LENGTH, el.CLAMPED_SUPPORT), "end": el.Node(LENGTH, LENGTH)}
    section = el.Section(2e9, 8e-3, 1e-3, axial=False)
    beams = {"one": el.Beam("foot", "top", section), "two": el.Beam("other", "end", section)}
    weak = el.LineSpring("top", "end", 1e-3 * RIGIDITY / LENGTH**3)
    return el.Network(nodes, beams, springs=(weak,), loads=loads)
