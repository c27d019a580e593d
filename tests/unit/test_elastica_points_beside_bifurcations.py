"""Requested points of V-beams next to their bifurcations, loosely and tightly, and starts on coarse meshes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cfmkit.elastica as el
from cfmkit.elastica.results.between_points import interpolate_path

LENGTH = 35e-3


def pressed(angle: float, thickness: float, points: Any, **control: Any) -> el.Path:
    nodes = {
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "d": el.Node(LENGTH * np.cos(angle), LENGTH * np.sin(angle), el.slider_support(np.pi / 2)),
    }
    leaf = el.Network(nodes, {"v": el.Beam("wall", "d", el.Section(1477e6, 6e-3, thickness))})
    return el.trace(leaf, el.Displacement("d", -np.pi / 2, np.asarray(points)), el.Control(**control))


def test_a_path_returns_to_its_primary_path_in_one_step_to_its_only_point() -> None:
    """A leaf of a twelfth of its rise: the end of its branch is passed over."""
    angle = 0.0796134409080207
    path = pressed(angle, 2.3904131510924884e-4, [5.051286820682658e-3], tolerance=1.0623860005428965e-6, sign=-1)
    assert path.status is el.PathStatus.COMPLETE
    assert path.stable.all()
    assert path.branch[-1] == "primary"


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 4.65e-5, 1e-5])
def test_a_stated_imperfection_does_not_depend_on_the_tolerance(tolerance: float) -> None:
    """Away from the bifurcation no direction is singular: beside it the mode was that of another shape."""
    angle, points = 0.043669063665053666, [6.1176e-4, 1.22353e-3, 1.83529e-3]
    loose, tight = (
        pressed(angle, 1.718747248202898e-4, points, tolerance=limit, imperfection=8.164652e-5)
        for limit in (tolerance, 1e-9)
    )
    assert loose.imperfection == tight.imperfection
    forces = [path.effort[path.at_requested] for path in (loose, tight)]
    np.testing.assert_allclose(forces[0], forces[1], rtol=0, atol=3 * tolerance * np.abs(forces[1]).max())


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("last", [True, False])
def test_a_path_may_end_or_begin_at_its_bifurcation(last: bool) -> None:
    """There is no point beyond it: the index of one was an internal error, or wrapped around to the other end."""
    angle = np.radians(7)
    path = pressed(angle, 1e-3, np.linspace(0, 1.9 * LENGTH * np.sin(angle), 21)[1:])
    whole = interpolate_path(path)
    assert whole is not None
    place = float(whole.corners[0])
    there, left = whole.solve_at(np.array([place])), int(np.searchsorted(path.drive, place))
    kept = slice(0, left) if last else slice(left, None)
    part = path.take(kept)
    corner = replace(there, branch=path.branch[left : left + 1] if last else path.branch[left - 1 : left])
    law = interpolate_path(part.append(corner) if last else corner.append(part))
    assert law is not None
    assert law.corners[-1 if last else 0] == pytest.approx(place)
    near = place + (-1e-4 if last else 1e-4) * np.arange(6.0)
    assert law.places[-1 if last else 0] == pytest.approx(place, rel=1e-14)
    np.testing.assert_allclose(law.effort("", near), whole.effort("", near), rtol=1e-7)
    np.testing.assert_allclose(law.stress("", near), whole.stress("", near), rtol=1e-3)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1.7e-5, 1e-6])
def test_the_mode_of_an_arch_is_sampled_finely_at_any_tolerance(tolerance: float) -> None:
    half, rise = 0.06, 0.012
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "t": el.Node(half, rise),
        "b": el.Node(2 * half, 0, el.CLAMPED_SUPPORT),
    }
    section = el.Section(2e9, 8e-3, rise / 12)
    beams = {
        "x": el.Beam("a", "t", section, el.CosineArch(rise, 0.5)),
        "y": el.Beam("t", "b", section, el.CosineArch(-rise, 0.5)),
    }
    drive = el.Displacement("t", -np.pi / 2, np.linspace(0, 1.2 * rise, 7)[1:])
    loose, tight = (
        el.trace(el.Network(nodes, beams), drive, el.Control(limit, imperfection=3e-5)) for limit in (tolerance, 1e-9)
    )
    assert "buckling mode" in loose.imperfection
    turns = [np.abs(path.motion("t")[path.at_requested, 2]) for path in (loose, tight)]
    np.testing.assert_allclose(turns[0], turns[1], rtol=0, atol=tolerance)


@pytest.mark.parametrize("sign", [1, -1])
def test_the_side_of_a_branch_does_not_depend_on_the_mesh(sign: Any) -> None:
    """Where no node moves in the mode, by the moment at the clamp; else by the node's rotation."""
    angle, rise, half = np.radians(7), 0.006, 0.03
    nodes = {
        "a": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "t": el.Node(half, rise),
        "b": el.Node(2 * half, 0, el.CLAMPED_SUPPORT),
    }
    section = el.Section(2e9, 8e-3, rise / 10)
    beams = {
        "x": el.Beam("a", "t", section, el.CosineArch(rise, 0.5)),
        "y": el.Beam("t", "b", section, el.CosineArch(-rise, 0.5)),
    }
    down = el.Displacement("t", -np.pi / 2, np.linspace(0, 1.0 * rise, 7)[1:])
    moments, turns = [], []
    for tolerance in (1e-3, 1e-5, 5e-6, 1e-6, 1e-8):
        leaf = pressed(angle, 1e-3, [1e-3, 2e-3], tolerance=tolerance, sign=sign)
        moments.append(leaf.end_force("v", 1)[leaf.at_requested[-1], 2])
        arch = el.trace(el.Network(nodes, beams), down, el.Control(tolerance=tolerance, sign=sign))
        turns.append(arch.motion("t")[arch.at_requested[-1], 2])
    assert moments == pytest.approx([-0.01141 * sign] * 5, rel=1e-2)
    assert abs(turns[0]) > 0.05
    assert turns == pytest.approx([turns[-1]] * 5, rel=1e-2)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8])
