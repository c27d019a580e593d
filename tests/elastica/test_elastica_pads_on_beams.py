"""Round pads of nodes on the sides of beams, in units of L and F0 = EI/L^2.

Numbers are of independent shooting (DOP853); the rest are identities, limits and symmetries.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from contact_paths import DOWN, EXACT, HALF, THIN, TIP_LOAD, at_drive, check_complementarity, place_of, shoot

import cfmkit.elastica as el
from cfmkit.elastica.mechanics.discretise import FlankPlace, discretise
from cfmkit.elastica.mechanics.march import equations
from cfmkit.elastica.sensitivity import gradient
from cfmkit.errors import InputError

PAD = el.NodeOnBeam("tip_lower", "tip", "lower", HALF)


def two_leaves(*contacts, height=0.1, lower=1.3, section=THIN, upper=THIN, **changes):
    """Return a leaf of length 1 from `root` to `tip` above another one from `wall` to `end`."""
    nodes = {
        "root": el.Node(0, height, el.CLAMPED_SUPPORT), "tip": el.Node(1, height),
        "wall": el.Node(0, 0, el.CLAMPED_SUPPORT), "end": el.Node(lower, 0),
    }  # fmt: skip
    beams = {"upper": el.Beam("root", "tip", upper), "lower": el.Beam("wall", "end", section)}
    return el.Network(nodes | changes, beams, contacts=contacts or (PAD,))


def test_the_tip_of_a_leaf_on_another_one_has_the_force_and_the_place_of_shooting_both_ways():
    path = el.trace(two_leaves(), el.Loading(TIP_LOAD, np.array([0.25, 0.5, 1, 2, 3, 1, 0.25])), EXACT)
    begin, end = path.contact_events
    assert (begin.kind, end.kind) == ("begins", "ends")
    assert end.drive == pytest.approx(begin.drive, abs=1e-11)
    point = at_drive(path, 2.0)
    assert path.contact_force(0)[point] == pytest.approx(0.814604368077723, rel=1e-11)
    assert path.contact_places(0)[point] * 1.3 == pytest.approx([0.965120388838421] * 2, rel=1e-11)
    assert place_of(path, "tip", point) == pytest.approx((0.932512681319399, -0.229383733653419), abs=1e-11)
    moved = path.motion("end")[path.at_requested]
    assert moved[[0, 2]] == pytest.approx(moved[[6, 5]], abs=1e-9)
    assert path.stable.all()
    check_complementarity(path)


@pytest.mark.parametrize(("curvature", "radius", "load"), [(0.2, 0.02, 2.5), (-0.3, 0.0, 3.0), (0.4, 0.1, 4.0)])
def test_a_pad_on_a_curved_leaf_solves_the_equations_of_shooting(curvature, radius, load):
    end = 1.2 * np.sin(1.2 * curvature) / (1.2 * curvature), 1.2 * (1 - np.cos(1.2 * curvature)) / (1.2 * curvature)
    net = two_leaves(replace(PAD, radius=radius), height=0.4, end=el.Node(*end))
    net = replace(net, beams={**net.beams, "lower": el.Beam("wall", "end", THIN, el.arc(1.2 * curvature))})
    path = el.trace(net, el.Loading(TIP_LOAD, np.array([0.5, 1.0]) * load), el.Control(tolerance=1e-10))
    force, place = path.contact_force(0)[-1], path.contact_places(0)[-1, 0]
    assert force > 0.05
    tip, lower = place_of(path, "tip", -1), path.states("lower")
    touched = int(np.abs(path.places("lower")[-1] - place).argmin())
    angle = float((lower.angle + lower.turn)[-1, touched])
    normal = np.array([-np.sin(angle), np.cos(angle)])
    root, wall = (path.states(name).moment[-1, 0] for name in ("upper", "lower"))
    x, y, _, left = shoot([0, 0.4, 0, root], force * normal + [0, -load], 1.0)
    assert (x, y, left) == pytest.approx((*tip, 0), abs=1e-9)
    x, y, turn, left = shoot([0, 0, 0, wall], -force * normal, 1.2 * place, curvature)
    assert (turn, left) == pytest.approx((angle, 0), abs=1e-8)
    assert (x, y) + (radius + HALF) * normal == pytest.approx(tip, abs=1e-9)


@pytest.mark.parametrize("load", [1.0, 3.0])
def test_a_pad_of_a_node_that_is_held_is_a_disc(load):
    leaf = {
        "tip": el.Node(1, 0),
        "root": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "post": el.Node(0.5, -0.1, el.CLAMPED_SUPPORT),
    }
    net = el.Network(
        leaf, {"leaf": el.Beam("root", "tip", THIN)}, contacts=(el.NodeOnBeam("p", "post", "leaf", 0.045),)
    )
    disc = replace(net, contacts=(el.BeamOnObstacle("p", "leaf", el.circle_edge((0.5, -0.1), 0.045)),))
    pad, known = (el.trace(case, el.Loading(TIP_LOAD, np.array([0.3, load, 0.4])), EXACT) for case in (net, disc))
    assert [event.drive for event in pad.contact_events] == pytest.approx([e.drive for e in known.contact_events])
    assert pad.contact_force(0) == pytest.approx(known.contact_force(0), rel=1e-11, abs=1e-12)
    assert pad.contact_places(0) == pytest.approx(known.contact_places(0), rel=1e-11, nan_ok=True)


def test_a_pad_that_is_driven_against_a_leaf_needs_the_force_of_a_root_that_is_driven_against_a_disc():
    pad = el.NodeOnBeam("p", "post", "leaf", 0.045)
    nodes = {
        "root": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "tip": el.Node(1, 0),
        "post": el.Node(0.6, -0.1, el.slider_support(np.pi / 2)),
    }
    moving = el.Network(nodes, {"leaf": el.Beam("root", "tip", THIN)}, contacts=(pad,))
    driven = el.trace(moving, el.Displacement("post", np.pi / 2, np.array([0.04, 0.2, 0.35])), EXACT)
    nodes = {"root": el.Node(0, 0, el.slider_support(np.pi / 2)), "tip": el.Node(1, 0)}
    disc = el.BeamOnObstacle("p", "leaf", el.circle_edge((0.6, -0.1), 0.045))
    resting = el.Network(nodes, moving.beams, contacts=(disc,))
    known = el.trace(resting, el.Displacement("root", DOWN, np.array([0.04, 0.2, 0.35])), EXACT)
    assert driven.contact_force(0)[-1] > 0
    assert driven.contact_force(0) == pytest.approx(known.contact_force(0), rel=1e-10, abs=1e-12)
    assert driven.effort == pytest.approx(known.effort, rel=1e-10, abs=1e-12)


def test_a_leaf_that_is_stiffer_and_stiffer_becomes_a_floor():
    floor = el.NodeOnObstacle("floor", "tip", el.line_edge((0, HALF), 0.0), HALF)
    load = el.Loading(TIP_LOAD, np.array([0.5, 2.0]))
    known = el.trace(two_leaves(floor), load, EXACT).contact_force(0)[-1]
    missed = []
    for factor in (1e3, 1e5):
        stiff = replace(THIN, youngs_modulus=factor * THIN.youngs_modulus)
        missed.append(abs(el.trace(two_leaves(section=stiff), load, EXACT).contact_force(0)[-1] / known - 1))
    assert missed[0] < 5e-3
    assert missed[1] == pytest.approx(missed[0] / 100, rel=0.05)


def test_a_mirrored_pair_gives_the_mirrored_curve():
    up = two_leaves(height=-0.1)
    paths = [
        el.trace(net, el.Loading((el.PointLoad("tip", 0, sign),), np.array([1.0, 2.5])), EXACT)
        for net, sign in ((two_leaves(), -1.0), (up, 1.0))
    ]
    assert paths[0].contact_force(0) == pytest.approx(paths[1].contact_force(0), rel=1e-11, abs=1e-13)
    assert paths[0].motion("end")[:, 1] == pytest.approx(-paths[1].motion("end")[:, 1], abs=1e-11)


def layout(seed):
    """Return two leaves of random lengths, shapes and thickness with pads on each other, and a load out and back."""
    rng = np.random.default_rng(seed)
    bend, reach = rng.uniform(-0.5, 0.5), rng.uniform(1.15, 1.5)
    ends = reach * np.sinc(bend / np.pi), reach * (1 - np.cos(bend)) / bend
    height = ends[1] * (1 / reach) ** 2 + rng.uniform(0.05, 0.2)
    taper = el.Taper(np.array([0.0, 1.0]), 2 * HALF * rng.uniform(0.7, 1.4, 2))
    contacts = (replace(PAD, radius=rng.uniform(0.0, 0.03)), el.NodeOnBeam("end_upper", "end", "upper", HALF))
    net = two_leaves(*contacts, height=height, end=el.Node(*ends))
    if rng.integers(2):
        disc = el.circle_edge((0.6, -0.5), 0.2)
        net = replace(net, contacts=(*contacts, el.BeamOnObstacle("disc", "lower", disc)))
    section = replace(THIN, thickness=taper) if rng.integers(2) else THIN
    net = replace(net, beams={**net.beams, "lower": el.Beam("wall", "end", section, el.arc(bend))})
    up = np.linspace(0, 1, 7)[1:] * rng.uniform(1, 4)
    load = (el.PointLoad("tip", 0.2 * rng.normal(), -1.0), el.PointLoad("end", 0.0, 0.3 * rng.normal()))
    return net, el.Loading(load, np.concatenate([up, up[-2::-1], [0.0]]))


@pytest.mark.slow  # seconds each
@pytest.mark.parametrize("seed", range(8))
def test_a_random_pair_returns_to_its_own_points_and_keeps_every_condition(seed):
    path = el.trace(*layout(seed), el.Control(tolerance=1e-8))
    assert path.status is el.PathStatus.COMPLETE
    check_complementarity(path)
    assert path.contact_events
    moved = np.stack([path.motion(node)[path.at_requested] for node in ("tip", "end")])
    assert moved[:, :5] == pytest.approx(moved[:, 10:5:-1], abs=1e-9)


def test_the_tangent_with_a_pad_on_an_arm_is_the_derivative_of_the_residual():
    turned = el.Support(rotation=True, direction=0.4)
    net = two_leaves(el.NodeOnBeam("p", "arm", "lower", 0.02), root=el.Node(0, 0.1, turned), arm=el.Node(0.9, 0.2))
    section = replace(THIN, thickness=el.Taper(np.array([0.0, 1.0]), np.array([0.01, 0.015])))
    net = replace(net, links=(el.Link("tip", "arm"),), beams={**net.beams, "lower": el.Beam("wall", "end", section)})
    mesh = discretise(net, el.Displacement("root", 0.4, np.array([1.0])), flanks=[FlankPlace(0, 0.6)])
    mesh = replace(mesh, contacts=tuple(contact._replace(closed=True) for contact in mesh.contacts))
    own = equations(mesh)
    free = 0.1 * np.random.default_rng(1).normal(size=own.n)
    contact = mesh.contacts[0]
    free[own.slots[[contact.slide, contact.unknown, contact.flag]]] = 0.6, 0.7, 0
    at, step = own.linearise(free, 0.2), 1e-6
    both = ([own.linearise(free + sign * step * unit, 0.2).residual for unit in np.eye(own.n)] for sign in (1, -1))
    slopes = np.subtract(*map(np.array, both)).T / (2 * step)
    assert slopes == pytest.approx(at.tangent, abs=1e-6)
    change = (own.linearise(free, 0.2 + step).residual - own.linearise(free, 0.2 - step).residual) / (2 * step)
    assert change == pytest.approx(at.change, abs=1e-6)


def test_a_small_pad_is_not_stepped_over():
    """Both leaves pass each other's places within one step of the drive; the gap is negative in 2 % of it."""
    thin = replace(THIN, thickness=1e-3, youngs_modulus=1.2e10)
    net = two_leaves(replace(PAD, radius=0.0), section=thin, upper=thin, height=0.3)
    path = el.trace(net, el.Loading(TIP_LOAD, np.array([5.0])), EXACT)
    assert path.contact_events[0].kind == "begins"
    assert path.contact_gap(0).min() > -1e-9


