"""Two beams that touch with their sides and ends, in units of L and F0 = EI/L^2.

Numbers are of independent shooting (DOP853); the rest are identities and symmetries.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from contact_paths import (
    DOWN,
    EXACT,
    HALF,
    THIN,
    TIP_LOAD,
    assert_work_is_energy,
    at_drive,
    check_complementarity,
    place_of,
    shoot,
)

import cfmkit.elastica as el
from cfmkit.elastica.contact.sliding import SlidingEquations
from cfmkit.elastica.mechanics.discretise import FlankPlace, discretise
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.results.between_points import interpolate_path

CONTACTS = (
    el.BeamOnBeam("p", "upper", "lower"), el.BeamOnBeam("p", "lower", "upper", leads=False),
    el.NodeOnBeam("p", "tip", "lower", HALF), el.NodeOnBeam("p", "end", "upper", HALF),
)  # fmt: skip
UPPER, LOWER, TIP, END = range(4)  # numbers of these contacts


def end_of_arc(start, angle, bend, length):
    """Return the end of a leaf that begins along an angle and turns by `bend`."""
    chord, direction = length * np.sinc(bend / (2 * np.pi)), angle + bend / 2
    return start[0] + chord * np.cos(direction), start[1] + chord * np.sin(direction)


def two_leaves(upper, lower, soft=1.0):
    """Return two clamped leaves that are arcs, each from start, angle, bend and length, that may touch."""
    nodes = {
        "root": el.Node(*upper[0], el.CLAMPED_SUPPORT), "tip": el.Node(*end_of_arc(*upper)),
        "wall": el.Node(*lower[0], el.CLAMPED_SUPPORT), "end": el.Node(*end_of_arc(*lower)),
    }  # fmt: skip
    section = replace(THIN, youngs_modulus=THIN.youngs_modulus / soft)
    beams = {
        "upper": el.Beam("root", "tip", THIN, el.arc(upper[2])),
        "lower": el.Beam("wall", "end", section, el.arc(lower[2])),
    }
    return el.Network(nodes, beams, contacts=CONTACTS)


def falling_leaf(stiffness=100.0, contacts=CONTACTS):
    """Return a straight leaf that is held at an angle and driven down onto another one."""
    angle = -np.pi / 9
    nodes = {
        "root": el.Node(0, 0.4, el.slider_support(np.pi / 2)), "tip": el.Node(np.cos(angle), 0.4 + np.sin(angle)),
        "wall": el.Node(-0.2, 0, el.CLAMPED_SUPPORT), "end": el.Node(1.5, 0),
    }  # fmt: skip
    stiff = replace(THIN, youngs_modulus=stiffness * THIN.youngs_modulus)
    beams = {"upper": el.Beam("root", "tip", THIN), "lower": el.Beam("wall", "end", stiff)}
    return el.Network(nodes, beams, contacts=contacts)


BULGE = two_leaves(((0, 0.1), -0.4, 1.0, 1.0), ((0, 0), 0.0, 0.0, 1.2))


def check_pair(path):
    """Complementarity, and the shapes say so, too."""
    check_complementarity(path)
    for point in range(len(path)):
        lines = [shapely.LineString(path.shape(name, point)) for name in ("upper", "lower")]
        assert lines[0].distance(lines[1]) > 2 * HALF - 1e-4  # of straight pieces


def test_two_sides_have_the_force_and_the_places_of_shooting_both_ways():
    path = el.trace(BULGE, el.Loading(TIP_LOAD, np.array([0.25, 0.5, 1, 1.5, 2, 1, 0.1])), EXACT)
    begin, end = path.contact_events
    assert (begin.kind, end.kind) == ("begins", "ends")
    assert end.drive == pytest.approx(begin.drive, abs=1e-11)
    point = at_drive(path, 1.5)
    assert path.contact_force(UPPER)[point] == pytest.approx(1.512638757450184, rel=1e-9)
    assert path.contact_places(UPPER)[point, 0] == pytest.approx(0.548962520766503, rel=1e-9)
    assert path.contact_places(LOWER)[point, 0] * 1.2 == pytest.approx(0.527244036459846, rel=1e-9)
    assert place_of(path, "tip", point) == pytest.approx((0.970833589602653, -0.102084153466184), abs=1e-9)
    assert path.contact_force(LOWER) == pytest.approx(path.contact_force(UPPER), abs=1e-12)
    moved = path.motion("end")[path.at_requested]
    assert moved[2] == pytest.approx(moved[5], abs=1e-9)
    assert path.stable.all()
    check_pair(path)


def test_two_sides_that_begin_to_nest_end_the_path_where_shooting_says():
    path = el.trace(BULGE, el.Loading(TIP_LOAD, np.array([1.0, 5.0])), EXACT)
    assert path.status is el.PathStatus.LOST
    assert path.contact_events[-1].kind == "spreads"
    assert path.contact_events[-1].drive == pytest.approx(3.0199, abs=5e-5)
    assert "contact of 'upper' and 'lower' spreads along a length at 3.0199" in path.message


@pytest.mark.parametrize(("bend", "lower", "load"), [(1.3, -0.2, (0.1, -2.5)), (0.9, 0.3, (-0.2, -2.0))])
def test_two_sides_solve_the_equations_of_shooting(bend, lower, load):
    net = two_leaves(((0, 0.15), -0.4, bend, 1.0), ((0, 0), 0.0, lower * 1.2, 1.2))
    path = el.trace(net, el.Loading((el.PointLoad("tip", *load),), np.array([0.5, 1.0])), el.Control(tolerance=1e-10))
    force = path.contact_force(UPPER)[-1]
    places = path.contact_places(UPPER)[-1, 0], path.contact_places(LOWER)[-1, 0] * 1.2
    root, wall = (path.states(name).moment[-1, 0] for name in ("upper", "lower"))
    assert force > 0.05

    def solve(angle):
        normal = np.array([-np.sin(angle), np.cos(angle)])
        return normal, shoot([0, 0, 0, wall], -force * normal, places[1], lower)

    angle = 0.0
    for _ in range(40):  # the normal is that of the place that the force leads to
        angle = solve(angle)[1][2]
    normal, (x, y, _, left) = solve(angle)
    assert left == pytest.approx(0.0, abs=1e-8)
    at = shoot([0, 0.15, -0.4, root], force * normal + load, places[0], bend)
    assert at[2] == pytest.approx(angle, abs=1e-8)
    assert at[:2] == pytest.approx([x, y] + 2 * HALF * normal, abs=1e-8)
    tip = shoot(at, load, 1 - places[0], bend)
    assert (*tip[:2], tip[3]) == pytest.approx((*place_of(path, "tip", -1), 0.0), abs=1e-8)


def test_a_tip_becomes_tangent_and_touches_with_its_side_and_goes_back():
    path = el.trace(
        falling_leaf(), el.Displacement("root", DOWN, np.array([0.1, 0.2, 0.3, 0.34, 0.3, 0.2, 0.02])), EXACT
    )
    kinds, drives = zip(*((event.kind, event.drive) for event in path.contact_events), strict=True)
    assert kinds == ("begins", "moves", "moves", "ends")
    assert drives[:2] == pytest.approx(drives[:1:-1], abs=1e-11)
    efforts = path.effort[path.at_requested]
    assert efforts[:3] == pytest.approx(efforts[[6, 5, 4]] * [0, 1, 1] + [efforts[0], 0, 0], rel=1e-9)
    before, behind = at_drive(path, 0.2), at_drive(path, 0.34)
    assert path.contact_force(TIP)[before] > 0 == path.contact_force(UPPER)[before]
    assert path.contact_force(UPPER)[behind] > 0 == path.contact_force(TIP)[behind]
    check_pair(path)


def test_a_leaf_that_falls_on_a_stiffer_and_stiffer_one_falls_on_a_floor():
    """Of the floor the numbers are those of shooting, `test_elastica_sides.py`."""
    floor = el.line_edge((0, HALF), 0.0)
    alone = (el.NodeOnObstacle("floor", "tip", floor, HALF),)
    drive = el.Displacement("root", DOWN, np.array([0.1, 0.2]))
    known = el.trace(falling_leaf(contacts=alone), drive, EXACT).effort[-1]
    missed = [abs(el.trace(falling_leaf(stiffness), drive, EXACT).effort[-1] / known - 1) for stiffness in (1e3, 1e5)]
    assert missed[1] == pytest.approx(missed[0] / 100, rel=0.05)


def test_the_tangent_of_two_sides_that_touch_is_the_derivative_of_the_residual():
    mesh = discretise(
        BULGE, el.Loading(TIP_LOAD, np.array([1.0])), flanks=[FlankPlace(UPPER, 0.5), FlankPlace(LOWER, 0.4)]
    )
    mesh = replace(mesh, contacts=tuple(contact._replace(closed=True) for contact in mesh.contacts))
    equation = SlidingEquations.from_mesh(mesh, False, equations)
    free = 0.02 * np.random.default_rng(2).normal(size=equation.n)
    for contact, place in zip(mesh.contacts, (0.5, 0.4), strict=True):
        free[equation.slots[[contact.slide, contact.unknown, contact.flag]]] = place, 0.7, 0
    at, step = equation.linearise(free, 0.7), 1e-6
    sides = ([equation.linearise(free + sign * step * unit, 0.7).residual for unit in np.eye(equation.n)]
             for sign in (1, -1))  # fmt: skip
    slopes = np.subtract(*map(np.array, sides)).T / (2 * step)
    assert slopes == pytest.approx(at.tangent, abs=1e-5)


def layout(seed):
    """Return two leaves of random shapes, lengths and stiffness, and a load out and back."""
    rng = np.random.default_rng(seed)
    bends, lengths = rng.uniform((-0.8, -0.8), (1.2, 0.5)), rng.uniform((0.7, 0.9), (1.3, 1.5))
    angles = rng.uniform((-0.5, -0.1), (0.1, 0.1))
    start = rng.uniform((-0.2, 0.08), (0.3, 0.3))
    net = two_leaves(
        (start, angles[0], bends[0], lengths[0]), ((0, 0), angles[1], bends[1], lengths[1]), 10 ** rng.uniform(-1, 0.5)
    )
    up = np.linspace(0, 1, 7)[1:] * rng.uniform(1, 4)
    load = el.PointLoad("tip", 0.2 * rng.normal(), -1.0), el.PointLoad("end", 0.0, 0.3 * rng.normal())
    return net, el.Loading(load, np.concatenate([up, up[-2::-1], [0.0]]))


@pytest.mark.slow  # seconds each
@pytest.mark.parametrize("seed", [4, 9, 10, 21, 23, 27])
def test_a_random_pair_returns_to_its_own_points_and_keeps_every_condition(seed):
    path = el.trace(*layout(seed), el.Control(tolerance=1e-8))
    assert path.status is el.PathStatus.COMPLETE
    assert path.contact_events
    check_pair(path)
    moved = np.stack([path.motion(node)[path.at_requested] for node in ("tip", "end")])
    assert moved[:, :5] == pytest.approx(moved[:, 10:5:-1], abs=1e-9)


def test_stability_changes_with_two_sides_that_touch_where_the_load_has_its_limit():
    """The side of a stiff leaf on a slide presses an arch through: stability changes at the limit of the load."""
    upper = (0.55, 0.62), -1.3, 2.6, 1.0
    nodes = {
        "root": el.Node(*upper[0], el.slider_support(np.pi / 2)), "tip": el.Node(*end_of_arc(*upper)),
        "wall": el.Node(0.5, 0, el.CLAMPED_SUPPORT), "end": el.Node(1.5, 0, el.CLAMPED_SUPPORT),
    }  # fmt: skip
    stiff = replace(THIN, youngs_modulus=30 * THIN.youngs_modulus)
    beams = {"upper": el.Beam("root", "tip", stiff, el.arc(2.6)), "lower": el.Beam("wall", "end", THIN, el.arc(-1.2))}
    guide = el.SlideSpring("root", np.pi / 2, 1.0)
    net = el.Network(nodes, beams, springs=(guide,), contacts=CONTACTS[:3])
    drive = el.Loading((el.PointLoad("root", 0.0, -1.0),), np.array([30.0]))
    path = el.trace(net, drive, el.Control(tolerance=1e-8, through_folds=True))
    (limit,) = path.events
    assert (limit.kind, limit.before, limit.after) == ("limit point", 0, 1)
    pressing = path.contact_force(UPPER) > 0
    grows = np.diff(path.drive) > 0
    inner = pressing[1:] & pressing[:-1] & (path.unstable[1:] == path.unstable[:-1])
    assert (grows[inner] == (path.unstable[1:][inner] == 0)).all()
    assert set(path.unstable[pressing]) == {0, 1}


def test_between_points_two_sides_touch_as_at_them():
    drive = el.Displacement("tip", DOWN, np.array([0.1, 0.2, 0.3]))
    between = interpolate_path(el.trace(BULGE, drive, EXACT)).solve_at(np.array([0.25]))
    known = el.trace(BULGE, replace(drive, points=np.array([0.1, 0.25])), EXACT)
    assert between.contact_force(UPPER)[0] == pytest.approx(known.contact_force(UPPER)[-1], rel=1e-9)
    assert known.contact_force(UPPER)[-1] > 0.1


def test_the_work_of_the_drive_is_the_energy_of_two_leaves_that_shear():
    """So the tangent of both where they touch is the right one."""
    depth = 1 / 12
    section = el.Section(12 / depth**3, 1.0, depth, axial=True, shear=True)
    beams = {name: replace(beam, section=section) for name, beam in BULGE.beams.items()}
    nodes = BULGE.nodes | {
        "root": el.Node(0, 0.1 + depth, el.CLAMPED_SUPPORT),
        "tip": replace(BULGE.nodes["tip"], y=BULGE.nodes["tip"].y + depth),
    }
    assert_work_is_energy(replace(BULGE, nodes=nodes, beams=beams), "tip", 0.1, 0.3)