@pytest.mark.parametrize("steps", [3, 4, 10, 17])
def test_a_truss_of_stiff_beams_jumps_where_they_buckle_whatever_the_tolerance(tolerance: float, steps: int) -> None:
    """Two beams that do not stretch hold the apex; they buckle as columns clamped at one end and pinned at the other.

    N = 20.1907 EI / L^2 (tan u = u); there is no stable equilibrium near.
    """
    angle, length, stiff = np.radians(8), 0.05, el.Section(2e9, 8e-3, 1e-3, axial=False)
    across, up = length * np.cos(angle), length * np.sin(angle)
    nodes = {
        "left": el.Node(-across, 0, el.CLAMPED_SUPPORT),
        "apex": el.Node(0, up),
        "right": el.Node(across, 0, el.CLAMPED_SUPPORT),
    }
    beams = {"one": el.Beam("left", "apex", stiff), "two": el.Beam("right", "apex", stiff)}
    root = 4.493409457909064
    force = 2 * np.sin(angle) * root**2 * 2e9 * 8e-3 * 1e-9 / 12 / length**2
    drive = el.Loading((el.PointLoad("apex", fy=-force),), np.linspace(0.0, 1.5, steps + 1)[1:])
    path = el.trace(el.Network(nodes, beams), drive, el.Control(tolerance=tolerance))
    assert path.status is el.PathStatus.JUMPS
    assert path.stable.all()
    assert [(event.kind, event.before, event.after) for event in path.events] == [("bifurcation", 0, 1)]
    assert path.events[0].drive == pytest.approx(1.0, rel=10 * tolerance)
    assert path.drive[-1] <= 1.0 + 10 * tolerance
    assert len(path.at_requested) in (int((drive.points < 1.0).sum()), int((drive.points <= 1.0).sum()))
