"""Cam mechanisms of absurd proportions: an answer with a reason, never a crash, a hang or a silent NaN."""

from __future__ import annotations

import numpy as np
import pytest
from cam_support import analyze, cam, names
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pace import within

from cfmkit.results import Status

EXPLAIN_NAN = {"up_jam", "dead_point", "brace_too_short"}


def decades(low, high):
    """Draw numbers between powers of ten, each decade alike."""
    return st.floats(low, high).map(lambda power: 10.0**power)


def signed(numbers):
    return st.builds(lambda number, sign: number * sign, numbers, st.sampled_from([-1.0, 1.0]))


@st.composite
def absurd(draw):
    """Draw a mechanism; lengths relative to the brace span eight decades."""
    brace = draw(decades(-2, 0))
    near_one = decades(-12, -2).map(lambda small: 1 - small)
    changes = {
        "brace_length": brace,
        "rest_half_width": brace * draw(st.one_of(st.floats(0.001, 0.9999), near_one)),
        "roller_radius": brace * draw(decades(-3, 0.3)),
        "rolling_friction": draw(st.one_of(st.just(0.0), st.just(0.002), st.floats(1e-6, 0.9999))),
        "profile__force_constant": brace * draw(decades(-8, 6)),
        "profile__stroke": brace * draw(decades(-6, 2)),
        "profile__friction": draw(st.one_of(st.just(0.0), signed(decades(-10, -0.001)))),
        "profile__slope_factor": draw(st.one_of(st.just(1.0), decades(-3, 1).map(lambda extra: 1 + extra))),
        "analysis__gravity": draw(st.booleans()),
        "analysis__points": draw(st.integers(5, 60)),
        "analysis__origin": draw(st.sampled_from(["path-start", "slider", "slider-from-cam"])),
    }
    for name in ("brace_length", "rest_half_width", "roller_radius"):
        if draw(st.booleans()):
            changes[f"profile__{name}"] = changes[name] * draw(decades(-0.5, 0.5))
    if draw(st.booleans()):
        changes["profile__offset"] = brace * draw(signed(decades(-6, -1)))
    if draw(st.booleans()):
        changes["analysis__travel"] = brace * draw(decades(-6, 1))
    if draw(st.booleans()):
        changes["contact"] = {"width": 0.01}
    return changes


# Each of these crashed, lost a NaN or gave nonsense once.
TRACE_OF_FRICTION = {"profile__friction": 1e-9}
FALLS_AGAIN = {"profile__stroke": 0.7, "profile__brace_length": 0.2, "brace_length": 0.17, "roller_radius": 0.01}
ACROSS_THE_AXIS = {
    "brace_length": 0.0101, "rest_half_width": 0.0036, "roller_radius": 0.0003, "profile__roller_radius": 0.0099,
    "profile__force_constant": 0.064, "profile__slope_factor": 6.5, "profile__stroke": 0.0234,
}  # fmt: skip
ALL_ON_THE_CORNER = {"analysis__travel": 1e-7, "analysis__path_method": "ode"}
VERTICAL_CORNER = {
    "brace_length": 0.0889, "rest_half_width": 0.0232, "roller_radius": 0.008, "profile__force_constant": 3e-8,
    "profile__friction": 0.0677, "profile__stroke": 4.8, "profile__offset": -0.0054,
}  # fmt: skip
JAM_IN_THE_MIDDLE = {
    "brace_length": 1.006, "rest_half_width": 0.3143, "roller_radius": 0.0217, "rolling_friction": 0.002,
    "profile__force_constant": 683.0, "profile__stroke": 0.3033, "profile__friction": 0.00011,
    "profile__slope_factor": 1.021,
}  # fmt: skip
VERTICAL_AT_ONCE = {
    "brace_length": 1.0057143036534193, "rest_half_width": 1.0057113909931914, "roller_radius": 0.0286,
    "profile__force_constant": 0.183, "profile__friction": 0.0023536684510775904, "profile__stroke": 1.9,
    "profile__slope_factor": 1.0116377924292541, "analysis__gravity": True,
}  # fmt: skip
NO_TRAVEL_AT_ALL = {
    "brace_length": 0.014893910088102515, "rest_half_width": 0.01489388703420799, "roller_radius": 0.0037,
    "profile__force_constant": 9001.353662185053, "profile__stroke": 7.82e-08,
}  # fmt: skip
BARELY_REACHES = {"rest_half_width": 0.2 * (1 - 1e-5), "profile__stroke": 0.01, "roller_radius": 1e-3}