def test_a_pad_that_slides_to_the_end_of_the_leaf_ends_the_path_with_the_reason():
    net = replace(two_leaves(root=el.Node(0, 0.1, el.slider_support(0.0))), loads=(el.PointLoad("tip", 0.0, -1.0),))
    path = el.trace(net, el.Displacement("root", 0.0, np.array([0.1, 0.5])), EXACT)
    assert path.status is el.PathStatus.LOST
    assert "the contact of 'tip' on beam 'lower' reaches node 'end'" in path.message
    assert path.contact_places(0)[-1, 0] == pytest.approx(1.0, abs=1e-3)


def test_a_pad_that_meets_the_end_of_a_leaf_ends_the_path_with_the_reason():
    net = two_leaves(replace(PAD, radius=0.08), lower=0.93, height=0.2)
    path = el.trace(net, el.Loading(TIP_LOAD, np.array([0.1, 3.0])), EXACT)
    assert path.status is el.PathStatus.LOST
    assert "'tip' on beam 'lower' meets an end of the beam" in path.message
    tip = place_of(path, "tip", -1)
    assert np.hypot(*(tip - (0.93, 0.0))) > 0.08 + HALF


def test_a_leaf_that_would_wrap_around_a_pad_ends_the_path_with_the_reason():
    nodes = {
        "tip": el.Node(1, 0),
        "root": el.Node(0, 0, el.CLAMPED_SUPPORT),
        "post": el.Node(0.5, -0.51, el.CLAMPED_SUPPORT),
    }
    net = el.Network(nodes, {"leaf": el.Beam("root", "tip", THIN)}, contacts=(el.NodeOnBeam("p", "post", "leaf", 0.5),))
    path = el.trace(net, el.Loading(TIP_LOAD, np.array([0.5, 9.0])), EXACT)
    assert path.status is el.PathStatus.LOST
    assert path.contact_events[-1].kind == "spreads"
    assert "contact of 'post' on beam 'leaf' spreads along a length" in path.message


