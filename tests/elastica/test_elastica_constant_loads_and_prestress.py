"""Constant loads and prestressed springs beyond a bifurcation: the path starts on the stable branch and says so.

A column, clamped at its foot, is pressed by a tendon from its top to its foot. The force goes through the foot, so that
the column bends as one with two pinned ends does: it buckles at four times Euler's load, and its foot, where it is
clamped, is inclined to the tendon as such a column's end is.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from buckling_structures import STIFF_STRIP, STRIP, half_arch, load
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk, ellipkinc

import cfmkit.elastica as el
from cfmkit.elastica.mechanics.compiled_module import WITHOUT_C_VARIABLE

LENGTH, RIGIDITY = 0.1, 2e9 * 8e-3 * 1e-9 / 12
EULER = np.pi**2 * RIGIDITY / (4 * LENGTH**2)  # of a column clamped at its foot, free at its top
STIFF = 50 * EULER / LENGTH  # of the tendon
NODES = {"foot": el.Node(0, 0, el.CLAMPED_SUPPORT), "top": el.Node(LENGTH, 0)}


def column(springs: Any, loads: Any = ()) -> el.Network:
    return el.Network(NODES, {"column": el.Beam("foot", "top", STIFF_STRIP)}, springs=springs, loads=loads)


def tendon(ratio: float, pull: float = 0.0, **control: Any) -> el.Path:
    """Return the path under a tendon of so many times Euler's load and a constant pull at the top, pushed sideways."""
    springs = (el.LineSpring("top", None, STIFF, LENGTH - ratio * EULER / STIFF),)
    loads = (el.PointLoad("top", fx=pull * EULER),) if pull else ()
    push = el.Loading((el.PointLoad("top", fy=-1e-9 * EULER),), np.array([0.5, 1.0]))
    return el.trace(column(springs, loads), push, el.Control(**control))


def bent(ratio: float) -> tuple[float, float]:
    """Return the length of a buckled column's tendon [m] and its angle to the foot: the elastica of two pinned ends."""

    def chord(m: float) -> float:
        return float(LENGTH * (2 * ellipe(m) / ellipk(m) - 1))

    def excess(m: float) -> float:
        return float(RIGIDITY * (2 * ellipk(m) / LENGTH) ** 2 - STIFF * (chord(m) - LENGTH) - ratio * EULER)

    m = brentq(excess, 1e-12, 0.8, xtol=1e-15)
    return chord(m), 2 * np.arcsin(np.sqrt(m))


@pytest.mark.parametrize(("sign", "ratio"), [(1, 4.02), (-1, 5.0), (1, 8.0)])
def test_prestress_beyond_a_bifurcation_starts_on_its_stable_branch(sign: Any, ratio: float) -> None:
    path = tendon(ratio, tolerance=1e-9, sign=sign)
    chord, angle = bent(ratio)
    x, y, turn = path.motion("top")[0]
    assert path.status is el.PathStatus.COMPLETE
    assert path.stable.all()
    assert abs(turn) == pytest.approx(2 * angle, rel=1e-6)
    assert (LENGTH + x, abs(y)) == pytest.approx((chord * np.cos(angle), chord * np.sin(angle)), rel=1e-6)
    assert y * sign < 0
    assert [(e.kind, e.before, e.after) for e in path.events] == [("bifurcation under prestress", 0, 1)]
    assert path.events[0].drive * ratio == pytest.approx(4.0, rel=1e-7)
    assert set(path.branch) == {f"bifurcated under {400 / ratio:.4g} % of the prestress, sign {sign:+d}"}


def test_a_prestressed_spring_of_fixed_direction_buckles_a_column_as_a_dead_load_does() -> None:
    """The elastica; S. P. Timoshenko and J. M. Gere, Theory of Elastic Stability, 1961, sec. 2.7, m = sin^2(turn/2)."""
    springs = (el.SlideSpring("top", 0.0, STIFF, -1.5 * EULER / STIFF),)
    path = el.trace(column(springs), el.Displacement("top", np.pi / 2, np.array([1e-9])), el.Control(tolerance=1e-9))
    assert path.events == ()  # the drive holds the top
    push = el.Loading((el.PointLoad("top", fy=1e-9 * EULER),), np.array([1.0]))
    path = el.trace(column(springs), push, el.Control(tolerance=1e-9))

    def short(m: float) -> float:
        return float(LENGTH * (2 - 2 * ellipe(m) / ellipk(m)))

    m = brentq(lambda m: RIGIDITY * (ellipk(m) / LENGTH) ** 2 + STIFF * short(m) - 1.5 * EULER, 1e-12, 0.8)
    assert [event.kind for event in path.events] == ["bifurcation under prestress"]
    assert path.motion("top")[0, 0] == pytest.approx(-short(m), rel=1e-6)
    assert abs(path.motion("top")[0, 2]) == pytest.approx(2 * np.arcsin(np.sqrt(m)), rel=1e-6)


