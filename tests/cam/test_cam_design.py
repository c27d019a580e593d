"""From targets to a cam: what is chosen, what is refused, and that the analysis confirms it."""

from __future__ import annotations

import re

import numpy as np
import pytest
from cam_support import MM, analyze, cam, design, message, names
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from cfmkit.families.cam.design import two_way_gap
from cfmkit.families.cam.geometry.slope_law import SlopeLaw
from cfmkit.families.cam.mechanism_from_spec import assemble
from cfmkit.results import Status

NOMINAL = {"springs": {"stiffness": "0.69 N/mm", "count": 2}}
SHORT = {"stiffness": "0.69 N/mm", "count": 2, "max_elongation": "100 mm"}
FAST = settings(deadline=None, max_examples=60)


def targets(mechanism=None, **changes):
    """Return the published targets: 50 N over 240 mm."""
    spec = cam(**(NOMINAL | (mechanism or {})))
    return spec.replace({"design": {"force": "50 N", "stroke": "240 mm"} | changes})


def designed(spec):
    found = design(spec)
    assert found.status is Status.COMPLETE
    assert found.spec is not None
    return found.spec


def refused(spec):
    """Return the finding of an infeasible design."""
    found = design(spec)
    assert found.status is Status.INFEASIBLE
    assert found.spec is None
    (reason,) = found.warnings
    assert found.message == reason.message
    return reason, found.nearest_feasible


def on_flank(result, branch="load"):
    """Return the force where the roller runs on the flank."""
    curve = result.curve.select_branch(branch)
    return curve.force[curve.extra["contact"].values == "flank"]


def test_the_force_constant_follows_from_the_springs():
    spec = designed(targets())
    assert spec.get_value("mechanism.profile.force_constant") == pytest.approx(50 / (4 * 1380), rel=1e-15)
    np.testing.assert_allclose(on_flank(analyze(spec)), 50, rtol=1e-9)


