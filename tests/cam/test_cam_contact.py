"""Contact pressure is compared with what the material bears, at rest, in motion, as designed and as built."""

from __future__ import annotations

import numpy as np
import pytest
from cam_motion import moving
from cam_support import MM, analyze, at, cam, message, names

import cfmkit
from cfmkit.metrics import Window, evaluate
from cfmkit.stock import material

WINDOW = Window(0.002, 0.24)
PRESSED = {"roller_radius": "10 mm", "contact": {"width": "3 mm", "material": "pla"}}


def stresses(result, window=WINDOW):
    return [item.value for item in evaluate(result, ("stress_max", "safety_factor"), window).values()]


def hertz(here, roller):
    """Return the pressure of a pla contact 3 mm wide on the flank, by the formula of two cylinders [Pa]."""
    solid, path = material("pla"), here.assembly.profile.path.law.curvature_radius(here.x[0])
    reduced = solid.youngs_modulus / (2 * (1 - solid.poisson_ratio**2))
    return np.sqrt(here.contact[0] * reduced * (1 / roller + 1 / (path - roller)) / (np.pi * 3 * MM))


def test_the_safety_factor_is_the_yield_pressure_over_the_pressure_of_two_cylinders():
    spec = cam(**PRESSED)
    result = analyze(spec)
    assert result.curve.extra["contact_pressure"].values[480] == pytest.approx(hertz(at(spec, 0.24), 0.010), rel=1e-12)
    largest, factor = stresses(result)
    inside = result.curve.displacement >= 0.002
    assert largest == pytest.approx(result.curve.extra["contact_pressure"].values[inside].max() / 1.67, rel=1e-2)
    assert factor == pytest.approx(material("pla").yield_strength / largest, rel=1e-12)


def test_a_contact_that_yields_is_told_with_the_width_that_does_not():
    thin = analyze(cam(**PRESSED, springs={"stiffness": "6 N/mm", "count": 2}))
    assert names(thin) == ["overstressed"]
    reported = message(thin, "overstressed")
    assert "above 75.15 MPa" in reported
    width = reported.split("at least ")[1].split(" (")[0]
    for share, fine in ((1.001, True), (0.99, False)):
        wide = {"width": float(width.split()[0]) * MM * share, "material": "pla"}
        again = analyze(cam(roller_radius="10 mm", springs={"stiffness": "6 N/mm", "count": 2}, contact=wide))
        assert ("overstressed" not in names(again)) is fine
    assert stresses(thin)[1] < 1


@pytest.mark.parametrize("points", [31, 301, 481])
def test_a_window_that_begins_just_beyond_the_corner_has_a_stress_whatever_the_points(points):
    """Its first place lies between a sample on the corner, where the pressure is unbounded, and one on the flank."""
    spec = cam(contact={"width": "3 mm", "material": "pla"}).replace({"analysis.points": points})
    result = analyze(spec)
    corner = result.values["undercut_travel"].value
    start, end = corner + 0.01 * MM, 0.2
    found = stresses(result, Window(start, end))
    sampled = result.curve.displacement
    inside = result.curve.extra["max_stress"].values[(sampled > start) & (sampled <= end)].max()
    assert found[0] == pytest.approx(max(inside, hertz(at(spec, start), 0.016) / 1.67), rel=1e-9)
    assert found[1] == pytest.approx(material("pla").yield_strength / found[0], rel=1e-12)
    on_it = evaluate(result, ("safety_factor",), Window(0.5 * corner, end))["safety_factor"]
    assert on_it.value is None
    assert "the stress is unbounded at " in on_it.reason


def test_the_safety_factor_of_the_mechanism_lowers_what_is_allowed():
    one, two = (analyze(cam(**PRESSED, safety_factor=factor)) for factor in (1, 2))
    assert stresses(two) == [pytest.approx(stresses(one)[0]), pytest.approx(stresses(one)[1] / 2)]


def test_the_usable_stroke_ends_where_the_contact_yields():
    spec = cam(**PRESSED, springs={"stiffness": "2.2 N/mm", "count": 2})
    found = [evaluate(analyze(spec.replace({"analysis.points": n})), ("usable_end",)) for n in (61, 2001)]
    ends = [one["usable_end"].value for one in found]
    assert ends[0] == pytest.approx(ends[1], rel=1e-12)
    assert 0.03 < ends[0] < 0.239
    pressed = analyze(spec.replace({"analysis.travel": ends[0]})).curve.extra["contact_pressure"].values
    assert pressed[480] == pytest.approx(1.67 * 45e6, rel=1e-9)


def test_a_slow_motion_presses_as_at_rest():
    slow = analyze(moving(roller_radius="10 mm", contact=PRESSED["contact"], analysis__dynamics__time="1000 s"))
    still = analyze(cam(roller_radius="10 mm", contact=PRESSED["contact"], analysis__gravity=True))
    place = slow.curve.displacement
    at_rest = np.interp(place, still.curve.displacement[:481], still.curve.extra["contact_pressure"].values[:481])
    np.testing.assert_allclose(slow.curve.extra["contact_pressure"].values, at_rest, rtol=1e-4)
    assert evaluate(slow, ("safety_factor",))["safety_factor"].value > 1
    heavy = moving(roller_radius="10 mm", contact=PRESSED["contact"], springs={"stiffness": "6 N/mm", "count": 2})
    assert "overstressed" in names(analyze(heavy))


def test_a_measured_cam_is_judged_as_well():
    spec = cfmkit.load("configs/cam_as_built.yaml", ["mechanism.contact={width: 0.2 mm, material: pla}"])
    result = cfmkit.analyze(spec)
    assert "overstressed" in names(result)
    assert stresses(result, None)[1] < 1
    largest = max(np.nanmax(curve.extra["contact_pressure"].values) for curve in result.curves)
    assert result.values["contact_pressure_max"].value == pytest.approx(largest, rel=1e-3)


def test_without_a_contact_or_a_strength_there_is_nothing_to_judge():
    for contact in (None, {"width": "1 mm", "material": "pla-ding-2022"}):
        result = analyze(cam(roller_radius="10 mm", contact=contact))
        assert evaluate(result, ("safety_factor",))["safety_factor"].value is None
        assert "overstressed" not in names(result)
