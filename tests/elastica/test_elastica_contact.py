"""Stops and obstacles of nodes in beam networks, in units of L and F0 = EI/L^2.

The numbers are of independent shooting (DOP853, mpmath) and closed forms; see docs/contact.md.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from contact_layouts import with_pads
from contact_paths import DOWN, EXACT, SECTION, TIP_LOAD, place_of, residual_slopes, shoot

import cfmkit.elastica as el
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.results.between_points import interpolate_path


def cantilever(*contacts, nodes=2, support=el.CLAMPED_SUPPORT, y=0.0, angle=0.0):
    """Return a straight cantilever of length 1 with even nodes; the last one is `tip`, the middle one `mid`."""
    names = ["root", *(f"n{k}" for k in range(1, nodes - 1)), "tip"]
    if nodes == 3:
        names[1] = "mid"
    way = np.array([np.cos(angle), np.sin(angle)])
    places = [(k * way / (nodes - 1) + (0.0, y)).tolist() for k in range(nodes)]
    made = {
        name: el.Node(*at, support if name == "root" else el.Support()) for name, at in zip(names, places, strict=True)
    }
    beams = {f"b{k}": el.Beam(names[k], names[k + 1], SECTION) for k in range(nodes - 1)}
    return el.Network(made, beams, contacts=contacts)


def conditions(path):
    """Return the gaps (what an elastic contact yields put back) and forces of all contacts, (contacts, n) each."""
    force = np.array([path.contact_force(k) for k in range(len(path.network.contacts))])
    gap = np.array([path.contact_gap(k) for k in range(len(path.network.contacts))])
    yields = np.array([1.0 / one.stiffness for one in path.network.contacts])[:, None]
    return gap + yields * force, force


@pytest.mark.parametrize(
    ("stiffness", "force", "tip"),
    [
        (np.inf, 3.550103312597306, (0.952410116982856, -0.251364358585010)),
        (200.0, 3.119493740615104, (0.941218822519390, -0.286036662643615)),
    ],
)
def test_a_stop_at_half_length_carries_what_shooting_says(stiffness, force, tip):
    path = el.trace(
        cantilever(el.Stop("s", "mid", 0.05, DOWN, stiffness=stiffness), nodes=3),
        el.Loading(TIP_LOAD, np.linspace(0, 2, 9)), EXACT,
    )  # fmt: skip
    (event,) = path.contact_events
    assert event.drive == pytest.approx(0.490235784722785, rel=1e-10)
    assert path.contact_force(0)[-1] == pytest.approx(force, rel=1e-10)
    assert place_of(path, "tip", -1) == pytest.approx(tip, rel=1e-10)


@pytest.mark.parametrize(
    ("stiffness", "moment", "tip"),
    [
        (np.inf, 1.0, (0.738460262604129, 0.525840118220962)),
        (5.0, 5 / 7, (0.665225899943420, 0.591447507226027)),
    ],
)
def test_a_rotational_stop_has_the_moment_of_the_closed_form(stiffness, moment, tip):
    path = el.trace(
        cantilever(el.Stop("s", "mid", 0.5, None, stiffness=stiffness), nodes=3),
        el.Loading((el.PointLoad("tip", moment=1.0),), np.linspace(0, 2, 9)), EXACT,
    )  # fmt: skip
    assert path.contact_events[0].drive == pytest.approx(1.0, rel=1e-12)
    assert path.contact_force(0)[-1] == pytest.approx(moment, rel=1e-12)
    assert place_of(path, "tip", -1) == pytest.approx(tip, rel=1e-12)


def test_a_stop_with_two_sides_is_met_loading_and_unloading():
    net = cantilever(
        el.Stop("up", "tip", 0.05, np.pi / 2), el.Stop("down", "tip", 0.08, DOWN), support=el.slider_support(np.pi / 2)
    )
    drive = el.Displacement("root", np.pi / 2, np.array([0.1, 0.3, 0.1, -0.1, -0.3, -0.1, 0.1, 0.3]))
    path = el.trace(net, drive, EXACT)
    known = [0.150386839128421, 0.802004737723027, 0.150386839128421, -0.060024697203493, -0.694820851406546]
    assert path.effort[path.at_requested] == pytest.approx([*known, *known[3:4], *known[:2]], rel=1e-10)
    changes = [(event.kind, event.number, round(event.drive, 10)) for event in path.contact_events]
    assert changes == [
        ("begins", 0, 0.05), ("ends", 0, 0.05), ("begins", 1, -0.08), ("ends", 1, -0.08), ("begins", 0, 0.05)
    ]  # fmt: skip


def test_a_tip_that_meets_the_floor_has_the_forces_of_shooting_both_ways():
    floor = el.NodeOnObstacle("floor", "tip", el.line_edge((0, 0), 0.0))
    net = cantilever(floor, support=el.slider_support(np.pi / 2), y=0.4, angle=-np.pi / 9)
    path = el.trace(net, el.Displacement("root", DOWN, np.array([0.1, 0.15, 0.2, 0.25, 0.2, 0.15, 0.1, 0.05])), EXACT)
    known = [0.13898439286123, 0.296609798575910, 0.448837794092424, 0.598397552260931]
    assert path.effort[path.at_requested] == pytest.approx([*known, *known[2::-1], 0.0], rel=1e-10, abs=1e-12)
    begin, end = (event.drive for event in path.contact_events)
    assert begin == pytest.approx(0.4 - np.sin(np.pi / 9), rel=1e-11)
    assert end == pytest.approx(begin, rel=1e-11)


def test_a_tip_in_a_hole_has_the_force_of_shooting():
    net = cantilever(el.NodeOnObstacle("bore", "tip", el.circle_edge((0.7, 0.0), 0.45, hole=True)))
    path = el.trace(net, el.Loading((el.PointLoad("tip", 0.0, 1.0),), np.linspace(0, 3, 9)), EXACT)
    assert path.contact_events[0].drive == pytest.approx(1.471370651062744, rel=1e-10)
    assert path.contact_force(0)[-1] == pytest.approx(2.297191287588976, rel=1e-10)
    assert place_of(path, "tip", -1) == pytest.approx((0.893338995154815, 0.406349643721422), rel=1e-10)


@pytest.mark.parametrize(
    ("curvature", "centre", "radius", "load"),
    [(0.3, (1.0, -0.25), 0.2, (0.4, -2.0)), (-0.2, (0.95, -0.3), 0.1, (0.0, -3.0)), (0.5, (0.9, -0.5), 0.3, (1, -5.0))],
)
def test_a_curved_leaf_on_a_disc_solves_the_equations_of_shooting(curvature, centre, radius, load):
    end = np.sin(curvature) / curvature, (1 - np.cos(curvature)) / curvature
    nodes = {"root": el.Node(0, 0, el.CLAMPED_SUPPORT), "tip": el.Node(*end)}
    pad = el.NodeOnObstacle("disc", "tip", el.circle_edge(centre, radius - 0.03), 0.03)
    net = el.Network(nodes, {"leaf": el.Beam("root", "tip", SECTION, el.arc(curvature))}, contacts=(pad,))
    path = el.trace(net, el.Loading((el.PointLoad("tip", *load),), np.array([0.5, 1.0])), el.Control(tolerance=1e-10))
    force, normal = path.contact_force(0)[-1], (place_of(path, "tip", -1) - centre) / radius
    whole = np.array(load) + force * normal
    moment = path.states("leaf").moment[-1, 0]
    x, y, turn, left = shoot([0, 0, 0, moment], whole, 1.0, curvature)
    assert force > 0.1
    assert (x, y) == pytest.approx(place_of(path, "tip", -1), abs=1e-9)
    assert turn == pytest.approx(path.motion("tip")[-1, 2] + curvature, abs=1e-9)
    assert left == pytest.approx(0.0, abs=1e-9)
    assert np.hypot(*(place_of(path, "tip", -1) - centre)) == pytest.approx(radius, rel=1e-11)


@pytest.mark.parametrize("seed", range(12))
def test_a_random_layout_returns_to_its_own_points_and_keeps_every_condition(seed):
    path = el.trace(*with_pads(seed), el.Control(tolerance=1e-8))
    assert path.status is el.PathStatus.COMPLETE
    gap, force = conditions(path)
    largest = max(1.0, force.max())
    assert gap.min() > -1e-9
    assert force.min() > -1e-9 * largest
    assert np.minimum(gap, force / largest).max() < 1e-9
    assert np.abs(path.residual[:, path.mesh.free]).max() < 1e-8 * largest
    moved = np.array([path.motion(node) for node in path.network.nodes])[:, path.at_requested]
    assert moved[:, :7] == pytest.approx(moved[:, 14:7:-1], abs=1e-9)


def test_the_work_of_the_drive_is_the_energy_of_beams_and_of_an_elastic_stop():
    bumper = el.Stop("bumper", "tip", 0.05, np.pi / 2, stiffness=20.0)
    disc = el.NodeOnObstacle("disc", "mid", el.circle_edge((0.5, 0.2), 0.15))
    net = cantilever(bumper, disc, nodes=3, support=el.slider_support(np.pi / 2))
    path = el.trace(net, el.Displacement("root", np.pi / 2, np.linspace(0, 0.3, 13)), EXACT)
    law = interpolate_path(path)
    assert {event.number for event in path.contact_events} == {0, 1}
    marks, work = [0.0, *law.corners.tolist(), 0.3], 0.0
    nodes, weights = np.polynomial.legendre.leggauss(12)
    shares, weights = 0.5 * (1 + nodes), 0.5 * weights
    for low, high in itertools.pairwise(marks):
        work += (high - low) * float(weights @ law.effort("", low + (high - low) * shares))
    assert work == pytest.approx(path.energy[-1], rel=1e-9)


def test_the_curve_between_points_has_a_corner_where_a_contact_begins():
    net = cantilever(
        el.NodeOnObstacle("floor", "tip", el.line_edge((0, -0.06), 0.0)), support=el.slider_support(np.pi / 2)
    )
    law = interpolate_path(el.trace(net, el.Displacement("root", DOWN, np.linspace(0, 0.25, 11)), EXACT))
    assert law.corners == pytest.approx([0.06], rel=1e-11)
    for place in (0.02, 0.0599, 0.0601, 0.1):
        alone = el.trace(net, el.Displacement("root", DOWN, np.array([place])), EXACT)
        assert law.effort("", np.array([place]))[0] == pytest.approx(alone.effort[-1], abs=1e-12)


def test_a_small_obstacle_is_not_stepped_over():
    """The tip moves by 25 times its radius from one requested point to the next."""
    net = cantilever(el.NodeOnObstacle("pin", "tip", el.circle_edge((0.965, -0.3), 0.027)))
    path = el.trace(net, el.Loading(TIP_LOAD, np.array([0.0, 4.0])), EXACT)
    begin = path.contact_events[0]
    assert begin.kind == "begins"
    gap, _ = conditions(path)
    assert gap.min() > -1e-11
    free = el.trace(cantilever(), el.Loading(TIP_LOAD, np.array([begin.drive])), EXACT)
    assert np.hypot(*(place_of(free, "tip", -1) - (0.965, -0.3))) == pytest.approx(0.027, abs=1e-9)


def test_a_rigid_stop_on_the_driven_node_blocks_the_drive():
    path = el.trace(
        cantilever(el.Stop("end", "tip", 0.1, DOWN)), el.Displacement("tip", DOWN, np.array([0.05, 0.2])), EXACT
    )
    assert path.status is el.PathStatus.BLOCKED
    assert path.message == "the drive is blocked by stop 'end' at 0.1"
    assert path.drive[-1] == pytest.approx(0.1, rel=1e-12)
    assert path.stable.all()


def test_an_elastic_stop_on_the_driven_node_adds_its_force():
    net = cantilever(el.Stop("end", "tip", 0.1, DOWN, stiffness=50.0))
    path = el.trace(net, el.Displacement("tip", DOWN, np.array([0.05, 0.2])), EXACT)
    free = el.trace(cantilever(), el.Displacement("tip", DOWN, np.array([0.05, 0.2])), EXACT)
    assert path.effort[-1] == pytest.approx(free.effort[-1] + 50.0 * 0.1, rel=1e-10)
    assert path.contact_force(0)[-1] == pytest.approx(5.0, rel=1e-12)


def test_a_contact_that_ends_into_a_snap_is_a_limit_point_and_is_followed_by_the_arc_length():
    """An oblique stop pushes the tip outwards until it slips off."""
    net = cantilever(el.Stop("s", "tip", 0.184, -1.39, stiffness=3200.0), nodes=3)
    drive = el.Displacement("tip", DOWN, np.linspace(0.0, 0.4, 9))
    ended = el.trace(net, drive, EXACT)
    assert ended.status is el.PathStatus.LIMIT_POINT
    assert "stop 's' ends" in ended.message
    assert ended.stable.all()
    whole = el.trace(net, drive, replace(EXACT, through_folds=True, largest_turn=0.07))
    kinks = [event for event in whole.events if event.kind == "limit point"]
    assert kinks[0].drive == pytest.approx(ended.contact_events[-1].drive, rel=1e-9)
    assert (kinks[0].before, kinks[0].after) == (0, 1)
    assert whole.unstable[-1] == 1
    gap, force = conditions(whole)
    assert gap.min() > -1e-9
    assert force.min() > -1e-9 * force.max()


def test_a_contact_that_is_never_reached_changes_nothing():
    drive = el.Displacement("tip", DOWN, np.linspace(0.0, 0.3, 7))
    far = el.trace(cantilever(el.Stop("s", "tip", 5.0, DOWN)), drive, EXACT)
    assert far.effort == pytest.approx(el.trace(cantilever(), drive, EXACT).effort, rel=1e-13, abs=1e-13)


def test_a_mirrored_mechanism_gives_the_mirrored_curve():
    def path(sense):
        disc = el.NodeOnObstacle("d", "tip", el.circle_edge((0.97, -0.3 * sense), 0.1), 0.02)
        return el.trace(
            cantilever(disc), el.Loading((el.PointLoad("tip", 0.0, -sense),), np.linspace(0, 3, 7)), EXACT
        )  # fmt: skip

    one, other = path(1.0), path(-1.0)
    assert one.contact_force(0) == pytest.approx(other.contact_force(0), rel=1e-9, abs=1e-12)
    assert one.motion("tip")[:, 1] == pytest.approx(-other.motion("tip")[:, 1], rel=1e-9, abs=1e-12)


def test_a_constant_load_may_close_a_contact_before_the_drive_moves():
    net = replace(cantilever(el.Stop("s", "mid", 0.05, DOWN), nodes=3), loads=(el.PointLoad("tip", 0.0, -2.0),))
    path = el.trace(net, el.Loading((el.PointLoad("tip", 1.0),), np.array([0.0, 1e-6])), EXACT)
    assert path.contact_force(0)[0] == pytest.approx(3.550103312597306, rel=1e-9)


def test_the_tangent_with_contacts_is_the_derivative_of_the_residual():
    net = cantilever(
        el.Stop("s", "mid", 0.05, DOWN),
        el.NodeOnObstacle("d", "tip", el.circle_edge((1.0, -0.3), 0.1), 0.05, stiffness=30.0),
        el.Stop("r", "tip", 0.2, None, -1.0), nodes=3,
    )  # fmt: skip
    own = equations(discretise(net, el.Loading(TIP_LOAD, np.array([1.0]))))
    free = 0.1 * np.random.default_rng(0).normal(size=own.n)
    free[-3:] = 0.3, 0.4, 0.5
    at = own.linearise(free, 0.7)
    assert residual_slopes(own, free, 0.7) == pytest.approx(at.tangent, abs=1e-8)
    assert at.tangent == pytest.approx(at.tangent.T, abs=1e-13)


def test_of_two_equal_stops_one_bears_the_force():
    """The gap of the other one is zero but for rounding, below which it must not close, too: both are one condition."""
    stop = el.Stop("s", "tip", 0.03, DOWN + 0.3)
    drive = el.Loading(TIP_LOAD, np.linspace(0, 2, 9))
    alone, both = (el.trace(cantilever(*stops, nodes=3), drive, EXACT) for stops in ([stop], [stop, stop]))
    assert both.status is el.PathStatus.COMPLETE, both.message
    assert both.contact_force(0) + both.contact_force(1) == pytest.approx(alone.contact_force(0), abs=1e-9)


@pytest.mark.parametrize("closed", [False, True])
def test_the_distance_from_a_polyline_has_its_derivatives(closed):
    points = [(0.0, 0.0), (1.0, 0.0), (1.0, -1.0), (2.0, -1.0), (2.0, -2.0)]
    outline = el.polyline_edge([*points, (0.0, -2.0)] if closed else points, 0.2, closed)
    rng, step = np.random.default_rng(3), 1e-6
    for place in rng.uniform((-0.5, -1.5), (2.5, 0.5), (60, 2)):
        found = outline.distance(place)
        if found.value < 0.02:  # inside, where two sides may be equally near
            continue
        slope = [
            (outline.distance(place + step * unit).value - outline.distance(place - step * unit).value) / (2 * step)
            for unit in np.eye(2)
        ]
        if abs(np.hypot(*slope) - 1) < 1e-6:  # not where two parts are equally near
            assert found.normal == pytest.approx(slope, abs=1e-8)
        foot = place - found.value * found.normal
        assert abs(outline.distance(foot).value) < 1e-12