@FAST
@given(st.floats(5, 500), st.floats(0.1, 0.4), st.floats(200, 5000), st.sampled_from([0.0, 0.002, 0.05]), st.booleans())
def test_the_designed_cam_has_the_force_on_the_way_up(force, stroke, stiffness, friction, gravity):
    mechanism = {"springs": {"stiffness": stiffness}, "rolling_friction": friction}
    found = design(targets(mechanism, force=force, stroke=stroke, friction=friction, gravity=gravity))
    assume(found.status is Status.COMPLETE)
    assert found.spec is not None
    result = analyze(found.spec)
    assume(result.status.usable)
    if not gravity or not friction:  # a profile cannot carry weight and friction at once
        force_up = on_flank(result)
        np.testing.assert_allclose(force_up[len(force_up) // 50 :], force, rtol=1e-7)
    assert result.values["theoretical_force"].value == pytest.approx(force, rel=1e-12)
    assert result.curve.motion.max() == pytest.approx(stroke, rel=1e-6)


def test_a_profile_for_the_way_down_is_exact_on_the_way_down():
    spec = designed(targets({"rolling_friction": 0.002}, friction=-0.002))
    result = analyze(spec)
    force = on_flank(result, "unload")
    np.testing.assert_allclose(force[np.isfinite(force)], 50, rtol=1e-8)


def test_avoiding_undercut_takes_the_smallest_force_constant_and_softer_springs():
    found = design(targets(avoid_undercut=True))
    assert found.spec is not None
    assert found.spec.get_value("mechanism.profile.force_constant") == pytest.approx(14.46456 * MM, abs=1e-8)
    assert found.spec.get_value("mechanism.springs.stiffness") == pytest.approx(50 / (8 * 14.46456 * MM), rel=1e-6)
    assert found.active_bounds == ("design.avoid_undercut",)
    assert "from 9.058 mm to 14.46 mm" in found.message
    result = analyze(found.spec)
    assert "undercut" not in names(result)
    np.testing.assert_allclose(result.curve.select_branch("load").force, 50, rtol=1e-7)


def test_avoiding_undercut_changes_nothing_where_there_is_none():
    soft = {"springs": {"stiffness": "0.4 N/mm", "count": 2}}
    found = design(targets(soft, avoid_undercut=True))
    assert found.spec is not None
    assert found.spec.get_value("mechanism.profile.force_constant") == pytest.approx(50 / 3200, rel=1e-15)
    assert found.active_bounds == ()


def test_the_stiffness_follows_from_a_force_constant():
    spec = designed(targets(choose="stiffness", force_constant="15 mm"))
    assert spec.get_value("mechanism.springs.stiffness") == pytest.approx(50 / (8 * 15 * MM), rel=1e-12)
    kept = designed(targets(choose="stiffness"))
    assert kept.get_value("mechanism.profile.force_constant") == pytest.approx(9.058 * MM)


def test_measured_springs_keep_their_proportions():
    mechanism = {"springs": {"stiffness": (683.0, 682.0, 681.0)}}
    spec = designed(targets(mechanism, choose="stiffness", force_constant="15 mm"))
    stiffness = np.array(spec.get_value("mechanism.springs.stiffness"))
    assert stiffness.sum() == pytest.approx(50 / (4 * 15 * MM))
    np.testing.assert_allclose(stiffness / stiffness[0], np.array([683, 682, 681]) / 683, rtol=1e-12)


def test_the_catalogue_gives_the_spring_with_the_smallest_two_way_deviation():
    offers = [
        {"name": f"s{k}", "stiffness": f"{k / 100} N/mm", "max_elongation": "200 mm", "counts": [1, 2]}
        for k in (40, 55, 69, 138)
    ]
    spec = targets({"rolling_friction": 0.002}, choose="catalogue", catalogue=offers, avoid_undercut=True)
    chosen = designed(spec)
    gaps = {}
    for stiffness in {k / 100 * 1e3 * n for k in (40, 55, 69, 138) for n in (1, 2)}:
        constant = 50 / (4 * stiffness)
        trial = cam(springs={"stiffness": stiffness}, rolling_friction=0.002, profile__force_constant=constant)
        result = analyze(trial)
        stretched = result.values["spring_elongation_max"].value
        if "undercut" in names(result) or result.status is not Status.COMPLETE or stretched > 0.2:
            continue
        curve = result.curve
        force = curve.force[curve.motion >= 0.02 * 0.24]
        gaps[stiffness] = np.abs(force / 50 - 1).max()
    assert len(gaps) >= 2
    assert chosen.mechanism.springs.total == pytest.approx(min(gaps, key=gaps.get))


SPRINGS = [
    {"name": f"S{k}", "stiffness": f"{rate} N/mm", "free_length": f"{free} mm", "counts": [count]}
    for k, (rate, free, count) in enumerate(
        [(0.54, 114, 4), (0.21, 80, 2), (0.27, 95, 2), (0.40, 105, 1), (0.54, 109, 1)]
    )
]


@pytest.mark.parametrize(
    "rubs",
    [
        {"pins": {"diameter": "12 mm", "friction": 0.2}},
        {"guide": {"friction": 0.15, "drag": "1 N", "length": "40 mm", "offset": "6 mm"}},
        {"bearings": {"bore": "12 mm", "friction": 0.02}, "mounting": "30 deg"},
    ],
)
def test_of_a_catalogue_the_spring_is_taken_that_is_best_with_all_that_rubs(rubs):
    wanted = {"stroke": "200 mm", "choose": "catalogue", "catalogue": SPRINGS}
    spec = targets({"rolling_friction": 0.002, "roller_radius": "8 mm"} | rubs, **wanted)
    gaps = {}
    for one in SPRINGS:
        alone = design(spec.replace({"design.catalogue": [one]}))
        if alone.spec is not None:
            curve = analyze(alone.spec).curve
            gaps[one["name"]] = np.abs(curve.force[curve.motion >= 0.02 * 0.2] / 50 - 1).max()
    assert len(gaps) >= 3
    assert designed(spec).mechanism.springs.name == min(gaps, key=gaps.get)


@FAST
@given(
    st.floats(0.008, 0.05),
    st.sampled_from([0.0, 1e-9, 0.002, 0.01]),
    st.sampled_from([0.0, 0.003]),
    st.sampled_from([0.0, 60.0]),
)
def test_the_two_way_gap_is_that_of_the_analysed_curve(constant, friction, cut_for, force):
    """With a force given, the profile carries the weight of the moving parts too."""
    design_block = {"force": force or 50.0, "stroke": 0.24, "friction": cut_for, "gravity": bool(force)}
    mechanism = {"roller_radius": "2 mm", "rolling_friction": friction, "profile__force_constant": constant}
    spec = cam(**mechanism, analysis__points=2001).replace({"design": design_block | {"choose": "stiffness"}})
    found = design(spec)
    assume(found.spec is not None)
    law = SlopeLaw(constant, 0.068, 0.2, cut_for, found.spec.get_value("mechanism.profile.slope_factor"))
    gap = two_way_gap(law, spec.design, assemble(found.spec).loads, friction)
    curve = analyze(found.spec).curve
    weight = 0.145 * 9.80665 if force else 0.0  # the slider's own does not count in the gap
    inside = curve.motion >= 0.02 * 0.24
    if np.isnan(curve.force[inside]).any():
        assert gap == np.inf
        return
    worst = np.abs((curve.force[inside] - weight) / (design_block["force"] - weight) - 1).max()
    assert gap == pytest.approx(worst, rel=0.01, abs=1e-9)


def test_a_profile_that_carries_the_weight_is_exact_with_gravity_and_names_its_factor():
    spec = designed(targets(force="60 N", gravity=True))
    pull = 60 - 0.145 * 9.80665
    assert spec.get_value("mechanism.profile.slope_factor") == pytest.approx(pull / (pull - 0.837 * 9.80665), rel=1e-12)
    assert spec.gravity
    np.testing.assert_allclose(on_flank(analyze(spec)), 60, rtol=1e-9)


def test_the_designed_spec_is_a_fixed_part():
    spec = designed(targets())
    longer = spec.replace({"mechanism.brace_length": "201 mm"})
    assert longer.get_value("mechanism.profile.brace_length") == 0.2
    assert np.ptp(on_flank(analyze(longer))) > 0.01
    assert np.ptp(on_flank(analyze(spec))) < 1e-6


def test_a_design_without_targets_is_invalid():
    found = design(cam())
    assert found.status is Status.INVALID
    assert "add the targets" in found.message


# --- what is refused ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mechanism", "changes", "name", "words"),
    [
        ({"rest_half_width": "210 mm"}, {}, "brace_too_short", "200 mm"),
        ({"roller_radius": "200 mm"}, {}, "rollers_collide", "200 mm"),
        ({}, {"friction": -0.4}, "design_singular", "below 0.362"),
        ({"rest_half_width": "190 mm"}, {"friction": 0.4}, "design_singular", "below 0.329"),
        ({"rest_half_width": "190 mm"}, {"friction": 0.4, "avoid_undercut": True}, "design_singular", "below 0.329"),
        ({"rest_half_width": "100 mm"}, {"friction": -0.4, "force": "5000 N"}, "design_singular", "0 mm"),
        ({}, {"stroke": "1 m"}, "brace_too_short", "961.8 mm of 1000 mm"),
        ({}, {"friction": 0.2, "stroke": "5 m"}, "path_vertical", "of 5000 mm"),
        ({"springs": SHORT}, {}, "spring_overstretched", "138 mm"),
        ({}, {"force": "9 N", "gravity": True}, "weight_too_large", "9.63"),
        ({}, {"choose": "stiffness", "avoid_undercut": True}, "force_constant_too_small", "14.46 mm"),
        ({"roller_radius": "199 mm"}, {"avoid_undercut": True, "friction": -0.05}, "undercut", "no force constant"),
    ],
)  # fmt: skip
def test_targets_that_cannot_be_met_are_refused_with_the_reason(mechanism, changes, name, words):
    reason, _ = refused(targets(mechanism, **changes))
    assert reason.name == name
    assert words in reason.message
    assert re.search(r"'(mechanism|design|analysis)\b", reason.message), "the key to change is not named"


@pytest.mark.parametrize(("end_of_fall", "others"), [("121 mm", 0), ("200 mm", 2)])
def test_a_refusal_of_the_best_springs_of_a_catalogue_offers_no_next_best(end_of_fall, others):
    points = [["0 mm", "50 N"], ["120 mm", "49 N"], [end_of_fall, "5 N"], ["240 mm", "5 N"]]
    offers = [{"name": rate, "stiffness": f"{rate} N/mm", "counts": [2]} for rate in ("0.4", "0.55", "0.69")]
    found = design(
        targets({"roller_radius": "10 mm"}, force=None, target={"points": points}, choose="catalogue", catalogue=offers)
    )
    assert len(found.next_best) == others
    assert (found.status, "so quickly" in found.message) == (
        (Status.COMPLETE, False) if others else (Status.INFEASIBLE, True)
    )


def test_a_refused_stroke_names_the_longest_that_is_feasible():
    for spec in (
        targets(stroke="1 m"),
        targets({"springs": SHORT}),
        targets({"springs": SHORT | {"initial_tension": "5 N"}}),
        targets({"springs": SHORT}, friction=0.02),
        targets(friction=0.2, stroke="5 m"),
    ):
        _, nearest = refused(spec)
        longest = spec.replace({"design.stroke": nearest["design.stroke"]})
        assert design(longest).status is Status.COMPLETE
        assert refused(longest.replace({"design.stroke": 1.01 * longest.design.stroke}))


def test_a_refused_force_constant_names_one_that_is_feasible():
    spec = targets(choose="stiffness", avoid_undercut=True)
    _, nearest = refused(spec)
    larger = spec.replace({"design.force_constant": nearest["design.force_constant"]})
    assert design(larger).status is Status.COMPLETE


def test_a_catalogue_without_a_fitting_spring_says_why_each_is_refused():
    offers = [
        {"name": "stiff", "stiffness": "2 N/mm"},
        {"name": "short", "stiffness": "0.4 N/mm", "max_elongation": "50 mm"},
    ]
    reason, _ = refused(targets(choose="catalogue", catalogue=offers, avoid_undercut=True))
    assert reason.name == "no_spring_fits"
    assert "'design.catalogue'" in reason.message
    assert "'design.stroke' or 'design.force'" in reason.message
    assert "2 x stiff: undercut (A = 3.125 mm < 14.46 mm)" in reason.message
    assert "2 x short: spring overstretched" in reason.message


def test_a_spring_whose_cam_would_jam_within_the_stroke_is_refused():
    offers = [{"name": "soft", "stiffness": "0.1725 N/mm", "counts": [2]}]
    spec = targets({"rolling_friction": 0.01}, choose="catalogue", catalogue=offers)
    reason, _ = refused(spec)
    assert "2 x soft: friction holds the roller" in reason.message
    assert design(spec.replace({"mechanism.rolling_friction": 0.002})).status is Status.COMPLETE


def test_an_undercut_design_is_made_and_its_analysis_warns():
    assert "14.4" in message(analyze(designed(targets())), "undercut")


def test_a_design_says_which_values_of_the_profile_it_replaces():
    def reported(**profile):
        found = design(targets({f"profile__{key}": value for key, value in profile.items()}))
        return [item.message for item in found.warnings if item.name == "overwritten"]

    assert reported() == []
    assert reported(rest_half_width="68 mm", force_constant="7 mm", stroke="100 mm") == []
    (one,) = reported(rest_half_width="70 mm")
    assert "'mechanism.profile.rest_half_width' (70 mm) is replaced by 68 mm" in one
    assert len(reported(roller_radius="10 mm", brace_length="190 mm", friction=0.002)) == 3
    (cutting,) = reported(offset="0.1 mm")
    assert "without errors of cutting" in cutting