def published():
    """Analyse the published cam; the slowest of the absurd ones takes as long as five hundred of it."""
    analyze(cam())


@settings(deadline=None, max_examples=300)
@given(absurd())
@example(TRACE_OF_FRICTION)
@example(FALLS_AGAIN)
@example(ACROSS_THE_AXIS)
@example(ALL_ON_THE_CORNER)
@example(VERTICAL_CORNER)
@example(JAM_IN_THE_MIDDLE)
@example(VERTICAL_AT_ONCE)
@example(NO_TRAVEL_AT_ALL)
@example(BARELY_REACHES)
def test_an_absurd_mechanism_has_an_answer_with_a_reason(changes):
    with within(5000, published):
        result = analyze(cam(**changes))
    if not result.status.usable:
        assert len(names(result)) == 1
        return
    curve = result.curve
    half = len(curve) // 2
    assert (np.diff(curve.motion[:half]) > 0).all()
    for name, column in curve.columns():
        if name in ("contact_pressure", "max_stress"):  # unbounded on a corner, none where nothing is in equilibrium
            assert np.isfinite(column.values).all() or (EXPLAIN_NAN | {"undercut"}) & set(names(result)), name
        elif column.dimension != "text" and not name.endswith("force"):
            assert np.isfinite(column.values).all(), name
    assert not np.isinf(curve.force).any()
    assert np.isfinite(curve.force).all() or EXPLAIN_NAN & set(names(result))
    contact, stretched = curve.extra["contact_force"].values, curve.extra["spring_elongation"].values > 0
    assert (contact[stretched & np.isfinite(contact)] > 0).all()
    assert all(value.value is None or np.isfinite(value.value) for value in result.values.values())


@pytest.mark.parametrize("friction", [0.9, 0.99, 0.9999])
def test_friction_near_one_jams_the_way_up_and_holds_the_way_down(friction):
    result = analyze(cam(rolling_friction=friction, roller_radius="10 mm"))
    assert {"up_jam", "slack_cable"} <= set(names(result))
    curve = result.curve
    up, down = curve.select_branch("load"), curve.select_branch("unload")
    jams = result.state.jams
    assert jams[0] == (0, result.values["jam_travel"].value)
    held = np.any([(low <= up.motion) & (up.motion <= high) for low, high in jams], axis=0)
    np.testing.assert_array_equal(np.isnan(up.force[1:]), held[1:])
    assert np.isfinite(down.force).all()


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3])
def test_watch_and_crane_have_the_same_curve(scale):
    lengths = {"brace_length": 0.2, "rest_half_width": 0.068, "roller_radius": 0.016}
    lengths |= {"profile__force_constant": 0.009058, "profile__stroke": 0.24}
    plain = analyze(cam(rolling_friction=0.002))
    scaled = analyze(cam(rolling_friction=0.002, **{name: scale * value for name, value in lengths.items()}))
    assert scaled.status is Status.COMPLETE
    assert names(scaled) == names(plain)
    np.testing.assert_allclose(scaled.curve.force, scale * plain.curve.force, rtol=1e-9, atol=1e-12 * scale)


@pytest.mark.parametrize("points", [5, 6, 1000, 100_000])
def test_the_curve_is_one_closed_loop_up_and_down_with_any_number_of_points(points):
    curve = analyze(cam(rolling_friction=0.002, analysis__points=points)).curve
    assert curve.branches == ("load", "unload")
    assert (curve.branch == "load").sum() == (curve.branch == "unload").sum() == points
    assert curve.motion[0] == 0
    np.testing.assert_array_equal(curve.motion, curve.motion[::-1])
    assert (curve.select_branch("load").force[2:] > curve.select_branch("unload").force[::-1][2:]).all()