@pytest.mark.parametrize("cause", ["prestress", "constant loads"])
def test_a_start_beyond_a_bifurcation_is_as_the_control_says(cause: str) -> None:
    """Straight on, unstable; nowhere, since stability is lost before the drive begins; bent by an imperfection."""

    def start(ratio: float, **control: Any) -> el.Path:
        if cause == "prestress":
            return tendon(4 * ratio, **control)
        return pressed(ratio, el.PointLoad("top", fy=0.01 * EULER), [0.5, 1.0], **control)

    primary = start(1.25, branch="primary")
    assert primary.status is el.PathStatus.COMPLETE
    assert (primary.unstable == 1).all()
    assert primary.events == ()
    stopped = start(1.25, branch="stop")
    assert (stopped.status, len(stopped)) == (el.PathStatus.JUMPS, 0)
    assert f"of the {cause}" in stopped.message
    assert start(0.9, branch="stop").status is el.PathStatus.COMPLETE
    left, right = (start(1.25, imperfection=size) for size in (1e-6, -1e-6))
    assert left.stable.all()
    assert right.stable.all()
    assert left.imperfection == f"1e-06 m of the buckling mode under 80 % of the {cause}"
    assert left.motion("top")[0, 1] * right.motion("top")[0, 1] < 0
    assert cause != "prestress" or left.motion("top")[0, 1] == pytest.approx(-right.motion("top")[0, 1])


@pytest.mark.parametrize("pull", [0.4, 1.0, 1.5, 2.0])
def test_constant_loads_may_straighten_what_prestress_has_bent(pull: float) -> None:
    """The branch ends under the constant loads, where the straight column is stable.

    Under a tendon T and a pull N its deflection is that of a beam-column: N/T = tan(qL)/(qL), q^2 = (T - N)/EI.
    """
    path = tendon(5.0, pull)
    needed = brentq(lambda n: n / 5 - np.tan(0.5 * np.pi * np.sqrt(5 - n)) / (0.5 * np.pi * np.sqrt(5 - n)), 0, 0.9)
    assert path.status is el.PathStatus.COMPLETE
    assert path.stable.all()
    closed = path.events[1]
    assert (closed.kind, closed.before, closed.after) == ("bifurcation under constant loads", 1, 0)
    assert closed.drive * pull == pytest.approx(needed, rel=1e-6)
    assert set(path.branch) == {"primary"}
    assert np.abs(path.motion("top")[:, 1]).max() < 1e-7 * LENGTH


def pressed(ratio: float, push: el.PointLoad, points: Any, **control: Any) -> el.Path:
    """Return the path of a column under a constant load of so many times Euler's that is pushed in addition."""
    network = column((), (el.PointLoad("top", fx=-ratio * EULER),))
    return el.trace(network, el.Loading((push,), np.array(points)), el.Control(**control))


def turn_at_top(ratio: float, across: float) -> float:
    """Return the rotation of a column's top under a load along and one across it, in units of Euler's: the elastica.

    The load's angle to the column is b; with m = sin^2(t/2), t the angle of the top to the load, it bends over the
    length L: sqrt(R/EI) L = K(m) - F(asin(sin(b/2)/sqrt(m)), m).
    """
    b = np.arctan2(across, ratio)
    size = np.hypot(ratio, across) ** 0.5 * np.pi / 2

    def excess(t: float) -> float:
        m = np.sin(t / 2) ** 2
        return float(ellipk(m) - ellipkinc(np.arcsin(np.sin(b / 2) / np.sqrt(m)), m) - size)

    return float(brentq(excess, b * (1 + 1e-9), 3.0, xtol=1e-14) - b)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-9])
@pytest.mark.parametrize("off", [0.0, -1e-7, -1e-9, -1e-12, 1e-12, 1e-9, 1e-8])
def test_a_column_under_just_its_critical_load_bends_with_the_cube_root_of_a_push(off: float, tolerance: float) -> None:
    path = pressed(1 + off, el.PointLoad("top", fy=-1e-3 * EULER), [0.0, 0.01, 0.5, 1.0], tolerance=tolerance)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable.all()
    assert path.requested[path.at_requested].tolist() == [0, 1, 2, 3]
    expected = [turn_at_top(1 + off, 1e-3 * share) for share in (0.01, 0.5, 1.0)]
    assert -path.motion("top")[path.at_requested[1:], 2] == pytest.approx(expected, rel=10 * tolerance)
    assert [event.kind for event in path.events if event.drive < 1] in ([], ["bifurcation under constant loads"])


