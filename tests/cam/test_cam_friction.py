"""Friction of pins, bearings and guide, and weight in any direction, against free bodies and energy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cam_support import analyze, cam, design, message
from scipy.optimize import root

import cfmkit
from cfmkit.errors import SpecError
from cfmkit.export import Arc, polygons
from cfmkit.families.cam.figures import figures
from cfmkit.families.cam.geometry.roller_track_on_cut_cam import TrackStates
from cfmkit.families.cam.part_sizes_and_clearances import BESIDE_FLANKS_PAIR, clearances, nearest_pairs
from cfmkit.families.cam.scalar_results import SCALAR_QUANTITIES
from cfmkit.families.cam.statics import Losses, forces, leverage

PINS = {"diameter": "6 mm", "friction": 0.15}
BEARINGS = {"bore": "8 mm", "friction": 0.004}
GUIDE = {"friction": 0.1, "drag": "0.3 N", "length": "40 mm", "offset": "5 mm"}


def rubbing(**changes):
    parts = {"pins": PINS, "bearings": BEARINGS, "guide": GUIDE, "rolling_friction": 0.002}
    return cam(**(parts | changes))


def free_bodies(x, slope, spec, way, weights):
    """Return the forces of both sides from the balance of rollers, braces and slider, solved as they stand."""
    length, radius = spec.mechanism.brace_length, spec.mechanism.roller_radius
    bearing = 0.5 * spec.mechanism.bearings.bore * spec.mechanism.bearings.friction
    pin = 0.5 * spec.mechanism.pins.diameter * spec.mechanism.pins.friction
    mu, guide = spec.mechanism.rolling_friction, spec.mechanism.guide
    (roller, slider), (beside, slider_beside), off = weights
    spring = 2.0 * spec.mechanism.springs.total * (x - spec.mechanism.rest_half_width)
    sin = x / length
    cos = np.sqrt(1.0 - sin * sin)
    along = np.hypot(1.0, slope)
    normal, tangent = np.array([slope, -1.0]) / along, np.array([1.0, slope]) / along
    brace, across = np.array([-sin, cos]), np.array([-cos, -sin])

    def side(outward):
        def balance(unknown):
            contact, traction, pull, bend = unknown
            on_shaft = np.hypot(contact, traction)
            force = contact * normal - way * traction * tangent + pull * brace + bend * across
            force = force + np.array([outward - spring, -roller])
            spin = traction * radius - mu * radius * contact - bearing * on_shaft
            swing = bend * length - way * (pin * abs(pull) + pin * spring - bearing * on_shaft)
            return [*force, spin / radius, swing / length]

        found = root(balance, [spring, 0.0, spring, 0.0], tol=1e-14)
        assert np.abs(balance(found.x)).max() < 1e-9
        contact, _, pull, bend = found.x
        return contact, pull * brace + bend * across

    (one, right), (other, left) = side(beside), side(-beside)
    free = right[1] + left[1] + slider
    sideways = left[0] - right[0] + slider_beside

    def with_guide(force):
        couple = 2.0 * force * guide.offset / guide.length
        ends = [np.hypot(0.5 * sideways + sign * 0.5 * couple, 0.5 * off) for sign in (1.0, -1.0)]
        return free + way * (guide.drag + guide.friction * sum(ends)) - force

    return root(with_guide, free, tol=1e-15).x.item(), max(one, other), min(one, other)


@pytest.mark.parametrize("mounting", ["up", "down", "30 deg", {"elevation": "-20 deg", "roll": "25 deg"}])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_forces_are_those_of_rollers_braces_and_slider_in_balance(mounting, way):
    solution = analyze(rubbing(mounting=mounting)).state
    loads = solution.assembly.loads
    forces = solution.up if way > 0 else solution.down
    weights = (loads.roller_weight, loads.slider_weight), loads.sideways, loads.off_plane
    for index in (40, 200, 480):
        expected = free_bodies(
            solution.states.x[index], solution.states.slope[index], solution.assembly.spec, way, weights
        )
        got = forces.slider[index], forces.contact[index], forces.least_contact[index]
        np.testing.assert_allclose(got, expected, rtol=1e-9)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_pins_rub_on_a_brace_that_pushes_as_on_one_that_pulls(way):
    """Rollers that hang push their braces until the springs carry them: looked at where that changes."""
    hanging = rubbing(mounting="down", pins={"diameter": "18 mm", "friction": 0.3})
    loads = analyze(hanging).state.assembly.loads
    weights = (loads.roller_weight, loads.slider_weight), loads.sideways, loads.off_plane

    def forces_at(x):
        tangent = x / np.sqrt(loads.brace_length**2 - x**2)
        states = TrackStates(x, np.zeros_like(x), np.ones_like(x), tangent, np.zeros(len(x), dtype=bool), x, None)
        return forces(states, loads, way * hanging.mechanism.rolling_friction, way)

    x = loads.rest_half_width * np.linspace(1.0, 1.5, 401)
    lightest = np.argmin(forces_at(x).brace)
    x = np.linspace(x[lightest - 1], x[lightest + 1], 41)
    slider, contact = forces_at(x).slider, forces_at(x).contact
    for place, *got in zip(x, slider, contact, strict=True):
        np.testing.assert_allclose(got, free_bodies(place, 1.0, hanging, way, weights)[:2], rtol=1e-9)


@pytest.mark.parametrize("rubs", [{}, {"bearing": 1e-3}, {"pin": 1e-3}])
@pytest.mark.parametrize("slope", [0.3, 1.2])
def test_friction_takes_lever_on_the_way_up_and_gives_as_much_on_the_way_down(rubs, slope):
    x = np.linspace(0.02, 0.06, 9)
    losses = Losses(rolling=0.05, roller_radius=0.01, **rubs)
    up, free, down = (
        leverage(x, np.full(9, slope), 0.1, parts, friction)
        for parts, friction in ((losses, 0.05), (Losses(roller_radius=0.01), 0.0), (losses, -0.05))
    )
    assert (up < free).all()
    assert 0.5 * (up + down) == pytest.approx(free, rel=1e-3)  # but for products of two coefficients


@pytest.mark.parametrize("mounting", [None, "down", "30 deg"])
@pytest.mark.parametrize(
    "parts",
    [
        {"pins": PINS, "bearings": None, "guide": None},
        {"pins": None, "bearings": BEARINGS, "guide": None},
        {"pins": None, "bearings": None, "guide": GUIDE, "rolling_friction": 0},
        {},
    ],
)
def test_what_each_friction_takes_adds_up_to_the_area_of_the_loop(mounting, parts):
    found = analyze(rubbing(mounting=mounting, analysis__window=("20 mm", "231.3 mm"), **parts))
    solution = found.state
    gap = solution.up.slider - solution.down.slider
    taken = sum(solution.up.lost.values()) + sum(solution.down.lost.values())
    np.testing.assert_allclose(taken[10:], gap[10:], rtol=1e-11)
    inside = solution.travel[(solution.travel > 0.02) & (solution.travel < 0.2313)]
    places = np.concatenate([[0.02], inside, [0.2313]])
    area = np.trapezoid(np.interp(places, solution.travel, gap), places)
    kinds = ("rolling", "bearings", "pins", "guide")
    assert sum(found.values[f"loop_energy_{kind}"].value for kind in kinds) == pytest.approx(area, rel=1e-9)
    assert sum(found.values[f"loop_share_{kind}"].value for kind in kinds) == pytest.approx(1.0, abs=1e-12)


def test_weight_across_the_way_acts_as_in_the_model_of_a_motion():
    lifted = {"slider_position": "220 mm", "stroke": "180 mm", "time": "1000 s", "points": 41}
    spec = cam(mounting="30 deg", rolling_friction=0.002)
    slow = analyze(spec.replace({"analysis.dynamics": lifted})).state
    still = analyze(spec).state
    low = slow.history.contact.min(axis=0)
    at = slow.history.slider.position - still.assembly.track.start
    np.testing.assert_allclose(np.interp(at, still.travel, still.up.least_contact), low, rtol=2e-4)
    np.testing.assert_allclose(np.interp(at, still.travel, still.up.slider), slow.history.force, rtol=2e-5)


def test_a_cam_that_lies_flat_weighs_on_its_guide_only():
    flat = {"elevation": "0 deg", "roll": "90 deg"}
    plain = analyze(cam(rolling_friction=0.002)).state
    lying = analyze(cam(rolling_friction=0.002, mounting=flat)).state
    np.testing.assert_allclose(lying.up.slider, plain.up.slider, rtol=1e-12)
    rubs = analyze(cam(rolling_friction=0.002, mounting=flat, guide={"friction": 0.1})).state
    weight = 9.80665 * (0.068 + 2 * 0.077 + 2 * 0.38)
    np.testing.assert_allclose((rubs.up.slider - plain.up.slider)[1:], 0.1 * weight, rtol=1e-9)


def test_a_smallest_contact_force_that_is_nowhere_finite_is_unknown():
    """Zero would say that a roller leaves the cam."""
    solution = analyze(cam(mounting={"elevation": "0 deg", "roll": "0 deg"}, analysis__points=11)).state
    least = np.concatenate([state.least_contact[1:] for state in (solution.up, solution.down)])
    least_contact = SCALAR_QUANTITIES["contact_force_least"].function
    assert least_contact(solution) == least.min()
    up, down = (replace(state, least_contact=np.full(11, np.nan)) for state in (solution.up, solution.down))
    assert np.isnan(least_contact(replace(solution, up=up, down=down)))


def test_hanging_down_the_weight_helps_by_what_it_hinders_standing_up():
    up, down, off = (
        analyze(cam(mounting=word, analysis__gravity=weight)).state.up.slider
        for word, weight in (("up", True), ("down", True), ("up", False))
    )
    np.testing.assert_allclose((up + down)[1:], 2.0 * off[1:], rtol=1e-12)
    assert (up[1:] > off[1:]).all()


def test_a_profile_that_hangs_down_is_cut_for_the_help_of_the_weight():
    wanted = cam(mounting="down", roller_radius="8 mm").replace(
        {"design": {"force": "40 N", "stroke": "200 mm", "gravity": True}}
    )
    found = design(wanted)
    assert found.spec.mechanism.profile.slope_factor < 1
    force = analyze(found.spec).state.up.slider[2:]
    np.testing.assert_allclose(force, 40.0, rtol=1e-9)


def test_where_weights_help_the_slider_falls_at_first_and_the_page_says_so():
    heavy = cam(
        mounting="down",
        roller_radius="5 mm",
        springs={"stiffness": "0.69 N/mm", "count": 2},
        masses={"slider": "0.2 kg", "brace": "0.077 kg", "roller": "3 kg"},
    ).replace({"design": {"force": "50 N", "stroke": "100 mm", "gravity": True}})
    found = analyze(design(heavy).spec)
    path = found.state.assembly.profile
    lowest = path.path.travel(np.linspace(0.068, path.end, 4001)).min()
    assert lowest == pytest.approx(-0.4006e-3, rel=1e-3)
    assert found.state.assembly.track.dead_point - found.state.assembly.track.start == pytest.approx(lowest, rel=1e-4)
    assert "must first go down by 0.4006 mm before the rollers move out" in message(found, "dead_point")
    np.testing.assert_allclose(found.state.up.slider, 50.0, rtol=1e-9)


def test_a_path_that_weights_help_is_not_designed_inside_the_roller():
    wide = cam(
        brace_length="100 mm",
        rest_half_width="85.933 mm",
        roller_radius="85 mm",
        masses={"slider": "1 g", "brace": "0.1 g", "roller": "1 kg"},
        mounting="down",
        springs={"stiffness": "0.1 N/mm", "count": 2, "preload": "46.99185 mm"},
    )
    asked = {"force": "8.8936 N", "stroke": "31.8 mm", "gravity": True, "friction": 0.0504868, "choose": "stiffness"}
    found = design(wide.replace({"design": asked | {"force_constant": "2.977068 mm"}}))
    assert found.spec is None
    assert "radius of curvature of 81.94 mm at x = 99.92 mm, less than the roller's 85 mm" in found.message
    assert found.nearest_feasible["mechanism.roller_radius"].startswith("81.93 mm")


def test_the_life_of_a_bearing_is_that_of_iso_281_for_its_turns_against_the_brace():
    rated = {"bore": "8 mm", "dynamic_rating": "3300 N", "static_rating": "1370 N", "per_roller": 2}
    for kind, exponent in (("ball", 3), ("roller", 10 / 3)):
        found = analyze(cam(bearings=rated | {"kind": kind}, roller_radius="10 mm"))
        states, contact = found.state.states, found.state.up.contact
        brace = np.arctan2(-np.sqrt(0.2**2 - states.x**2), states.x)
        turns = (np.hypot(np.diff(states.x), np.diff(states.y)) / 0.010 - np.diff(brace)) / (2 * np.pi)
        mean = 0.5 * (contact[1:] + contact[:-1])
        load = (np.sum(turns * mean**exponent) / turns.sum()) ** (1 / exponent) / 2
        expected = 1e6 * (3300 / load) ** exponent / (2 * turns.sum())
        assert found.values["bearing_life"].value == pytest.approx(expected, rel=1e-4)
        assert found.values["bearing_static_safety"].value == pytest.approx(2 * 1370 / contact.max(), rel=1e-12)


def test_a_guide_too_short_for_its_offset_is_refused():
    with pytest.raises(Exception, match="jams like a drawer"):
        cam(guide={"friction": 0.5, "length": "10 mm", "offset": "10 mm"})


SIZES = {"brace_width": "12 mm", "slider": ("40 mm", "20 mm"), "screw_head": "12 mm", "spring_diameter": "10 mm"}


def test_a_lower_stop_keeps_the_roller_off_the_corner():
    stopped = analyze(cam(stops={"lower": "1.2 mm", "upper": "200 mm"}))
    assert stopped.state.travel[0] == pytest.approx(0.0012)
    assert stopped.state.travel[-1] == pytest.approx(0.2)
    np.testing.assert_allclose(stopped.curve.force, 4 * 1365 * 0.009058, rtol=1e-9)
    assert "undercut" not in {one.name for one in stopped.warnings}
    assert stopped.status.name == "COMPLETE"


def test_a_travel_beyond_the_stop_is_told_and_partial():
    found = analyze(cam(stops={"upper": "150 mm"}, analysis__travel="200 mm"))
    assert found.status.name == "PARTIAL"
    assert "stopped at 150 mm" in found.message
    assert analyze(cam(stops={"lower": "300 mm"})).status.name == "NO_EQUILIBRIUM"


def test_distances_are_those_of_points_on_the_parts():
    """Brute force: many points on each part, against the gaps of the closed formulas."""
    found = analyze(cam(roller_radius="10 mm", envelope=SIZES))
    gaps = {}
    for pair, gap in clearances(found.state):
        gaps[pair] = np.minimum(gaps.get(pair, np.inf), gap)
    states, at = found.state.states, 300
    x, y = states.x[at], states.y[at]
    pin = y + np.sqrt(0.2**2 - x**2)
    assert gaps["roller and roller"][at] == pytest.approx(2 * x - 0.02)
    side = np.linspace(-0.5, 0.5, 4001)
    box = np.concatenate(
        [
            np.column_stack([0.04 * side, np.full(side.shape, pin - 0.01)]),
            np.column_stack([np.full(side.shape, 0.02), pin + 0.02 * side]),
        ]
    )
    assert gaps["slider and roller"][at] == pytest.approx(np.hypot(*(box - [x, y]).T).min() - 0.010, abs=1e-6)
    share = np.linspace(0, 1, 20001)[:, None]
    brace = share * [x, y] + (1 - share) * [0.0, pin]
    contours = [contour for contour in cfmkit.drawing(found.spec).contours if contour.hole]
    holes = [edge.center for contour in contours for edge in contour.edges if isinstance(edge, Arc)]
    assert len(holes) == 4
    nearest = min(np.hypot(*(brace - hole).T).min() for hole in holes)
    assert gaps["brace and screw"][at] == pytest.approx(nearest - 0.012, abs=1e-6)
    assert found.values["clearance_min"].value == pytest.approx(min(gap.min() for gap in gaps.values()))
    touched = [one for one in found.warnings if one.name == "parts_touch"]
    assert bool(touched) == (found.values["clearance_min"].value < 0)


def test_inside_corners_have_the_radius_of_the_tool_where_there_is_room():
    def outline(radius):
        return cfmkit.drawing(cam(roller_radius="10 mm", plate={"tool_radius": radius, "base_width": "60 mm"}))

    rounded, sharp = outline("3 mm"), outline("0 mm")
    arcs = [edge for edge in rounded.contours[0].edges if isinstance(edge, Arc)]
    assert [arc.radius for arc in arcs] == [0.003, 0.003]
    ends = [edge.ends for edge in rounded.contours[0].edges]
    for (_, last), (first, _) in zip(ends, [*ends[1:], ends[0]], strict=True):
        assert abs(last - first) < 1e-12

    def area(one):
        x, y = polygons(one.contours[:1], 2000)[0].T
        return 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))

    assert area(rounded) - area(sharp) == pytest.approx(2 * (1 - np.pi / 4) * 0.003**2, rel=1e-3)
    reported = " ".join(outline("300 mm").notes)
    assert "room for a tool radius" in reported


def test_a_roller_meets_the_fillet_of_a_corner_not_the_rest_of_its_circle():
    wide = {"base_width": "60 mm", "tool_radius": "20 mm"}
    found = analyze(cam(roller_radius="10 mm", plate=wide, envelope={"gap": "1 mm"}))
    assert "parts_touch" not in {one.name for one in found.warnings}
    gap, states = nearest_pairs(found.state)[BESIDE_FLANKS_PAIR], found.state.states
    assert gap.min() > -1e-9
    outline = polygons(cfmkit.drawing(found.spec).contours[:1], 4000)[0]
    for at in (0, len(gap) // 8):
        away = np.hypot(*(outline - [states.x[at], states.y[at]]).T).min() - 0.010
        assert gap[at] >= away - 1e-6  # the whole outline has the flank, too, which the roller touches


def test_a_roller_that_comes_to_the_end_of_its_flank_touches_nothing_else():
    found = analyze(cam(roller_radius="10 mm", envelope={"gap": "1 mm"}))
    assert "parts_touch" not in {one.name for one in found.warnings}
    assert found.values["clearance_min"].value == pytest.approx(2 * (float(found.state.states.x.min()) - 0.010))
    assert "clearance" in figures(found)


def test_a_share_of_friction_that_is_unbounded_is_left_out():
    """At an upright flank, on the way back: the cell is empty, like the force on the way up."""
    result = cfmkit.analyze(cfmkit.load(Path(__file__).parents[2] / "configs" / "cam_friction.yaml"))
    for name, column in result.curve.extra.items():
        if name.startswith("lost_to_"):
            assert not np.isinf(column.values).any(), name


def test_a_mounting_that_is_no_word_and_no_angle_is_told_which_there_are():
    with pytest.raises(SpecError, match="'sideways' is not one of up, horizontal, down, nor an angle such as '30 deg'"):
        rubbing(mounting="sideways")
