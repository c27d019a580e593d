"""Sides of beams that touch obstacles, at places that are unknowns, in units of L and F0 = EI/L^2.

The numbers are of independent shooting (DOP853 between 1e-11 and 2e-14) and closed forms (mpmath); see docs/contact.md.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from contact_layouts import among_discs
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
    residual_slopes,
)

import cfmkit.elastica as el
from cfmkit.elastica.mechanics.compiled_module import WITHOUT_C_VARIABLE
from cfmkit.elastica.mechanics.discretise import FlankPlace, discretise
from cfmkit.elastica.mechanics.march import equations


def leaf(*contacts, support=el.CLAMPED_SUPPORT, at=(0.0, 0.0), angle=0.0, section=THIN):
    """Return a straight leaf of length 1 from `root` to `tip`."""
    end = at[0] + np.cos(angle), at[1] + np.sin(angle)
    nodes = {"root": el.Node(*at, support), "tip": el.Node(*end)}
    return el.Network(nodes, {"leaf": el.Beam("root", "tip", section)}, contacts=contacts)


def side(name, outline, beam="leaf"):
    return el.BeamOnObstacle(name, beam, outline)


ROUND = 0.05 - HALF
APEX = -0.1 + np.sqrt(2) * ROUND  # of a roof whose ridge is rounded about (0.5, -0.1)
PINS = {
    "disc": el.circle_edge((0.5, -0.1), ROUND),
    "fillet": el.polyline_edge([(-0.5, APEX - 1), (0.5, APEX), (1.5, APEX - 1)], ROUND),
}


@pytest.mark.parametrize("pin", PINS)
def test_a_pin_under_a_leaf_has_the_force_and_the_place_of_shooting_both_ways(pin):
    path = el.trace(leaf(side("pin", PINS[pin])), el.Loading(TIP_LOAD, np.array([0.25, 0.5, 1, 2, 3, 1, 0.4])), EXACT)
    begin, end = path.contact_events
    assert (begin.kind, end.kind) == ("begins", "ends")
    assert begin.drive == pytest.approx(0.476636638220007, abs=1e-11)
    assert end.drive == pytest.approx(begin.drive, abs=1e-11)
    known = {1.0: (1.224370708397327, 0.513876161308937), 3.0: (5.552993116405933, 0.520254278889554)}
    for load, (force, place) in known.items():
        point = at_drive(path, load)
        assert path.contact_force(0)[point] == pytest.approx(force, rel=1e-10)
        assert path.contact_places(0)[point] == pytest.approx([place, place], rel=1e-10)
    assert place_of(path, "tip", at_drive(path, 3.0)) == pytest.approx(
        (0.932836562878431, -0.285087474732345), abs=1e-10
    )
    assert path.stable.all()
    check_complementarity(path)


def test_a_tip_on_a_floor_becomes_tangent_and_lies_flank_on_and_goes_back():
    floor = el.line_edge((0, -HALF), 0.0)
    net = leaf(el.NodeOnObstacle("floor", "tip", floor, HALF), side("floor", floor),
               support=el.slider_support(np.pi / 2), at=(0.0, 0.4), angle=-np.pi / 9)  # fmt: skip
    path = el.trace(net, el.Displacement("root", DOWN, np.array([0.1, 0.2, 0.25, 0.3, 0.25, 0.1, 0.05])), EXACT)
    known = [0.13898439286123, 0.448837794092424, 0.598397552260931, 0.936966252247794, 0.598397552260931]
    assert path.effort[path.at_requested] == pytest.approx([*known, known[0], 0.0], rel=1e-10, abs=1e-12)
    kinds, drives = zip(*((event.kind, event.drive) for event in path.contact_events), strict=True)
    assert kinds == ("begins", "moves", "moves", "ends")
    tangent, begin = 0.284386717407804, 0.4 - np.sin(np.pi / 9)
    assert drives == pytest.approx([begin, tangent, tangent, begin], abs=1e-11)
    assert path.contact_places(1)[at_drive(path, 0.3)][0] == pytest.approx(0.864952518930985, rel=1e-9)
    check_complementarity(path)


def test_a_tip_on_a_floor_that_stretches_has_the_forces_of_shooting():
    floor = el.line_edge((0, -0.025), 0.0)
    section = el.Section(12 / 0.05**3, 1.0, 0.05, axial=True, shear=False)
    net = leaf(el.NodeOnObstacle("floor", "tip", floor, 0.025), side("floor", floor),
               support=el.slider_support(np.pi / 2), at=(0.0, 0.4), angle=-np.pi / 9, section=section)  # fmt: skip
    path = el.trace(net, el.Displacement("root", DOWN, np.array([0.1, 0.3])), EXACT)
    assert path.effort[path.at_requested] == pytest.approx([0.13897712353818, 0.936909515319372], rel=1e-9)
    assert path.contact_places(1)[-1, 0] == pytest.approx(0.864983588188324, rel=1e-9)


@pytest.mark.parametrize(
    ("radius", "onset", "known"),
    [
        (1.0, 1.06723164373704953, {
            2.0: (0.39524362684601514, (0.88503304412791888, -0.41321894597679186)),
            4.0: (0.65267151409608263, (0.85731099269312176, -0.44602151849218636)),
            8.0: (0.80612051212628843, (0.84660682986180773, -0.45579885195620522)),
        }),
        (0.5, 2.54509723698775048, {4.0: (0.1998403214625088, (None, -0.64299750901244334))}),
    ],
)  # fmt: skip
@pytest.mark.parametrize("is_arc", [False, True])
def test_a_leaf_wraps_around_a_disc_as_the_closed_form_says(radius, onset, known, is_arc):
    """An arc begins where the leaf is clamped; before it its edge is straight."""
    drive = el.Loading(TIP_LOAD, np.array([1.0, 2, 4, 8, 4, 2, 0.5]))
    centre = (0, -radius), radius - HALF
    drum = el.arc_edge(*centre, 0.5 * np.pi, -0.5) if is_arc else el.circle_edge(*centre)
    path = el.trace(leaf(side("drum", drum)), drive, EXACT)
    assert path.status is el.PathStatus.COMPLETE
    kinds, drives = zip(*((event.kind, event.drive) for event in path.contact_events), strict=True)
    assert kinds == ("spreads", "closes")
    assert drives == pytest.approx([onset, onset], rel=1e-9)
    for load, (wrapped, tip) in known.items():
        point = at_drive(path, load)
        assert path.contact_places(0)[point] == pytest.approx([0.0, wrapped], rel=1e-10)
        if tip[0] is not None:
            assert place_of(path, "tip", point)[0] == pytest.approx(tip[0], abs=1e-10)
        assert place_of(path, "tip", point)[1] == pytest.approx(tip[1], abs=1e-10)
    bent = path.states("leaf").moment[at_drive(path, 4.0), :5]
    assert bent == pytest.approx(np.full(5, -1 / radius), rel=1e-9)  # along the drum it has its curvature


def test_a_leaf_wraps_around_a_disc_without_compiled_code(monkeypatch):
    monkeypatch.setenv(WITHOUT_C_VARIABLE, "1")
    path = el.trace(
        leaf(side("drum", el.circle_edge((0, -0.5), 0.5 - HALF))), el.Loading(TIP_LOAD, np.array([2.0, 4.0])), EXACT
    )
    assert path.contact_places(0)[-1] == pytest.approx([0.0, 0.1998403214625088], rel=1e-10)


def press_column_between_walls(*loads):
    """Return the path of a pinned column between two walls at loads over that of Euler, and that load."""
    walls = side("top", el.line_edge((0, 0.05 + HALF), np.pi)), side("bottom", el.line_edge((0, -0.05 - HALF), 0.0))
    nodes = {"root": el.Node(0, 0, el.Support(True, True, False)), "tip": el.Node(1, 0, el.Support(False, True, False))}
    net = el.Network(nodes, {"leaf": el.Beam("root", "tip", THIN)}, contacts=walls)
    return el.trace(net, el.Loading((el.PointLoad("tip", -1.0),), np.pi**2 * np.array(loads)), EXACT), np.pi**2


def test_two_ends_of_a_piece_that_lies_on_a_wall_join_where_they_parted():
    """Loaded and unloaded, a column has the same states on both ways, and is straight again."""
    path, euler = press_column_between_walls(0.5, 1.001, 3.0, 5.0, 3.0, 1.001, 0.5)
    kinds, drives = zip(*((event.kind, event.drive / euler) for event in path.contact_events), strict=True)
    assert path.status is el.PathStatus.COMPLETE
    assert kinds == ("begins", "spreads", "closes", "ends")
    assert drives[2:] == pytest.approx(drives[1::-1], rel=1e-8)
    energy, pushed = path.energy[path.at_requested], path.motion("tip")[path.at_requested, 0]
    assert energy == pytest.approx(energy[::-1], rel=1e-9, abs=1e-12)
    assert pushed == pytest.approx(pushed[::-1], rel=1e-9, abs=1e-12)


def test_a_pinned_column_between_walls_touches_lies_flat_and_buckles_again():
    path, euler = press_column_between_walls(0.5, 1.001, 2.0, 3.0, 3.9, 5.0, 8.0, 12.0, 15.0, 16.0)
    first, flat = (event.drive / euler for event in path.contact_events)
    assert first == pytest.approx(1.00310705881604, abs=1e-9)
    assert flat == pytest.approx(3.984869364316, abs=1e-7)
    assert path.events[-1].drive / euler == pytest.approx(15.8743698018842, abs=1e-7)
    assert path.status is el.PathStatus.JUMPS
    assert "buckles away" in path.message


def test_a_ring_between_plates_has_the_forces_of_shooting_and_lies_flat():
    nodes = {"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "tip": el.Node(1, 1, el.Support(False, False, True))}
    net = el.Network(
        nodes,
        {"leaf": el.Beam("root", "tip", THIN, el.arc(np.pi / 2))},
        contacts=(side("floor", el.line_edge((0, -HALF), 0)),),
    )
    path = el.trace(net, el.Displacement("tip", DOWN, np.array([0.1, 0.2, 0.35, 0.4, 0.5, 0.35, 0.1])), EXACT)
    known = [0.587165757200244, 1.057650189060502, 1.698863931470137, 1.993805586239256, 2.871080044184531]
    assert path.effort[path.at_requested] == pytest.approx([*known, known[2], known[0]], rel=1e-10)
    flat = [path.contact_places(0)[at_drive(path, drive), 1] * np.pi / 2 for drive in (0.35, 0.4, 0.5)]
    assert flat == pytest.approx([0.148310576897689, 0.257732557659012, 0.476576519181660], rel=1e-9)
    assert path.contact_events[0].drive == pytest.approx(1 - 0.7177700110461, abs=1e-7)


def test_a_snap_is_caught_by_a_disc_where_the_path_becomes_stable_again():
    held = el.Support(True, True, True, displacement=(-0.02, 0, 0))
    nodes = {"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "mid": el.Node(0.5, 0), "tip": el.Node(1, 0, held)}
    beams = {"leaf": el.Beam("root", "mid", THIN), "other": el.Beam("mid", "tip", THIN)}
    net = el.Network(nodes, beams, contacts=(side("pin", el.circle_edge((0.25, -0.07), 0.05 - HALF)),))
    drive = el.Loading((el.PointLoad("mid", 0, -1.0, 0.02),), np.array([2.0, 10, 20]))
    path = el.trace(net, drive, replace(EXACT, through_folds=True, sign=-1))
    (begin,) = path.contact_events
    assert begin.drive == pytest.approx(7.04366432533202, abs=1e-9)
    assert (begin.before, begin.after) == (1, 0)
    limits = [event.drive for event in path.events if event.kind == "limit point"]
    assert limits == pytest.approx([14.40636701968, begin.drive, 11.12776960427], abs=1e-8)


def test_a_compressed_leaf_between_arcs_touches_at_a_point_and_does_not_lie_where_it_would_be_pulled():
    net = leaf(side("low", el.circle_edge((0, -1.0), 1 - HALF)), side("up", el.circle_edge((0, 1.0), 1 - HALF)))
    net = replace(net, loads=(el.PointLoad("tip", -0.95 * np.pi**2 / 4, 0.0),))
    path = el.trace(net, el.Displacement("tip", DOWN, np.array([0.05, 0.2, 0.3, 0.4, 0.43, 0.45])), EXACT)
    known = [
        0.007735992349689,
        0.039352758581935,
        0.078266985739326,
        0.195876053911287,
        0.619199645915576,
        2.353162735807857,
    ]
    assert path.effort[path.at_requested] == pytest.approx(known, rel=1e-9)
    assert path.contact_events[0].drive == pytest.approx(0.3770120208, abs=1e-8)
    places = [path.contact_places(0)[at_drive(path, drive)] for drive in (0.4, 0.43, 0.45)]
    assert places == pytest.approx(
        np.repeat([[0.254452975264562], [0.501362191006068], [0.702146185556468]], 2, axis=1), rel=1e-9
    )


def test_a_small_disc_beside_the_way_of_a_leaf_is_found():
    """The leaf sweeps over a pin that is a fortieth of the way of its middle."""
    net = leaf(side("pin", el.circle_edge((0.6, -0.12), 0.01)))
    path = el.trace(net, el.Loading(TIP_LOAD, np.array([4.0])), EXACT)
    assert path.contact_events[0].kind == "begins"
    assert path.contact_gap(0).min() > -1e-10
    assert path.contact_places(0)[-1, 0] == pytest.approx(0.6, abs=0.05)


def test_a_leaf_that_cannot_lie_on_a_disc_ends_with_the_reason():
    section = replace(THIN, axial=True, shear=True)
    net = leaf(side("drum", el.circle_edge((0, -1.0), 1 - HALF)), section=section)
    path = el.trace(net, el.Loading(TIP_LOAD, np.array([0.5, 4.0])), EXACT)
    assert path.status is el.PathStatus.LOST
    assert "begins to lie on it along a length" in path.message
    assert "shear" in path.message


@pytest.mark.slow  # 200 layouts, a tenth of a second each
@pytest.mark.parametrize("first", range(0, 200, 50))
def test_random_layouts_of_discs_return_to_their_own_points_and_keep_every_condition(first):
    for seed in range(first, first + 50):
        path = el.trace(*among_discs(seed), el.Control(tolerance=1e-8))
        assert path.status is el.PathStatus.COMPLETE, seed
        check_complementarity(path)
        moved = path.motion("tip")[path.at_requested]
        assert moved[:5] == pytest.approx(moved[10:5:-1], abs=1e-9), seed


def test_the_tangent_of_a_side_that_lies_and_one_that_touches_is_the_derivative_of_the_residual():
    net = leaf(side("drum", el.circle_edge((0, -1.0), 1 - HALF)), side("pin", el.circle_edge((0.7, -0.4), 0.1)))
    mesh = discretise(net, el.Loading(TIP_LOAD, np.array([1.0])), flanks=[FlankPlace(0, 0.3, -1), FlankPlace(1, 0.6)])
    mesh = replace(mesh, contacts=tuple(one._replace(closed=True) for one in mesh.contacts))
    own = equations(mesh)
    free = 0.1 * np.random.default_rng(0).normal(size=own.n)
    for one, place, force, flag in zip(mesh.contacts, (0.3, 0.6), (0.7, 0.4), (-1, 0), strict=True):
        free[own.slots[[one.slide, one.unknown, one.flag]]] = place, force, flag
    at, slopes = own.linearise(free, 0.7), residual_slopes(own, free, 0.7)
    drum = mesh.contacts[0]
    near = np.ones(own.n, bool)
    near[own.slots[mesh.elements.unknowns[0, -2]]] = False  # its curvature is that of the closed gap: exact there
    assert slopes[near] == pytest.approx(at.tangent[near], abs=1e-6)
    assert drum.laid == -1


@pytest.mark.parametrize("with_pad", [False, True])
def test_a_leaf_parallel_to_a_floor_ends_with_the_reason(with_pad):
    floor = el.line_edge((0, -HALF), 0.0)
    pads = (el.NodeOnObstacle("floor", "tip", floor, HALF),) if with_pad else ()
    net = leaf(*pads, side("floor", floor), support=el.slider_support(np.pi / 2), at=(0.0, 0.1))
    path = el.trace(net, el.Displacement("root", DOWN, np.array([0.05, 0.2])), EXACT)
    assert path.status is el.PathStatus.LOST
    assert path.message == "beam 'leaf' on 'floor' is met along the whole length at 0.1: no place touches first"


def test_a_constant_load_may_close_a_contact_of_a_side_before_the_drive_moves():
    net = replace(leaf(side("pin", PINS["disc"])), loads=(el.PointLoad("tip", 0.0, -1.0),))
    path = el.trace(net, el.Loading((el.PointLoad("tip", 0.0, -1.0),), np.array([0.0, 2.0])), EXACT)
    assert path.contact_force(0)[[0, -1]] == pytest.approx([1.224370708397327, 5.552993116405933], rel=1e-9)


def soft(slenderness, thickness=None):
    """Return a section with EI = 1 that stretches and shears, of a leaf so many times as long as thick."""
    depth = 1 / slenderness
    return el.Section(
        12 / depth**3, 1.0, depth if thickness is None else thickness, axial=True, shear=thickness is None
    )


def over_disc(slenderness, radius):
    depth = 1 / slenderness
    return leaf(side("pin", el.circle_edge((0.5, -0.05 - radius - depth / 2), radius)), section=soft(slenderness))


@pytest.mark.parametrize(
    ("slenderness", "radius", "load", "known", "spread"),
    [
        (33, 0.2, 1.0, (1.185860383930162, 0.548488701863892, 0.979147598084910, -0.177196002373683),
         (1.185860434267, -0.177195997271, 1e-7)),
        (33, 0.02, 2.0, (3.477650859049060, 0.513253097657913, 0.955154153270219, -0.243840724901431),
         (3.477650939269, -0.243840718027, 1e-7)),
        (10, 0.02, 2.0, (3.377557632970865, 0.522620173756264, 0.955618763375700, -0.243432859307856),
         (3.377575227244, -0.243431335213, 2e-5)),
    ],
)  # fmt: skip
def test_a_leaf_that_shears_has_the_force_and_the_place_of_shooting(slenderness, radius, load, known, spread):
    """`spread` is of shooting with the force spread over the length along which the leaf follows the disc."""
    path = el.trace(over_disc(slenderness, radius), el.Loading(TIP_LOAD, np.array([0.5, load])), EXACT)
    force, place, tip = path.contact_force(0)[-1], path.contact_places(0)[-1, 0], place_of(path, "tip", -1)
    assert (force, place, *tip) == pytest.approx(known, abs=1e-10)
    assert (force, tip[1]) == pytest.approx(spread[:2], abs=spread[2])
    check_complementarity(path)


def falling(slenderness, flips=False):
    """Return a leaf that shears, falls on a floor with its tip, and touches it with its side after that."""
    floor, depth, angle = el.line_edge((0, -0.5 / slenderness), 0.0), 1 / slenderness, -np.pi / 9
    pads = el.NodeOnObstacle("floor", "tip", floor, depth / 2), side("floor", floor)
    net = leaf(*pads, support=el.slider_support(np.pi / 2), at=(0.0, 0.4), angle=angle, section=soft(slenderness))
    return replace(net, beams={"leaf": el.Beam("tip", "root", soft(slenderness))}) if flips else net


STRETCHING = el.Taper(np.array([0, 0.4, 1.0]), np.array([0.065, 0.05, 0.03]))
TAPERED = leaf(side("pin", el.circle_edge((0.6, -0.275), 0.2)), section=soft(20, STRETCHING))


@pytest.mark.parametrize(
    ("net", "node", "begin", "end"),
    [
        (over_disc(10, 0.2), "tip", 0.15, 0.35), (falling(10), "root", 0.1, 0.28), (falling(10), "root", 0.29, 0.32),
        (falling(33, flips=True), "root", 0.29, 0.32), (TAPERED, "tip", 0.15, 0.3),
    ],
)  # fmt: skip
def test_the_work_of_the_drive_is_the_energy_of_a_leaf_that_shears_or_stretches(net, node, begin, end):
    """Nothing works at the contact, wherever it slides: so the tangent there is the right one."""
    assert_work_is_energy(net, node, begin, end)