@pytest.mark.parametrize("off", [0.0, -1e-12, 1e-9, 1e-6])
def test_a_column_under_just_its_critical_load_may_be_relieved_or_pressed_further(off: float) -> None:
    relieved = pressed(1 + off, el.PointLoad("top", fx=EULER), [0.05, 0.2])
    assert relieved.status is el.PathStatus.COMPLETE
    assert relieved.branch[-1] == "primary"
    assert (np.diff(relieved.drive) > 0).all()
    assert np.abs(relieved.motion("top")[-1, 1:]).max() < 1e-9
    further = [pressed(1 + off, el.PointLoad("top", fx=-EULER), [0.05, 0.2], sign=sign) for sign in (1, -1)]
    assert all(path.status is el.PathStatus.COMPLETE for path in further)
    assert all(path.stable.all() for path in further)
    m = brentq(lambda m: (ellipk(m) * 2 / np.pi) ** 2 - 1.2 - off, 1e-9, 0.9)
    turns = [path.motion("top")[-1, 2] for path in further]
    assert turns == pytest.approx([-2 * np.arcsin(np.sqrt(m)), 2 * np.arcsin(np.sqrt(m))], rel=1e-6)


def test_a_branch_that_ends_where_it_begins_does_not_go_back_on_its_mirror_image(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In numpy a step along the arc led round its end, and far back."""
    monkeypatch.setenv(WITHOUT_C_VARIABLE, "1")
    path = pressed(1 + 1e-9, el.PointLoad("top", fx=EULER), [0.05, 0.2])
    assert path.status is el.PathStatus.COMPLETE
    assert (np.diff(path.drive) > 0).all()
    assert path.events[1].drive == pytest.approx(1e-9, abs=2e-11)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-7, 1e-9])
def test_prestress_that_is_just_critical_has_a_start(tolerance: float) -> None:
    """Half a pinned column is a critical cantilever: a mesh of halves is too coarse."""
    path = tendon(4.0, tolerance=tolerance)
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.stable.all()
    assert path.motion("top")[-1, 1] < 0


@pytest.mark.parametrize("tolerance", [1e-3, 1e-7, 1e-9])
def test_a_branch_under_constant_loads_ends_where_the_drive_relieves_them(tolerance: float) -> None:
    """A requested point may lie just there, and a path on which none does ends its branch there as well."""
    for points in ([0.25, 0.5, 0.75], [0.25, 0.75], [0.25, 0.5]):
        path = pressed(1.5, el.PointLoad("top", fx=EULER), points, tolerance=tolerance)
        assert path.status is el.PathStatus.COMPLETE, path.message
        assert path.stable.all()
        assert path.drive[path.at_requested] == pytest.approx(points)
        assert [event.kind for event in path.events] == ["bifurcation under constant loads", "bifurcation"]
        assert path.events[1].drive == pytest.approx(0.5, abs=tolerance)
        assert path.branch[0].startswith("bifurcated under 66.67 %")
        assert points[-1] == 0.5 or path.branch[-1] == "primary"


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-7])
def test_a_column_bent_by_little_is_pressed_far_beyond_its_critical_load(tolerance: float) -> None:
    """Without leaving the path it turns sharply near that load: the coarse mesh needs as much patience as the drive."""
    nodes = {"foot": NODES["foot"], "middle": el.Node(0.5 * LENGTH, 0), "top": NODES["top"]}
    beams = {"one": el.Beam("foot", "middle", STRIP), "two": el.Beam("middle", "top", STRIP)}
    springs = (el.LineSpring("top", None, EULER / LENGTH, ground=(1.5 * LENGTH, 0.0)),)
    bent = el.Network(nodes, beams, springs=springs, loads=(el.PointLoad("top", fx=-4.16 * EULER),))
    push = el.Loading((el.PointLoad("top", fy=0.5 * EULER),), np.array([0.2, 0.5]))
    path, fine = (
        el.trace(bent, push, el.Control(tolerance=t, branch="primary", imperfection=1e-4)) for t in (tolerance, 1e-9)
    )
    assert path.status is el.PathStatus.COMPLETE, path.message
    assert path.motion("top")[-1] == pytest.approx(fine.motion("top")[-1], rel=10 * tolerance)


@pytest.mark.parametrize("loads", [(), (el.PointLoad("top", fy=1e-6),)])
def test_a_spring_may_be_prestressed_by_a_large_turn(loads: tuple[el.PointLoad, ...]) -> None:
    """A torsion spring of 0.05 N m/rad bends the end of a cantilever: the end moment is k (2 - turn)."""
    springs = (el.TorsionSpring(None, "top", 0.05, 2.0),)
    strip = el.Network(NODES, {"x": el.Beam("foot", "top", STRIP)}, springs=springs, loads=loads)
    path = el.trace(strip, el.Displacement("top", 0.0, np.array([-1e-4])), el.Control(tolerance=1e-9))
    assert path.status is el.PathStatus.COMPLETE
    turn = path.motion("top")[-1, 2]
    assert path.end_force("x", 1)[-1, 2] == pytest.approx(0.05 * (2.0 - turn), rel=1e-6)


@pytest.mark.parametrize(("sign", "ratio"), [(1, 1.05), (-1, 1.2), (1, 2.0), (1, 6.0)])
def test_constant_loads_beyond_a_bifurcation_start_on_its_stable_branch(sign: Any, ratio: float) -> None:
    """The elastica; S. P. Timoshenko and J. M. Gere, Theory of Elastic Stability, 1961, sec. 2.7, k = sin(angle/2)."""
    path = pressed(ratio, el.PointLoad("top", fy=-sign * 1e-9 * EULER), [0.5, 1.0], tolerance=1e-9, sign=sign)
    k = brentq(lambda k: ellipk(k * k) / (np.pi / 2) - np.sqrt(ratio), 1e-9, 1 - 1e-12)
    assert path.status is el.PathStatus.COMPLETE
    assert path.stable.all()
    assert abs(path.motion("top")[0, 2]) == pytest.approx(2 * np.arcsin(k), rel=1e-6)
    assert path.motion("top")[0, 1] * sign < 0
    assert [(e.kind, e.before, e.after) for e in path.events] == [("bifurcation under constant loads", 0, 1)]
    assert path.events[0].drive * ratio == pytest.approx(1.0, rel=1e-7)
    assert set(path.branch) == {f"bifurcated under {100 / ratio:.4g} % of the constant loads, sign {sign:+d}"}


def test_a_displacement_held_from_the_start_beyond_a_bifurcation() -> None:
    """A guided column shortened by its support, then driven sideways at its middle: buckled from the start."""
    short = el.Support(True, True, True, displacement=(-2e-3, 0.0, 0.0))
    nodes = {"foot": NODES["foot"], "middle": el.Node(0.05, 0), "top": el.Node(0.1, 0, short)}
    beams = {"one": el.Beam("foot", "middle", STRIP), "two": el.Beam("middle", "top", STRIP)}
    drive = el.Loading((el.PointLoad("middle", fy=1e-9),), np.array([1.0]))
    signs: tuple[Any, ...] = (1, -1)
    paths = [el.trace(el.Network(nodes, beams), drive, el.Control(sign=sign)) for sign in signs]
    rises = [path.motion("middle")[0, 1] for path in paths]
    assert all(path.stable.all() for path in paths)
    assert rises[0] == pytest.approx(-rises[1], rel=1e-4)
    # shallow: y = h (1 - cos(2 pi x / L)) / 2 is longer than its span by (pi h)^2 / (4 L)
    assert abs(rises[0]) == pytest.approx(2 / np.pi * np.sqrt(2e-3 * 0.1), rel=0.03)


def test_constant_loads_beyond_a_limit_point_say_at_which_share() -> None:
    """The limit load itself is that of the same load as a drive."""
    half = half_arch(4e-3, 1.6e-3)
    alone = el.trace(half, load("t", [10.0]), el.Control(branch="primary"))
    assert alone.status is el.PathStatus.LIMIT_POINT
    heavy = replace(half, loads=(el.PointLoad("t", fy=-2.5 * float(alone.drive[-1])),))
    path = el.trace(heavy, load("t", [0.1]))
    assert path.status is el.PathStatus.NO_START
    assert "lost at 0.4 of the constant loads" in path.message


def test_a_spring_without_free_length_is_tightened_as_any_other() -> None:
    """Its force is the stiffness times its vector, as that of two slide springs relaxed at its other end."""
    nodes = {
        "foot": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "knee": el.Node(0.02, 0.01),
        "top": el.Node(0, 0.03, el.slider_support(np.pi / 2)),
    }
    beams = {
        "lower": el.Beam("foot", "knee", STIFF_STRIP, el.arc(-np.pi / 3)),
        "upper": el.Beam("knee", "top", STIFF_STRIP),
    }
    slides = (el.SlideSpring("knee", 0.0, 1e3, -0.02), el.SlideSpring("knee", np.pi / 2, 1e3, -0.01))
    zero = el.Network(nodes, beams, springs=(el.LineSpring("foot", "knee", 1e3, 0.0),))
    push = el.Displacement("top", -np.pi / 2, np.array([1e-3, 5e-3]))
    pair = el.trace(el.Network(nodes, beams, springs=slides), push)
    for outcome in el.trace_many(3 * [zero], push):
        assert outcome.status == "COMPLETE"
        assert outcome.value.effort == pytest.approx(pair.effort[pair.at_requested], rel=1e-6)
