"""Starts under constant loads and prestress, points beside bifurcations, ends of branches on paths that turn back."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import cfmkit.elastica as el

UP = np.pi / 2
SECTION = el.Section(2e9, 8e-3, 1e-3)


def half_arch(ratio: float) -> tuple[el.Network, float]:
    """Return half a clamped cosine arch whose rise is `ratio` times its thickness, and the rise [m]."""
    rise = 2e-3
    nodes = {"wall": el.Node(0, 0, el.CLAMPED_SUPPORT), "middle": el.Node(0.1, rise, el.slider_support(UP))}
    return el.Network(
        nodes, {"half": el.Beam("wall", "middle", el.Section(1e9, 1e-2, rise / ratio), el.CosineArch(rise, 0.5))}
    ), rise


@pytest.mark.parametrize("ratio", [2.33, 4.0, 6.0, 10.0, 20.0])
def test_the_end_of_a_branch_is_located_though_the_path_it_left_turns_back(ratio: float) -> None:
    """The symmetric path between the bifurcations has limit points: the end is found by going back.

    Closed form: two modes of a shallow arch, the second one straightened where its coefficient vanishes.
    """
    network, rise = half_arch(ratio)
    path = el.trace(
        network, el.Displacement("middle", -UP, np.arange(0.02, 1.99, 0.02) * rise), el.Control(tolerance=1e-6)
    )
    root = np.sqrt((8 / 9) ** 2 + 6 * (np.pi**2 / 9 - 2 * np.pi**2 / (3 * ratio**2)))
    end = 4 / 3 - (8 / 9 - root) / 3
    assert [event.kind for event in path.events] == ["bifurcation", "bifurcation"]
    assert path.events[1].drive / rise == pytest.approx(end, abs=1e-3)
    names, where = path.branch[path.at_requested], path.drive[path.at_requested] / rise
    assert (names[where > end + 0.01] == "primary").all()


@pytest.mark.parametrize("force", [0.2, 0.24])
def test_a_constant_load_on_a_segment_that_is_too_long_makes_the_mesh_finer(force: float) -> None:
    """The toggle sways off at 0.257 N: until then there is an equilibrium."""
    nodes = {"a": el.Node(0, 0, el.PINNED_SUPPORT), "t": el.Node(0.1, 0.01), "b": el.Node(0.2, 0, el.PINNED_SUPPORT)}
    beams = {"x": el.Beam("a", "t", SECTION), "y": el.Beam("t", "b", SECTION)}
    network = el.Network(nodes, beams, loads=(el.PointLoad("t", fy=-force),))
    assert el.trace(network, el.Displacement("t", 0.0, np.array([1e-5]))).status is el.PathStatus.COMPLETE


@pytest.mark.parametrize("loads", [(), (el.PointLoad("d", fy=1e-6),)])
def test_a_spring_may_be_prestressed_by_a_large_turn(loads: tuple[el.PointLoad, ...]) -> None:
    """A torsion spring of 0.05 N m/rad bends the end of a cantilever: the end moment is k (2 - turn)."""
    nodes = {"a": el.Node(0, 0, el.CLAMPED_SUPPORT), "d": el.Node(0.05, 0)}
    springs = (el.TorsionSpring(None, "d", 0.05, 2.0),)
    network = el.Network(nodes, {"x": el.Beam("a", "d", SECTION)}, springs=springs, loads=loads)
    path = el.trace(network, el.Displacement("d", 0.0, np.array([-1e-4])), el.Control(tolerance=1e-9))
    assert path.status is el.PathStatus.COMPLETE
    turn = path.motion("d")[-1, 2]
    assert path.end_force("x", 1)[-1, 2] == pytest.approx(0.05 * (2.0 - turn), rel=1e-6)


@pytest.mark.parametrize("branch", ["primary", "stable"])
@pytest.mark.parametrize("off", [1e-7, 1e-6, 1e-5])
def test_a_point_beside_a_bifurcation_does_not_lead_to_the_path_that_crosses(off: float, branch: str) -> None:
    rise = 0.02
    nodes = {"a": el.Node(0, 0, el.PINNED_SUPPORT), "t": el.Node(0.1, rise), "b": el.Node(0.2, 0, el.PINNED_SUPPORT)}
    beams = {
        "x": el.Beam("a", "t", SECTION, el.CosineArch(rise, 0.5)),
        "y": el.Beam("t", "b", SECTION, el.CosineArch(-rise, 0.5)),
    }
    network = el.Network(nodes, beams)

    def pushed(points: list[float]) -> el.Path:
        return el.trace(network, el.Displacement("t", -UP, np.array(points)), el.Control(branch=branch))  # type: ignore[arg-type]

    place = pushed([1e-3, 5e-3]).events[0].drive
    near, far = pushed([1e-3, place + off, 3e-3, 5e-3]), pushed([1e-3, 3e-3, 5e-3])
    assert near.effort[-1] == pytest.approx(far.effort[-1], rel=1e-6)
    assert [event.kind for event in near.events] == ["bifurcation"]
    assert near.branch[-1][:10] == far.branch[-1][:10]


def test_a_path_keeps_no_more_memory_than_its_points_take() -> None:
    network, rise = half_arch(4.0)
    path = el.trace(network, el.Displacement("middle", -UP, [0.1 * rise]))
    parts = path.at.z, path.at.drive, path.unstable, path.requested
    assert all(part.base is None or part.base.nbytes == part.nbytes for part in parts)


LENGTH, RIGIDITY = 0.1, 2e9 * 8e-3 * 1e-9 / 12
EULER = np.pi**2 * RIGIDITY / (4 * LENGTH**2)  # of a column clamped at its foot, free at its top


def pressed(ratio: float, section: el.Section = SECTION) -> el.Network:
    """Return a column under a constant load of so many times Euler's."""
    nodes = {"foot": el.Node(0, 0, el.CLAMPED_SUPPORT), "top": el.Node(LENGTH, 0)}
    return el.Network(
        nodes, {"column": el.Beam("foot", "top", section)}, loads=(el.PointLoad("top", fx=-ratio * EULER),)
    )


