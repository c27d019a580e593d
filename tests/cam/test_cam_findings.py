"""Every way in which a cam mechanism fails, next to a harmless neighbour that must not be reported."""

from __future__ import annotations

import numpy as np
import pytest
from cam_support import MM, analyze, at, cam, fixed, message, names

from cfmkit.families.cam.findings import CAM_FINDINGS, finding
from cfmkit.results import Status

FITS = {"roller_radius": "10 mm"}
"""A roller that the published path can carry: nothing is wrong with that mechanism."""


def run(**changes):
    return analyze(cam(**changes))


def test_nothing_is_wrong_with_a_cam_whose_roller_fits():
    result = run(**FITS)
    assert result.status is Status.COMPLETE
    assert names(result) == []
    assert result.values["undercut_travel"].value == 0
    assert result.values["corner_force_max"].value is None
    assert result.valid == ((0.0, pytest.approx(0.24)),)


BRACE = {"rest_half_width": "200 mm"}
NARROW = {"rest_half_width": "9 mm", "profile__stroke": "50 mm", **FITS}
CROSSING = {"rest_half_width": "4 mm", "profile__friction": 0.4, "profile__force_constant": "50 mm"}
SHORT = {"profile__stroke": "0.1 mm", **FITS}
CUT = {"rest_half_width": "14 mm", "profile__stroke": "50 mm", **FITS}
REFUSED = {
    # specification; the one finding; words of the message; a harmless neighbour
    "braces as long as to the rollers": (lambda: cam(**BRACE), "brace_too_short", ("200 mm",), lambda: cam(
        rest_half_width="199 mm", profile__force_constant="0.1 mm", profile__stroke="1 mm", roller_radius="0.1 mm")),
    "braces that do not reach the rollers": (
        lambda: cam(rest_half_width="250 mm"), "brace_too_short", ("200 mm", "250 mm"), None),
    "a brace too short for a larger roller on a finished cam": (
        lambda: fixed(cam(profile__force_constant="15 mm"), brace_length="80 mm", roller_radius="70 mm"),
        "brace_too_short", ("do not reach",), None),
    "a path that falls from its start": (
        lambda: cam(profile__friction=-0.4), "design_singular", ("|friction| must stay below 0.362",), None),
    "a path that falls from its start on the way up": (
        lambda: cam(profile__friction=0.4, rest_half_width="190 mm"), "design_singular",
        ("|friction| must stay below 0.329",), None),
    "a stroke that ends on the corner": (
        lambda: cam(profile__stroke="1.13 mm"), "undercut_total", ("the 16 mm roller", "10.33 mm at the start"),
        lambda: cam(profile__stroke="1.15 mm")),
    "a track that is dead throughout": (
        lambda: fixed(cam(**SHORT), brace_length="100 mm"), "dead_point", ("with a brace of 100 mm",),
        lambda: fixed(cam(**SHORT), brace_length="200 mm")),
    "rollers that overlap at the start": (
        lambda: cam(**NARROW), "rollers_collide",
        ("the rollers overlap by 2 mm at the start", "'mechanism.roller_radius'"),
        lambda: cam(**NARROW | {"rest_half_width": "10.1 mm"})),
    "a larger roller without room beside the other": (
        lambda: fixed(cam(**CUT), roller_radius="15 mm"), "rollers_collide", (),
        lambda: fixed(cam(**CUT), roller_radius="14 mm")),
    "rollers larger than the braces": (
        lambda: cam(roller_radius="201 mm"), "rollers_collide", ("a radius of 201 mm on braces of 200 mm",), None),
    "material that is missing beyond the roller": (
        lambda: fixed(cam(**FITS), profile__offset="-195 mm"), "rollers_collide", (), None),
    "rollers larger than the path's radius and their room": (
        lambda: cam(roller_radius="80 mm"), "rollers_collide", ("overlap by 24 mm",), None),
    "flanks that cross the axis": (  # friction cut for makes the flank's normal lean at the start
        lambda: cam(**CROSSING, roller_radius="12 mm", profile__stroke="50 mm"), "flanks_collide", ("(x = -",),
        lambda: cam(**CROSSING, roller_radius="3 mm", profile__stroke="50 mm")),
    "springs that are slack over the whole travel": (
        lambda: fixed(cam(**FITS), rest_half_width="150 mm"), "spring_slack", ("'mechanism.rest_half_width'",),
        lambda: fixed(cam(**FITS), rest_half_width="130 mm")),
    "a small roller on a cam that crosses the axis": (
        lambda: fixed(cam(**CROSSING, roller_radius="12 mm", profile__stroke="50 mm"), roller_radius="0.5 mm"),
        "flanks_collide", ("across the axis",), None),
}  # fmt: skip


