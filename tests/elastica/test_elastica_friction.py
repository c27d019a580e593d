"""Coulomb friction of nodes on obstacles and stops, in units of L and F0 = EI/L^2.

The numbers are of independent shooting (DOP853), as in `test_elastica_contact.py`.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from contact_paths import DOWN, EXACT, SECTION
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import cfmkit.elastica as el
from cfmkit.elastica.contact.follow import choose_friction
from cfmkit.elastica.contact.piece import PieceOfPath
from cfmkit.elastica.mechanics.discretise import discretise
from cfmkit.elastica.mechanics.problem import NetworkProblem
from cfmkit.elastica.results.between_points import interpolate_path
from cfmkit.numerics.continuation import Options, PathEquilibrium

ANGLE = np.radians(20)
CENTRE, DISC = (1.1, -0.4), 0.3


def lower(contact, places, angle=ANGLE):
    """Return the path of a straight cantilever, below the horizontal by an angle, whose clamp is lowered."""
    nodes = {"root": el.Node(0, 0, el.slider_support(np.pi / 2)), "tip": el.Node(np.cos(angle), -np.sin(angle))}
    net = el.Network(nodes, {"b": el.Beam("root", "tip", SECTION)}, contacts=(contact,))
    return el.trace(net, el.Displacement("root", DOWN, np.array(places)), EXACT)


def on_floor(friction, radius=0.0):
    return el.NodeOnObstacle("floor", "tip", el.line_edge((0, -0.4), 0.0), radius, friction=friction)


def on_disc(friction, radius=0.0):
    return el.NodeOnObstacle("disc", "tip", el.circle_edge(CENTRE, DISC), radius, friction=friction)


def tip_x(path):
    return path.motion("tip")[:, 0] + path.network.nodes["tip"].x


def at_requested(path, values):
    return np.asarray(values)[path.at_requested]


@pytest.mark.parametrize("contact", [on_floor(0.3), el.Stop("s", "tip", 0.4 - np.sin(ANGLE), DOWN, friction=0.3)])
def test_a_tip_slides_out_sticks_and_slides_back_as_shooting_says(contact):
    path = lower(contact, [0.1, 0.15, 0.2, 0.15, 0.1])
    assert path.status is el.PathStatus.COMPLETE
    known = [0.152971940412703, 0.319403228732297, 0.473526569563413, 0.276844733824390, 0.127339701165245]
    assert at_requested(path, path.contact_force(0)) == pytest.approx(known, rel=1e-8)
    assert at_requested(path, tip_x(path))[[2, 4]] == pytest.approx([0.977555200121432, 0.953733369690108], rel=1e-8)
    begins, sticks, slips = path.contact_events
    assert [begins.kind, sticks.kind, slips.kind] == ["begins", "sticks", "slips"]
    assert [begins.drive, sticks.drive] == pytest.approx([0.4 - np.sin(ANGLE), 0.2], rel=1e-10)
    assert slips.drive == pytest.approx(0.19980044244645, rel=1e-10)


def test_friction_acts_at_the_rim_of_a_round_tip():
    path = lower(on_floor(0.3, 0.02), [0.2, 0.3, 0.2])
    assert at_requested(path, path.contact_force(0))[[0, 2]] == pytest.approx([0.537759419077849, 0.482853274936734])
    assert at_requested(path, tip_x(path))[[0, 2]] == pytest.approx([0.980788367193084, 0.980813138881870], rel=1e-8)


@pytest.mark.parametrize(("friction", "radius"), [(0.2, 0.0), (0.2, 0.05), (0.9, 0.0)])
def test_every_row_keeps_the_cone_and_sticks_where_it_is_said_to(friction, radius):
    path = lower(on_disc(friction, radius), [0.1, 0.25, 0.1, 0.0], angle=0.0)
    assert path.status is el.PathStatus.COMPLETE
    force, gap = path.contact_force(0), path.contact_gap(0)
    tangential, state = path.contact_friction(0)
    assert force.min() > -1e-9
    assert gap.min() > -1e-9
    assert np.abs(force * gap).max() < 1e-9
    assert (friction * force - np.abs(tangential)).min() > -1e-9
    assert np.abs(friction * force - np.abs(tangential))[state == "slip"].max() < 1e-9
    place = path.motion("tip")[:, :2] + [path.network.nodes["tip"].x, path.network.nodes["tip"].y] - CENTRE
    slid = -np.unwrap(np.arctan2(place[:, 1], place[:, 0])) * (DISC + radius) + radius * path.motion("tip")[:, 2]
    both = (force[1:] > 0) & (force[:-1] > 0)
    steps = np.diff(slid)
    assert np.abs(steps[(state[1:] == "stick") & both]).max() < 1e-12
    sliding = (state[1:] == "slip") & both
    assert (steps[sliding] * tangential[1:][sliding] < 0).all()  # against the motion


@pytest.mark.parametrize(("friction", "radius", "place"), [(0.2, 0.0, 0.2), (0.3, 0.05, 0.08)])
def test_sliding_on_a_disc_agrees_with_shooting(friction, radius, place):
    path = lower(on_disc(friction, radius), [place], angle=0.0)
    tangential = float(path.contact_friction(0)[0][-1])
    ratio = tangential / float(path.contact_force(0)[-1])
    assert abs(ratio) == pytest.approx(friction, rel=1e-10)

    def miss(guess):
        curvature, force, angle = guess
        normal = np.array([np.cos(angle), np.sin(angle)])
        h, v = force * normal + ratio * force * np.array([normal[1], -normal[0]])

        def slope(_, y):
            return [np.cos(y[2]), np.sin(y[2]), y[3], h * np.sin(y[2]) - v * np.cos(y[2])]

        end = solve_ivp(slope, (0, 1), [0, -place, 0, curvature], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        return [*(end[:2] - CENTRE - (DISC + radius) * normal), end[3] - radius * ratio * force]

    x, y = path.motion("tip")[-1, :2] + [1.0, 0.0] - np.array(CENTRE)
    force = float(path.contact_force(0)[-1])
    solved = fsolve(miss, [force, force, np.arctan2(y, x)], xtol=1e-13)
    assert force == pytest.approx(solved[1], rel=1e-8)


def test_a_rounded_corner_rubs_as_the_disc_of_its_fillet():
    radius, turn = 0.3, np.radians(50)
    corner = np.add(CENTRE, [-radius * np.tan(turn / 2), radius])
    before = corner - [0.3 * np.cos(turn), 0.3 * np.sin(turn)]
    edge = el.polyline_edge([before, corner, np.add(corner, [0.5, 0.0])], radius)
    places = [0.2, 0.25, 0.2]
    paths = [
        lower(el.NodeOnObstacle("edge", "tip", outline, 0.0, friction=0.2), places, angle=0.0)
        for outline in (edge, el.circle_edge(CENTRE, radius))
    ]
    forces = [at_requested(path, path.contact_force(0)) for path in paths]
    assert forces[0] == pytest.approx(forces[1], rel=1e-9)


def test_what_a_cycle_costs_is_what_friction_takes():
    path = lower(on_floor(0.3), [*np.linspace(0.02, 0.2, 10), *np.linspace(0.18, 0.0, 10)])
    turn = int(np.flatnonzero(path.requested == 9)[0])
    nodes, weights = np.polynomial.legendre.leggauss(33)
    shares, weights = 0.5 * (1 + nodes), 0.5 * weights
    works, rubbed = [], []
    for way, sense in ((path.take(np.arange(turn + 1)), 1), (path.take(np.arange(turn, len(path))), -1)):
        law = interpolate_path(way)
        marks = [way.drive.min(), *law.corners.tolist(), way.drive.max()]
        for low, high in itertools.pairwise(marks):
            there = law.solve_at(low + (high - low) * shares)
            assert there.accurate.all()
            works.append(sense * (high - low) * float(weights @ there.effort))
            slid, force = tip_x(there), np.abs(there.contact_friction(0)[0])
            slope = np.polynomial.chebyshev.Chebyshev.fit(shares, slid, 24).deriv()(shares)
            rubbed.append(float(weights @ (np.abs(slope) * force)))
    assert sum(works) == pytest.approx(sum(rubbed), rel=1e-7)
    assert sum(works) > 0


def test_without_friction_nothing_is_added():
    floor = el.NodeOnObstacle("floor", "tip", el.line_edge((0, -0.4), 0.0))
    smooth, plain = (lower(one, [0.1, 0.2]) for one in (replace(floor, friction=0.0), floor))
    assert np.array_equal(smooth.at.z, plain.at.z)
    assert all(contact.rub < 0 for contact in smooth.mesh.contacts)


def test_a_strut_that_leans_more_than_friction_lets_it_slide_blocks_the_drive():
    floor = el.NodeOnObstacle("floor", "tip", el.line_edge((0, -np.sin(1.2) - 0.02), 0.0), friction=0.8)
    path = lower(floor, [0.1], angle=1.2)
    assert path.status is el.PathStatus.BLOCKED
    assert path.message == "the drive is blocked by 'tip' on 'floor' at 0.02"
    assert path.drive[-1] == pytest.approx(0.02)


def test_it_is_counted_how_many_states_of_friction_can_go_on():
    # a stiff strut, steeper than the cone, that is dragged along the floor and very little away from it: it may stick
    # and jam, or slide and be pulled on to the floor [Painleve]; Coulomb's law says no more
    stretches = el.Section(8000.0, 12.0, 0.05, axial=True, shear=False)  # EI = 1, 20 times as long as thick
    nodes = {"root": el.Node(0, 0, el.slider_support(0.02)), "tip": el.Node(np.cos(1.2), -np.sin(1.2))}
    floor = el.NodeOnObstacle("floor", "tip", el.line_edge((0, -np.sin(1.2)), 0.0), friction=1.2)
    net = el.Network(nodes, {"b": el.Beam("root", "tip", stretches)}, contacts=(floor,))
    problem = NetworkProblem(discretise(net, el.Displacement("root", 0.02, np.array([0.01])), 9))
    piece = PieceOfPath(problem, frozenset({0}), Options(0.01))
    count = len(problem.mesh.free)
    touch = PathEquilibrium(np.zeros(count), 0.0, np.zeros(count), 0)
    away, towards = (choose_friction(piece, touch, (sense,), 0) for sense in (1.0, -1.0))
    assert away.n_states == 2
    assert away.piece.friction[0].sense == 0  # sticking is taken
    assert towards.n_states == 1