@pytest.mark.parametrize(("sign", "ratio"), [(1, 1.05), (-1, 1.2), (1, 2.0), (1, 6.0)])
def test_constant_loads_beyond_a_bifurcation_start_on_its_stable_branch(sign: int, ratio: float) -> None:
    """The elastica; S. P. Timoshenko and J. M. Gere, Theory of Elastic Stability, 1961, sec. 2.7, k = sin(angle/2)."""
    rigid = el.Section(2e9, 8e-3, 1e-3, axial=False)
    drive = el.Loading((el.PointLoad("top", fy=-sign * 1e-9 * EULER),), np.array([0.5, 1.0]))
    path = el.trace(pressed(ratio, rigid), drive, el.Control(tolerance=1e-9, sign=sign))  # type: ignore[arg-type]
    k = brentq(lambda k: ellipk(k * k) / (np.pi / 2) - np.sqrt(ratio), 1e-9, 1 - 1e-12)
    turn = path.motion("top")[0, 2]
    assert path.status is el.PathStatus.COMPLETE
    assert path.stable.all()
    assert abs(turn) == pytest.approx(2 * np.arcsin(k), rel=1e-6)
    assert path.motion("top")[0, 1] * sign < 0
    assert [(e.kind, e.before, e.after) for e in path.events] == [("bifurcation under constant loads", 0, 1)]
    assert path.events[0].drive * ratio == pytest.approx(1.0, rel=1e-7)
    assert set(path.branch) == {f"bifurcated under {100 / ratio:.4g} % of the constant loads, sign {sign:+d}"}


def test_constant_loads_beyond_a_bifurcation_as_the_control_says() -> None:
    """Straight on, unstable; nowhere, since stability is lost before the drive begins; bent by an imperfection."""
    drive = el.Loading((el.PointLoad("top", fy=0.01 * EULER),), np.array([0.5, 1.0]))
    primary = el.trace(pressed(1.5), drive, el.Control(tolerance=1e-6, branch="primary"))
    assert primary.status is el.PathStatus.COMPLETE
    assert (primary.unstable == 1).all()
    stopped = el.trace(pressed(1.5), drive, el.Control(tolerance=1e-6, branch="stop"))
    assert (stopped.status, len(stopped)) == (el.PathStatus.JUMPS, 0)
    assert "of the constant loads" in stopped.message
    assert el.trace(pressed(0.9), drive, el.Control(tolerance=1e-6, branch="stop")).status is el.PathStatus.COMPLETE
    one, other = (
        el.trace(pressed(1.5), drive, el.Control(tolerance=1e-6, imperfection=size)) for size in (1e-6, -1e-6)
    )
    assert one.stable.all()
    assert other.stable.all()
    assert one.imperfection == "1e-06 m of the buckling mode under 66.67 % of the constant loads"
    assert one.motion("top")[0, 1] * other.motion("top")[0, 1] < 0


def test_a_displacement_held_from_the_start_beyond_a_bifurcation() -> None:
    """A guided column shortened by its support, then driven sideways at its middle: buckled from the start."""
    short = el.Support(True, True, True, displacement=(-2e-3, 0.0, 0.0))
    nodes = {"foot": el.Node(0, 0, el.CLAMPED_SUPPORT), "middle": el.Node(0.05, 0), "top": el.Node(0.1, 0, short)}
    beams = {"one": el.Beam("foot", "middle", SECTION), "two": el.Beam("middle", "top", SECTION)}
    drive = el.Loading((el.PointLoad("middle", fy=1e-9),), np.array([1.0]))
    paths = [el.trace(el.Network(nodes, beams), drive, el.Control(tolerance=1e-7, sign=sign)) for sign in (1, -1)]
    rises = [path.motion("middle")[0, 1] for path in paths]
    assert all(path.stable.all() for path in paths)
    assert rises[0] == pytest.approx(-rises[1], rel=1e-4)
    # shallow: y = h (1 - cos(2 pi x / L)) / 2 is longer than its span by (pi h)^2 / (4 L)
    assert abs(rises[0]) == pytest.approx(2 / np.pi * np.sqrt(2e-3 * 0.1), rel=0.03)