def test_stability_changes_with_a_pad_where_the_load_has_its_limit():
    """A leaf presses an arch through with its tip: the loads at limit points are those at which stability changes."""
    held = {"root": (0, 0.16), "a": (0.5, 0), "b": (1.5, 0)}
    nodes = {name: el.Node(*at, el.CLAMPED_SUPPORT) for name, at in held.items()} | {"tip": el.Node(1.05, 0.16)}
    arch = el.Beam("a", "b", replace(THIN, youngs_modulus=3e6), el.arc(-1.0))
    upper = replace(THIN, youngs_modulus=1.2e5)
    net = el.Network(nodes, {"upper": el.Beam("root", "tip", upper), "arch": arch},
                  contacts=(el.NodeOnBeam("p", "tip", "arch", 0.02),))  # fmt: skip
    drive = el.Loading(TIP_LOAD, np.array([3.0, 9.0]))
    path = el.trace(net, drive, el.Control(tolerance=1e-8, through_folds=True))
    limits = [event for event in path.events if event.kind == "limit point"]
    assert [(event.before, event.after) for event in limits] == [(0, 1), (1, 0)]
    closed = path.contact_force(0) > 0
    grows = np.diff(path.drive) > 0
    inner = closed[1:] & closed[:-1] & (path.unstable[1:] == path.unstable[:-1])
    assert (grows[inner] == (path.unstable[1:][inner] % 2 == 0)).all()


def test_derivatives_by_design_variables_are_refused():
    path = el.trace(two_leaves(), el.Loading(TIP_LOAD, np.array([1.0])), EXACT)
    with pytest.raises(InputError, match="sides of beams"):
        gradient(path, lambda _: (path.network, path.load_case), np.zeros(1))
