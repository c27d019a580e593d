"""The prototype in motion against the reference note's own numbers (section 3), to their digits.

None of these is printed in the paper; what the paper prints is in tests/published.
"""

from __future__ import annotations

import numpy as np
import pytest
from cam_motion import change_at_rest, moving, peak_over_one_second, response, with_springs
from cam_support import analyze, take_gravity_of_the_note

from cfmkit.families.cam.dynamics.inverse import respond, statics
from cfmkit.families.cam.dynamics.machine_from_spec import build
from cfmkit.families.cam.dynamics.roller_curves_and_motion import SliderState

WIDE_ROLLER = {"masses__roller_inertia": 4.61e-5}
FROM_CAM = {"analysis__dynamics__origin": "cam-start"}
NO_WEIGHT = {"analysis__gravity": False}


@pytest.fixture(autouse=True)
def _gravity_of_the_note(monkeypatch):
    """The note's numbers hold for 9.81 m/s^2; the product takes the standard value."""
    take_gravity_of_the_note(monkeypatch)


def at_rest(position):
    machine = build(moving()).machine
    return statics(machine, np.array([position]))


@pytest.mark.parametrize(
    ("position", "weight", "mass"), [(0.22, 11.23686398, 1.51154419), (0.28, 10.81518071, 1.32861804)]
)
def test_weight_and_moving_mass_match_the_closed_form(position, weight, mass):
    heavy, light = at_rest(position), statics(build(moving(**NO_WEIGHT)).machine, np.array([position]))
    assert heavy.force[0] - light.force[0] == pytest.approx(weight, abs=0.51e-8)
    assert heavy.mass[0] == pytest.approx(mass, abs=0.51e-8)


def test_force_at_rest_at_220_mm():
    assert at_rest(0.22).force[0] == pytest.approx(60.69354398, abs=0.51e-8)


@pytest.mark.parametrize(
    ("changes", "peaks", "digits"),
    [
        ({}, (91.35964, 50.59594, 35.00150), 5),
        (NO_WEIGHT, (111.55, 56.2330, 37.6097), 2),
        (WIDE_ROLLER, (121.3160, 67.3313, 46.6173), 4),
        (FROM_CAM, (88.7400, 49.0842, 33.9396), 4),
    ],
    ids=["as printed", "no weight", "larger roller inertia", "heights above the cam's start"],
)
def test_peaks_of_the_force_within_an_eighth_of_a_second(changes, peaks, digits):
    for count, peak in zip((2, 4, 6), peaks, strict=True):
        assert peak_over_one_second(with_springs(count, **changes)) == pytest.approx(peak, abs=0.6 * 10.0**-digits)


@pytest.mark.parametrize(
    ("time", "peaks"),
    [(0.25, (21.75230, 12.04665, 8.33369)), (0.5, (4.35046, 2.40933, 1.66674)), (1.0, (0.0, 0.0, 0.0))],
)
def test_peaks_of_slower_motions(time, peaks):
    for count, peak in zip((2, 4, 6), peaks, strict=True):
        spec = with_springs(count, analysis__dynamics__time=time)
        assert peak_over_one_second(spec) == pytest.approx(peak, abs=0.6e-5)


def test_no_mass_of_the_roller_gives_the_papers_three_peaks_at_once():
    """The mass that each peak needs differs: what is not printed, the springs' mass, moves with the rollers."""
    needed = {2: (91.8, 0.38291), 4: (56.6, 0.44554), 6: (44.7, 0.52868)}
    for count, (peak, mass) in needed.items():
        assert peak_over_one_second(with_springs(count, masses__roller=mass)) == pytest.approx(peak, abs=0.001)


def test_without_weight_equal_steps_of_spring_mass_would_give_them():
    """A fit of two parameters to three numbers, after choosing to leave gravity out: no evidence, only a hint."""
    for pairs, peak in ((1, 91.800), (2, 56.520), (3, 44.705)):
        spec = with_springs(2 * pairs, masses__roller=0.2033 + 0.0896 * pairs, **NO_WEIGHT)
        assert peak_over_one_second(spec) == pytest.approx(peak, abs=0.02)  # the two parameters are rounded


def test_one_second_is_not_yet_static():
    slow = response(moving(analysis__dynamics__time=1.0), 20001)
    rest = statics(slow.machine, slow.slider.position).force
    assert 100 * (slow.force / rest - 1).max() == pytest.approx(1.4715, abs=0.51e-4)
    fast = response(moving(), 20001)
    assert 100 * (fast.force / rest - 1).max() == pytest.approx(94.1755, abs=0.51e-4)


