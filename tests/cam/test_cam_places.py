"""Metrics that are places are solved for: they are those of the mechanism, not of the samples."""

from __future__ import annotations

import numpy as np
import pytest
from cam_support import analyze, at, cam, fixed
from scipy.optimize import brentq

from cfmkit.metrics import Window, evaluate

NAMES = ("usable_stroke", "usable_start", "usable_end", "range_95", "range_95_fraction")
NAMES += ("band_range_05pct", "band_range_1pct", "band_range_5pct")
EXTREMES = ("force_max", "force_min", "force_ripple", "rms_to_target")
SPECS = {
    "friction": cam(roller_radius="10 mm", rolling_friction=0.002),
    "more friction": cam(roller_radius="10 mm", rolling_friction=0.004, analysis__band=0.02),
    "undercut": cam(rolling_friction=0.002),
    "undercut, no friction": cam(),
    "cut for friction": cam(roller_radius="10 mm", rolling_friction=0.002, profile__friction=0.002),
    "weight": cam(roller_radius="10 mm", rolling_friction=0.002, analysis__gravity=True, analysis__band=0.3),
    "other parts": fixed(cam(rolling_friction=0.002), brace_length="199 mm", rest_half_width="67.8 mm"),
    "from the slider": cam(rolling_friction=0.002, analysis__origin="slider"),
}


@pytest.mark.parametrize(
    ("names", "ends", "points", "rtol"),
    [(NAMES, (0.004, 0.23), (31, 301, 3001), 1e-9), (EXTREMES, (0.0021, 0.2299), (31, 3001), 2e-6)],
)
@pytest.mark.parametrize("name", SPECS)
def test_places_and_ends_of_windows_do_not_depend_on_the_number_of_points(name, names, ends, points, rtol):
    """At 31 points the first sample beyond rest stands at 8 mm: a line to it says nothing of the force at 2 mm."""
    found = []
    for count in points:
        result = analyze(SPECS[name].replace({"analysis.points": count}))
        start = float(result.curve.displacement.min())
        metrics = evaluate(result, names, Window(start + ends[0], start + ends[1]))
        found.append([metrics[one].value for one in names])
    assert None not in found[0]
    np.testing.assert_allclose(found[1:], [found[0]] * (len(points) - 1), rtol=rtol, atol=1e-9)


def test_the_usable_stroke_begins_where_friction_lets_the_force_into_its_band():
    spec = SPECS["friction"].replace({"analysis.points": 31})
    constant = 4 * 1365.0 * 9.058e-3
    places = [
        brentq(lambda s, mu=mu, level=level: at(spec, s, mu).force[0] / constant - level, 1e-7, 1e-3, xtol=1e-16)
        for mu, level in ((0.002, 1.05), (-0.002, 0.95))
    ]
    start = evaluate(analyze(spec), ["usable_start"])["usable_start"].value
    assert start == pytest.approx(max(places), rel=1e-8)


def test_a_force_that_leaves_its_band_between_two_samples_is_followed_there():
    # The band holds from 0.46 to 46.8 mm of travel, between the first two of five samples.
    spec = cam(roller_radius="10 mm", rolling_friction=0.004, analysis__band=0.019, analysis__points=5)
    coarse, fine = (evaluate(analyze(one), NAMES[:3]) for one in (spec, spec.replace({"analysis.points": 20001})))
    for name in NAMES[:3]:
        assert coarse[name].value == pytest.approx(fine[name].value, rel=1e-9)
