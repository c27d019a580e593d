"""Sides of beams that touch, in compiled code beside those in numpy: equations, gaps, states on other elements."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from contact_layouts import among_discs
from contact_paths import THIN

import cfmkit.elastica as el
from cfmkit.elastica.contact.carried_states import carry
from cfmkit.elastica.contact.pair_gaps import make_gaps
from cfmkit.elastica.contact.side_gaps import NEAR_GAP, LoadStage, search_sides
from cfmkit.elastica.mechanics.compiled import CompiledEquations
from cfmkit.elastica.mechanics.compiled_module import WITHOUT_C_VARIABLE, load_compiled
from cfmkit.elastica.mechanics.discretise import Discretisation, FlankPlace, discretise
from cfmkit.elastica.mechanics.march import CompiledSides, equations

pytestmark = pytest.mark.skipif(load_compiled() is None, reason="the compiled module was not built")
OUTLINES = {
    "disc": el.circle_edge((0.4, -0.2), 0.1),
    "roof": el.polyline_edge([(-0.5, -1), (0.7, -0.2), (1.5, -1)], 0.05),
    "hole": el.circle_edge((0.0, 0.0), 1.4, hole=True),
}
SHAPES = {"straight": el.Polynomial(), "curved": el.Polynomial((0.1, 0.4, 0.2))}
LEAF_PLACES = FlankPlace(0, 0.3), FlankPlace(1, 0.7), FlankPlace(3, 0.4), FlankPlace(2, 0.6)
DRIVE = np.array([0.3])
WIDE_SECTION = el.Section(1e7, 0.2, 0.01, axial=True, poisson_ratio=0.3, wide=True)
SECTIONS = {"stiff": THIN, "soft": replace(THIN, axial=True), "wide": WIDE_SECTION}


def leaf(shape: str = "straight", section: str = "stiff") -> el.Network:
    """Return a leaf under its weight, with a pad at its tip, that may touch three obstacles with its side."""
    pad = el.NodeOnObstacle("floor", "tip", el.line_edge((0, -0.2), 0.1), 0.005)
    contacts = (pad, *(el.BeamOnObstacle(name, "leaf", edge) for name, edge in OUTLINES.items()))
    nodes = {"root": el.Node(0.0, 0.0, el.CLAMPED_SUPPORT), "tip": el.Node(1.0, 0.0)}
    beams = {"leaf": el.Beam("root", "tip", SECTIONS[section], SHAPES[shape])}
    return el.Network(nodes, beams, loads=(el.LineLoad("leaf", 0.3, -0.8),), contacts=contacts)


def touching(closed: bool | None, places: tuple[float, ...] = (0.35, 0.6, 0.8), **network: str) -> Discretisation:
    """Return its arrays with places at which it touches each obstacle."""
    load = el.Loading((el.PointLoad("tip", 0.0, -1.0),), np.array([1.0]))
    flanks = [FlankPlace(1 + k, place) for k, place in enumerate(places)]
    mesh = discretise(leaf(**network), load, 7, flanks=flanks)
    return replace(mesh, contacts=tuple(contact._replace(closed=closed) for contact in mesh.contacts))


def leaves_that_touch(closed: bool | None, places: tuple[float, ...] = (0.3, 0.7, 0.6, 0.4)) -> Discretisation:
    """Return two leaves that touch each other, a pad that is driven, and one on an arm."""
    nodes = {
        "root": el.Node(0.0, 0.0, el.CLAMPED_SUPPORT), "tip": el.Node(1.0, 0.0), "arm": el.Node(1.05, 0.1),
        "wall": el.Node(0.0, 0.05, el.CLAMPED_SUPPORT), "end": el.Node(1.2, 0.05),
        "post": el.Node(0.4, -0.1, el.slider_support(1.5)),
    }  # fmt: skip
    beams = {
        "lower": el.Beam("root", "tip", SECTIONS["soft"], SHAPES["curved"]),
        "upper": el.Beam("wall", "end", THIN),
    }
    contacts = (
        el.NodeOnBeam("post", "post", "lower", 0.02), el.BeamOnBeam("pair", "lower", "upper"),
        el.BeamOnBeam("pair", "upper", "lower", leads=False), el.NodeOnBeam("arm", "arm", "upper", 0.01),
    )  # fmt: skip
    net = el.Network(
        nodes, beams, links=(el.Link("tip", "arm"),), loads=(el.LineLoad("lower", 0.3, -0.8),), contacts=contacts
    )
    mesh = discretise(net, el.Displacement("post", 1.5, np.array([0.1])), 7, flanks=places)
    return replace(mesh, contacts=tuple(contact._replace(closed=closed) for contact in mesh.contacts))


def random_states(mesh: Discretisation, count: int) -> Any:
    """Return states with places of contacts beside where the elements end, and forces of either sign."""
    rng = np.random.default_rng(3)
    z = 0.1 * rng.standard_normal((count, mesh.size))
    for contact in mesh.contacts:
        if contact.slide >= 0:
            z[:, contact.slide] = mesh.elements.cuts[contact.element, 1] + 0.02 * rng.standard_normal(count)
            z[:, contact.flag] = 0.0
            z[:, contact.unknown] *= 10
    return z


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize("closed", [None, True])
@pytest.mark.parametrize("ramp", [False, True])
def test_equations_of_sides_are_those_of_numpy(shape: str, section: str, closed: bool | None, ramp: bool) -> None:
    assert_equations_agree(touching(closed, shape=shape, section=section), ramp)


@pytest.mark.parametrize("closed", [None, True])
@pytest.mark.parametrize("ramp", [False, True])
def test_equations_of_pads_on_beams_and_of_two_beams_are_those_of_numpy(closed: bool | None, ramp: bool) -> None:
    assert_equations_agree(leaves_that_touch(closed, LEAF_PLACES), ramp)


def assert_equations_agree(mesh: Discretisation, ramp: bool) -> None:
    """Both have the same residual, tangent, solutions and unstable directions."""
    compiled = equations(mesh, ramp)
    assert isinstance(compiled, CompiledSides)
    for z in random_states(mesh, 5):
        free, right = z[mesh.free], compiled.reference
        in_numpy, in_c = right.linearise(free, 0.3), CompiledEquations.linearise(compiled, free, 0.3)
        for mine, its in zip(in_c, in_numpy, strict=True):
            assert mine == pytest.approx(its, abs=1e-12 * max(1.0, np.abs(its).max()))
        solutions, unstable = CompiledEquations.resolve(compiled, free, 0.3, np.ones((1, compiled.n)))
        assert unstable == right.count_unstable(in_numpy)
        assert solutions == pytest.approx(right.resolve(free, 0.3, np.ones((1, compiled.n)))[0], rel=1e-8)
        forces = [contact.unknown for contact in mesh.contacts]
        z[forces] = np.abs(z[forces])
        gradient, its = CompiledEquations.gradients(compiled, z[None], DRIVE), right.gradients(z[None], DRIVE)
        assert gradient == pytest.approx(its, abs=1e-12 * np.abs(its).max())


@pytest.mark.parametrize("flanks", [(), (0.35, 0.6, 0.8)])
def test_least_gaps_of_sides_are_those_of_numpy(flanks: tuple[float, ...]) -> None:
    mesh = touching(None, flanks, shape="curved", section="soft")
    assert_gaps_agree(mesh, random_states(mesh, 20), LoadStage(np.linspace(0, 1, 20)))


@pytest.mark.parametrize("places", [(), LEAF_PLACES])
def test_least_gaps_of_pads_on_beams_and_of_two_beams_are_those_of_numpy(places: tuple[FlankPlace, ...]) -> None:
    whole, stage = leaves_that_touch(None, ()), LoadStage(np.linspace(0, 1, 20))
    mesh = leaves_that_touch(None, places)
    assert_gaps_agree(mesh, carry(whole, random_states(whole, 20), stage, mesh), stage)  # lines are continuous


@pytest.mark.parametrize("mesh", [touching(None, ()), leaves_that_touch(None, ())], ids=["obstacles", "leaves"])
def test_gaps_that_are_not_measured_again_are_below_those_that_would_be(mesh: Discretisation) -> None:
    rng, share, passed = np.random.default_rng(7), np.linspace(0, 1, 120)[:, None], 0
    for _ in range(10):
        ends = 0.1 * rng.standard_normal((2, mesh.size))
        states, stage = ends[0] + share * (ends[1] - ends[0]), LoadStage(share[:, 0])
        for item in mesh.fits.network.contacts:
            if not isinstance(item, el.BeamSide):
                continue
            gaps = make_gaps(mesh, item)
            watched, each = gaps.least(states, stage, watch=True), gaps.least(states, stage)
            near = np.abs(each) < NEAR_GAP
            assert watched[near] == pytest.approx(each[near], abs=1e-13)
            assert (watched <= np.maximum(each, -NEAR_GAP) + 1e-13).all()
            assert ((watched < 0) == (each < 0)).all()
            alone = np.concatenate([gaps.least(z[None], stage.take([k]), watch=True) for k, z in enumerate(states)])
            passed += int((watched < alone - 1e-9).sum())
    assert passed > 1000


def assert_gaps_agree(mesh: Discretisation, states: Any, stage: LoadStage) -> None:
    """Both find the same least gaps and places, of states near and far."""
    counts = np.zeros(2, int)
    for item in mesh.fits.network.contacts:
        if not isinstance(item, el.BeamSide):
            continue
        fast, right = make_gaps(mesh, item, (0,)), make_gaps(mesh, item, (0,))
        vars(right)["packed"] = None
        assert search_sides(mesh, fast.packed, states, stage) is not None
        least = right.least(states, stage)
        assert fast.least(states, stage) == pytest.approx(least, abs=1e-13)
        watched, near = fast.least(states, stage, watch=True), least < NEAR_GAP
        assert watched[near & (least > -NEAR_GAP)] == pytest.approx(least[near & (least > -NEAR_GAP)], abs=1e-13)
        assert (watched[near] < NEAR_GAP).all()
        assert (watched[~near] >= NEAR_GAP).all()
        assert (watched[~near] <= least[~near]).all()
        counts += int(near.sum()), int((~near).sum())
        for k in range(len(states)):
            mine, its = (gaps.find_least(states[k], stage.take([k])) for gaps in (fast, right))
            assert mine == pytest.approx(its, abs=1e-9)
    assert (counts >= 5).all()


def test_states_on_other_elements_are_those_of_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    old, new = touching(None, (0.35,), shape="curved", section="soft"), touching(None, shape="curved", section="soft")
    states, stage = random_states(old, 4), LoadStage(np.linspace(0, 1, 4))
    fast = carry(old, states, stage, new)
    monkeypatch.setenv(WITHOUT_C_VARIABLE, "1")
    assert fast == pytest.approx(carry(old, states, stage, new), abs=1e-12)


def test_a_path_among_discs_is_that_of_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    fast = el.trace(*among_discs(1), el.Control(tolerance=1e-8))
    monkeypatch.setenv(WITHOUT_C_VARIABLE, "1")
    slow = el.trace(*among_discs(1), el.Control(tolerance=1e-8))
    events = [[(event.kind, event.number) for event in path.contact_events] for path in (fast, slow)]
    assert len(events[0]) == 4
    assert events[0] == events[1]
    drives = [[event.drive for event in path.contact_events] for path in (fast, slow)]
    assert drives[0] == pytest.approx(drives[1], rel=1e-10)
    assert fast.motion("tip")[fast.at_requested] == pytest.approx(slow.motion("tip")[slow.at_requested], abs=1e-10)