def test_braking_takes_most_of_the_force_away_and_without_weight_reverses_it():
    heavy, light = response(moving(), 20001), response(moving(**NO_WEIGHT), 20001)
    slow = response(moving(**NO_WEIGHT, analysis__dynamics__time=1.0), 20001)
    assert heavy.force.min() == pytest.approx(7.6636, abs=0.51e-4)
    assert response(moving(), 201).force.min() == pytest.approx(7.67, abs=0.0051)  # the note's grid
    assert 100 * (light.force / slow.force).min() - 100 == pytest.approx(-106.33, abs=0.0051)


def test_a_dead_weight_would_need_410_percent_more_not_310():
    found = analyze(moving(analysis__dynamics__points=20001)).values
    assert found["slider_acceleration_max"].value == pytest.approx(40.21239, abs=0.51e-5)
    assert found["dead_weight_peak"].value == pytest.approx(4.09912, abs=0.51e-5)


DEVIATION = {"analysis__dynamics__slider_position": 0.212, "analysis__dynamics__time": 10.0}


@pytest.mark.parametrize("way", [1, -1], ids=["clockwise", "counter-clockwise"])
@pytest.mark.parametrize(
    ("changes", "effects"),
    [
        (NO_WEIGHT, (0.70479, 2.86581, 6.63141, 12.28004, 20.28028)),
        ({}, (0.59674, 2.42629, 5.61378, 10.39403, 17.16217)),
    ],
    ids=["no weight", "weight"],
)
def test_force_at_the_end_when_the_slider_deviates_by_1_to_5_deg(changes, effects, way):
    for degrees, effect in enumerate(effects, start=1):
        spec = moving(**changes, **DEVIATION, errors__slider_deviation=way * np.radians(degrees))
        assert change_at_rest(spec) == pytest.approx(effect, abs=0.51e-5)


def test_deviation_of_5_deg_from_the_cams_start_and_at_the_start_of_the_stroke():
    turned = {"errors__slider_deviation": "5 deg", **DEVIATION}
    assert change_at_rest(moving(**turned, **NO_WEIGHT, **FROM_CAM)) == pytest.approx(21.683, abs=0.51e-3)
    assert change_at_rest(moving(**turned, **FROM_CAM)) == pytest.approx(18.350, abs=0.51e-3)
    assert change_at_rest(moving(**turned, **NO_WEIGHT), travel=0.0) == pytest.approx(8.48308, abs=0.51e-5)


@pytest.mark.parametrize(
    ("degrees", "without", "with_weight"),
    [(0.4, 7.62316, 6.38325), (-0.4, -7.21151, -6.03896)],
    ids=["wider", "narrower"],
)
def test_force_at_the_end_when_the_flanks_are_cut_at_a_wrong_angle(degrees, without, with_weight):
    turned = {"errors__flank_angle": f"{degrees} deg", "analysis__dynamics__time": 10.0}
    assert change_at_rest(moving(**turned, **NO_WEIGHT)) == pytest.approx(without, abs=0.51e-5)
    assert change_at_rest(moving(**turned)) == pytest.approx(with_weight, abs=0.51e-5)


def test_symmetric_closed_forms_of_weight_and_moving_mass_along_the_whole_stroke():
    """W and M from the slope f of the path alone, with k = f/(f - t), u' = 1/(f - t), t = tan(alpha)."""
    spec = moving()
    machine, law = build(spec).machine, build(spec).right.profile.path.law
    position = np.linspace(0.2, 0.42, 23)
    still = np.zeros_like(position)
    found = respond(machine, SliderState(position, still, still))
    x = found.at.center[0].real
    slope, tangent = law.slope(x), x / np.sqrt(0.04 - x**2)
    rise, out = slope / (slope - tangent), 1.0 / (slope - tangent)
    weight = 9.81 * (2 * 0.38 * rise + 0.077 * (1 + rise) + 0.068)
    roller = (0.38 + 4.61e-6 / 0.016**2) * (rise**2 + out**2)
    brace = 0.077 * ((1 + rise) ** 2 + out**2) / 4 + 2.57e-4 * out**2 / (0.04 - x**2)
    np.testing.assert_allclose(found.mass, 0.068 + 2 * (roller + brace), rtol=1e-12)
    springs = 4 * 1365.0 * (x - 0.068) * out
    np.testing.assert_allclose(found.force, weight + springs, rtol=1e-12)