@pytest.mark.parametrize(("spec", "name", "words", "harmless"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_a_mechanism_is_refused_with_its_finding(spec, name, words, harmless):
    result = analyze(spec())
    assert result.status is Status.NO_EQUILIBRIUM
    assert names(result) == [name]
    assert not result.curves
    assert [part for part in ("mechanism.", *words) if part not in result.message] == []
    assert harmless is None or analyze(harmless()).status is Status.COMPLETE


def test_a_finding_needs_a_name_that_is_explained():
    with pytest.raises(KeyError):
        finding("no_such_thing", "")
    assert all(len(meaning) > 20 for meaning in CAM_FINDINGS.values())


# --- (1) the brace ------------------------------------------------------------------------------------------


def test_a_stroke_beyond_the_horizontal_brace_ends_there():
    result = run(profile__stroke="1 m", **FITS)
    assert result.status is Status.PARTIAL
    assert "the stroke ends at 961.8 mm of 1000 mm" in message(result, "brace_too_short")
    assert "'mechanism.brace_length'" in message(result, "brace_too_short")
    assert result.curve.motion.max() == pytest.approx(961.8 * MM, rel=1e-3)
    assert run(profile__stroke="961 mm", **FITS).status is Status.COMPLETE


def test_a_short_brace_on_a_finished_cam_ends_where_the_slider_would_turn_back():
    spec = cam(profile__stroke="700 mm", **FITS)
    result = analyze(fixed(spec, brace_length="170 mm"))
    assert result.status is Status.PARTIAL
    found = message(result, "brace_too_short")
    assert "a brace of 170 mm" in found
    assert "'mechanism.brace_length'" in found
    assert f"after {result.curve.motion.max() / MM:.4g} mm" in found
    assert "brace_too_short" not in names(analyze(fixed(spec, brace_length="170 mm", analysis__travel="100 mm")))
    assert "brace_too_short" not in names(analyze(fixed(spec, brace_length="201 mm")))


# --- (2), (3) a profile cut for friction ---------------------------------------------------------------------


def test_a_path_that_turns_vertical_ends_the_stroke():
    result = run(profile__friction=0.2, profile__stroke="5 m", **FITS)
    assert result.status is Status.PARTIAL
    found = message(result, "path_vertical")
    vertical = result.state.assembly.profile.path.law.vertical_at
    assert f"turns vertical at x = {vertical / MM:.4g} mm" in found
    assert "of 5000 mm" in found
    assert names(run(profile__friction=0.2, profile__stroke="240 mm", **FITS)) == []


def test_a_path_just_inside_the_singular_friction_is_not_refused():
    assert run(profile__friction=-0.36, **FITS).status is not Status.NO_EQUILIBRIUM


def test_a_path_on_which_friction_holds_the_roller_everywhere_is_refused():
    result = run(brace_length="200 mm", rest_half_width="100 mm", profile__force_constant="2 m", profile__friction=-0.4)
    assert result.status is Status.NO_EQUILIBRIUM
    assert names(result) == ["design_singular"]
    assert "the slider cannot rise anywhere" in result.message


# --- (4), (9) undercut ----------------------------------------------------------------------------------------


def test_the_published_cam_is_undercut_and_says_by_how_much_and_what_cures_it():
    result = run()
    assert names(result) == ["undercut"]
    found = message(result, "undercut")
    assert "the 16 mm roller" in found
    assert "(10.33 mm, at the start)" in found
    assert "over the first 1.14 mm it runs on the corner at x = 61.9 mm, y = 14.79 mm" in found
    assert "Use springs stretched by 6.436 mm at the start ('mechanism.springs.preload'), a roller <= 10.3" in found
    assert "or A >= 14.4" in found
    assert result.valid is not None
    assert result.valid[0][0] == pytest.approx(1.13969652 * MM, abs=1e-10)


@pytest.mark.parametrize(
    ("changes", "undercut"),
    [
        ({"roller_radius": "10.329 mm"}, True),
        ({"roller_radius": "10.328 mm"}, False),
        ({"profile__force_constant": "14.464 mm"}, True),
        ({"profile__force_constant": "14.465 mm"}, False),
    ],
)
def test_undercut_begins_at_the_roller_and_the_force_constant_that_the_message_names(changes, undercut):
    assert ("undercut" in names(run(**changes))) == undercut


def test_material_missing_from_the_flank_makes_a_corner_where_the_roller_just_fitted():
    spec = cam(profile__force_constant="14.4646 mm")
    assert "undercut" not in names(analyze(fixed(spec)))
    found = message(analyze(fixed(spec, profile__offset="-0.1 mm")), "undercut")
    assert "the 16 mm roller, with 0.1 mm of the flank missing, is larger" in found
    assert "Use a roller <= 15.9 mm" in found
    assert "undercut" not in names(analyze(fixed(spec, profile__offset="0.1 mm")))


def test_the_pressure_on_a_sharp_corner_is_not_reported_as_a_number():
    result = run(contact={"width": "10 mm"})
    assert "from 1.14 mm of travel on" in message(result, "corner_pressure")
    assert "corner_pressure" not in names(run(contact={"width": "10 mm"}, **FITS))


# --- (5) jams --------------------------------------------------------------------------------------------------


def test_friction_holds_the_roller_at_the_start_of_an_ideal_cam():
    result = run(rolling_friction=0.05, analysis__points=24001, **FITS)
    assert "friction (0.05) holds the roller from 0 mm to 0.01508 mm of travel" in message(result, "up_jam")
    curve = result.curve
    half = len(curve) // 2
    held = np.isnan(curve.force[:half])
    jam = result.values["jam_travel"].value
    np.testing.assert_array_equal(held, (curve.motion[:half] < jam) & (curve.motion[:half] > 0))
    assert np.isfinite(curve.force[half:]).all()  # nothing holds it on the way down


def test_a_start_that_self_locks_over_micrometres_is_a_warning_only_where_the_curve_has_a_point_in_it():
    result = run(rolling_friction=0.05, **FITS)
    assert result.values["jam_travel"].value == pytest.approx(0.01508 * MM, rel=1e-3)
    assert "up_jam" not in names(result)
    assert "up_jam" in names(run(rolling_friction=0.2, **FITS))  # over more than a ten-thousandth of the travel


def test_friction_may_hold_the_roller_on_the_corner_where_no_peak_exists_then():
    result = run(rolling_friction=0.05)
    (low, high), *_ = result.state.jams
    assert low == 0
    assert 0 < high < result.values["undercut_travel"].value
    assert result.values["corner_force_max"].value is None
    assert run(rolling_friction=0.04).values["corner_force_max"].value > 50


@pytest.mark.parametrize("points", [5, 16, 2001])
def test_a_jam_in_the_middle_is_found_however_few_the_points(points):
    wide = {"rest_half_width": "84 mm", "profile__force_constant": "71 mm", "profile__stroke": "430 mm", **FITS}
    spec = fixed(cam(rolling_friction=0.37, analysis__points=points, **wide), brace_length="222 mm")
    result = analyze(spec)
    (_, _), (low, high) = result.state.jams
    reached = result.curve.motion.max()
    assert 0.3 < low / reached < 0.5
    assert 0.7 < high / reached < 0.9
    held = at(spec, np.array([low - 1e-6, low + 1e-6, high - 1e-6, high + 1e-6])).force
    np.testing.assert_array_equal(np.isnan(held), [False, True, True, False])


def test_a_jam_between_the_points_is_found_where_nothing_jams_at_the_ends():
    spec = cam(
        rest_half_width="138.766 mm",
        roller_radius="5.6 mm",
        rolling_friction=0.291,
        profile__force_constant="247.5 mm",
        profile__stroke="254.9 mm",
        profile__friction=0.01044,
        profile__slope_factor=1.624,
        analysis__points=5,
    )
    result = analyze(fixed(spec, brace_length="212.1 mm"))
    assert np.isfinite(result.curve.force).all()
    ((low, high),) = result.state.jams
    assert 0.25 < low / result.curve.motion.max() < high / result.curve.motion.max() < 0.5
    assert "up_jam" in names(result)


def test_a_corner_that_is_passed_over_is_no_matter():
    result = analyze(fixed(cam(), brace_length="110 mm"))
    assert result.state.assembly.track.profile.corner
    assert result.values["undercut_travel"].value == 0
    assert "dead_point" in names(result)
    assert "undercut" not in names(result)


def test_the_flank_is_valid_in_the_displacement_that_the_curve_has():
    result = run(analysis__origin="slider")
    assert result.valid is not None
    ((low, high),) = result.valid
    on_flank = result.curve.motion[result.curve.extra["contact"].values == "flank"]
    assert low == pytest.approx(0.18808508713 + 1.13969652e-3)
    assert low <= on_flank.min()
    assert high == on_flank.max()


@pytest.mark.parametrize(
    "changes",
    [
        {"rolling_friction": 0, **FITS},
        {"rolling_friction": 0.05, "profile__friction": 0.05, **FITS},
        {"rolling_friction": 0.02},
    ],
)
def test_nothing_jams_without_friction_or_cut_for_it_or_on_a_corner(changes):
    result = run(**changes)
    assert "up_jam" not in names(result)
    assert result.values["jam_travel"].value == 0
    assert np.isfinite(result.curve.force).all()


# --- (6) dead points ---------------------------------------------------------------------------------------------


def test_weight_diverges_at_the_dead_point_of_a_cam_that_does_not_carry_it():
    result = run(analysis__gravity=True, **FITS)
    assert "the force from weight is unbounded there" in message(result, "dead_point")
    assert np.isnan(result.curve.force[0])
    close = at(cam(analysis__gravity=True, **FITS), [1e-9, 1e-7]).force
    assert close[0] > 9 * close[1]  # like 1 / sqrt(travel)


def test_weight_and_friction_hold_the_roller_at_the_dead_point_on_the_way_up_only():
    result = run(analysis__gravity=True, rolling_friction=0.002, **FITS)
    assert "dead_point" in names(result)
    assert 0 < result.values["jam_travel"].value < 1e-5
    assert np.isnan(result.curve.select_branch("load").force[0])
    assert np.isfinite(result.curve.select_branch("unload").force).all()


@pytest.mark.parametrize("changes", [{}, {"profile__slope_factor": 1.2, **FITS}])
def test_weight_does_no_harm_on_a_corner_or_on_a_profile_that_carries_it(changes):
    result = run(analysis__gravity=True, **changes)
    assert "dead_point" not in names(result)
    assert np.isfinite(result.curve.force).all()


def test_pretension_diverges_at_the_dead_point():
    spec = cam(**FITS)
    result = analyze(fixed(spec, rest_half_width="67 mm"))
    assert "the force from spring pretension" in message(result, "dead_point")
    assert "dead_point" not in names(analyze(fixed(spec, rest_half_width="69 mm")))


def test_a_shorter_brace_on_a_finished_cam_makes_the_slider_fall_first():
    spec = cam(**FITS)
    result = analyze(fixed(spec, brace_length="180 mm"))
    track = result.state.assembly.track
    found = message(result, "dead_point")
    assert f"by {(track.start - track.dead_point) / MM:.4g} mm" in found
    x = np.linspace(68, 72, 40_001) * MM
    slider = result.state.assembly.profile.path.height(x) + np.sqrt(0.18**2 - x**2)
    assert track.start - track.dead_point == pytest.approx(slider[0] - slider.min(), abs=1e-10)
    assert "dead_point" not in names(analyze(fixed(spec, brace_length="220 mm")))


# --- (7), (8) springs and cable ------------------------------------------------------------------------------------


@pytest.mark.parametrize("points", [5, 24001])
def test_springs_longer_than_the_start_of_the_path_are_slack_there(points):
    spec = cam(analysis__points=points, **FITS)
    result = analyze(fixed(spec, rest_half_width="69 mm"))
    found = message(result, "spring_slack")
    # x = 69 mm after D^2 / 2A = 1 / 18.116 mm.
    assert "for the first 0.0552 mm of travel, by up to 2 mm" in found
    curve = result.curve
    slack = curve.extra["spring_elongation"].values < 0
    assert slack.sum() == 2 * (6 if points > 5 else 1)
    assert (curve.force[slack] == 0).all()
    assert not curve.stable[slack].any()
    assert "spring_slack" not in names(analyze(fixed(spec, rest_half_width="68 mm")))


def test_springs_beyond_their_limit_are_reported_with_the_travel_that_they_allow():
    result = run(springs={"stiffness": "0.6825 N/mm", "count": 2, "max_elongation": "100 mm"}, **FITS)
    # 2D = 100 mm after 50^2 / 2A = 138 mm.
    found = message(result, "spring_overstretched")
    assert "stretched by 131.9 mm, their limit is 100 mm, reached at 138 mm of travel" in found
    enough = {"stiffness": "0.6825 N/mm", "count": 2, "max_elongation": "131.88 mm"}
    assert names(run(springs=enough, **FITS)) == []


def test_the_cable_goes_slack_where_friction_holds_the_rollers_on_the_way_down():
    result = run(rolling_friction=0.2, **FITS)
    found = message(result, "slack_cable")
    slope = result.state.states.slope
    first = result.state.travel[np.argmax(0.2 * slope > 1)]
    assert "on the way down" in found
    assert f"from {first / MM:.4g} mm to 240 mm" in found
    assert "slack_cable" not in names(run(rolling_friction=0.1, **FITS))


# --- (10), (11) collisions and the end of the profile -----------------------------------------------------------------


def test_a_travel_beyond_the_profile_ends_the_curve_at_its_end():
    result = run(analysis__travel="300 mm", **FITS)
    assert result.status is Status.PARTIAL
    assert "the requested travel is 300 mm, but the profile is cut for 240 mm" in message(result, "outside_profile")
    assert result.curve.motion.max() == pytest.approx(240 * MM)
    for harmless in ("240 mm", "100 mm"):
        result = run(analysis__travel=harmless, **FITS)
        assert result.status is Status.COMPLETE
        assert names(result) == []


def test_material_missing_beyond_the_radius_of_curvature_asks_for_no_negative_roller():
    reported = message(run(profile__offset="-20 mm"), "undercut")
    assert "Use less missing material or A >= " in reported
    assert "roller <= " not in reported
    assert "Use a roller <= 9.328 mm" in message(run(profile__offset="-1 mm"), "undercut")
