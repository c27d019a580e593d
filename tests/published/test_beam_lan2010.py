"""Lan, Wang, Chen (2010) through the configurations: Tables 2 to 4, section 2.3, and what the text says about them.

Forces and stresses are those of the model of the paper with each beam turned and scaled to fit between its rounded
nodes, computed by two independent programs. Where the paper prints a number it is asserted as far as the rounding of
its tables allows: half an ulp of every entry is worth 0.0047 N of F_d, 0.072 mm of c and 0.09 MPa (one sigma).
"""

from __future__ import annotations

import re

import numpy as np
import pytest
from beam_support import MM, at, config, solved, value
from cam_support import design_exactly
from lan_2010 import LEG, ROWS, TRAVEL, VALUES

import cfmkit
from cfmkit.specs.units import read_quantity

CLOSURES = ("rotscale", "chain")
KINDS = {"at": "length", "coefficients": "angle"}


@pytest.fixture(scope="module")
def lan():
    return solved("beam_lan2010", "analysis.tolerance=1e-9")


def test_force_at_every_half_millimetre(lan):
    np.testing.assert_allclose(at(lan, TRAVEL), VALUES[:, 1], atol=2e-8)
    assert abs(lan.curve.force[0]) < 1e-9
    assert lan.curve.stable.all()
    assert lan.state.path.events == ()


@pytest.mark.parametrize(("beam", "v", "h"), [("b1", 2, 5), ("b2", 3, 6), ("b3", 4, 7)])
def test_forces_of_each_beam_as_in_figure_8(lan, beam, v, h):
    """The tables give the vertical force that the beam exerts, and the horizontal one that is exerted on it."""
    np.testing.assert_allclose(at(lan, TRAVEL, f"{beam}_force_y"), VALUES[:, v], atol=6e-7)
    np.testing.assert_allclose(at(lan, TRAVEL, f"{beam}_force_x"), -VALUES[:, h], atol=6e-7)


def test_elastica_1_and_2_take_turns_as_positive_and_negative_stiffness(lan):
    """The extremes were read off a table in steps of half a millimetre."""
    travel = np.linspace(0, 18, 181)
    one, two = (lan.curve.extra[f"{beam}_force_y"].values for beam in ("b1", "b2"))
    assert (one.min(), travel[one.argmin()]) == (pytest.approx(-3.476, abs=2e-3), pytest.approx(9, abs=0.25))
    assert (two.max(), travel[two.argmax()]) == (pytest.approx(8.324, abs=6e-4), pytest.approx(9.5, abs=0.1))


def test_largest_stress_and_where_it_is(lan):
    np.testing.assert_allclose(at(lan, TRAVEL, "max_stress") / 1e6, VALUES[:, 8], atol=6e-7)
    np.testing.assert_allclose(at(lan, TRAVEL, "stress_place"), VALUES[:, 9], atol=6e-6)
    assert at(lan, TRAVEL, "stress_beam").tolist() == [row[9] for row in ROWS]


# F_d [N], c [mm], range [%], stress at d [MPa], travel at the allowable stress [mm], and the force at rest [N]
SECTION_2 = {
    "rotscale": (9.739693, 6.983749, 48.6489, 48.218741, 13.501028),
    "chain": (9.734609, 6.970694, 48.7449, 48.222650, 13.497736),
}


@pytest.mark.parametrize("closure", CLOSURES)
def test_numbers_of_section_2(closure):
    result = solved("beam_lan2010", f"mechanism.closure={closure}", "analysis.tolerance=1e-9")
    force, start, share, stress, limit = SECTION_2[closure]
    assert value(result, "nominal_force") == pytest.approx(force, abs=6e-7)
    assert value(result, "range_start") / MM == pytest.approx(start, abs=6e-7)
    assert value(result, "range_fraction") * 100 == pytest.approx(share, abs=6e-5)
    assert value(result, "stress_at_end") / 1e6 == pytest.approx(stress, abs=6e-7)
    assert value(result, "stress_limit_displacement") / MM == pytest.approx(limit, abs=6e-7)
    assert value(result, "prestress_force") == 0


def test_numbers_that_the_paper_prints(lan):
    """F_d = 9.736 N, c = 7.0 mm, 48.5 %, 48.1013 MPa = the allowable stress, at 13.6 mm."""
    assert value(lan, "nominal_force") == pytest.approx(9.736, abs=3 * 0.0047)
    assert value(lan, "range_start") / MM == pytest.approx(7.0, abs=3 * 0.072)
    assert value(lan, "range_fraction") == pytest.approx(0.485, abs=3 * 0.072 / 13.6)
    assert value(lan, "stress_at_end") / 1e6 == pytest.approx(48.1013, abs=3 * 0.09)
    assert value(lan, "allowable_stress") / 1e6 == pytest.approx(48.1013, abs=6e-5)


def test_the_force_has_a_maximum_before_d_and_the_strict_band_is_smaller(lan):
    """F_d is not the largest force: 9.77413 N at 11.03 mm, then a minimum of 9.73955 N at 13.70 mm."""
    assert value(lan, "peak_force") == pytest.approx(9.77413, abs=6e-6)
    assert value(lan, "peak_displacement") / MM == pytest.approx(11.03, abs=6e-3)
    assert value(lan, "valley_force") == pytest.approx(9.73955, abs=6e-6)
    assert value(lan, "valley_displacement") / MM == pytest.approx(13.70, abs=6e-3)
    assert value(lan, "strict_range_start") / MM == pytest.approx(7.084, abs=6e-4)
    assert value(lan, "strict_range_fraction") == pytest.approx(0.479, abs=6e-4)


def test_equation_1_at_8_8_and_4_mm(lan):
    high, low = at(lan, np.array([8.8, 4.0]) * MM)
    assert high / low - 1 == pytest.approx(0.30214615, abs=1e-8)


def test_raw_closure_is_prestressed_and_says_so():
    result = solved("beam_lan2010", "mechanism.closure=raw")
    assert value(result, "prestress_force") == pytest.approx(0.0360, abs=6e-5)
    assert value(result, "nominal_force") == pytest.approx(9.734157, abs=2e-6)
    reported = {item.name: item.message for item in result.warnings}
    assert "carries 0.03597 N" in reported["closure_prestress"]
    assert "closure_adjusted" not in reported


def test_closure_residuals_of_both_tables_are_reported():
    for name, gaps in (
        ("beam_lan2010", (0.0055, 0.0042, 0.0036, 0.0090)),
        ("beam_lan2010_subcfm", (0.058, 0.078, 0.061)),
    ):
        result = solved(name)
        reported = next(item.message for item in result.warnings if item.name == "closure_adjusted")
        missed = [float(text) for text in re.findall(r"it missed by ([\d.e-]+) mm", reported)]
        assert missed == pytest.approx(gaps, rel=0.02)
        assert value(result, "closure_gap_max") / MM == pytest.approx(max(gaps), rel=0.02)


def test_beam_4_with_the_sign_that_is_printed_misses_its_node_by_13_6_mm():
    result = solved("beam_lan2010", "mechanism.beams.b4.shape.coefficients.2=1.148 rad", "analysis.travel=1 mm")
    assert value(result, "closure_gap_max") / MM == pytest.approx(13.6, abs=0.06)


def test_thinner_beams_of_the_same_rigidity():
    """Figure 9: c = 7.88 mm, range 8.96 mm, more than 53 %, stress 48.10 MPa at 16.8 mm."""
    result = solved("beam_lan2010_thin", "analysis.tolerance=1e-9")
    assert value(result, "nominal_force") == pytest.approx(9.983741, abs=6e-7)
    assert value(result, "range_start") / MM == pytest.approx(7.826084, abs=6e-7)
    assert value(result, "range_fraction") == pytest.approx(0.53416, abs=6e-6)
    assert value(result, "stress_at_end") / 1e6 == pytest.approx(48.057829, abs=6e-7)
    assert value(result, "stress_limit_displacement") / MM == pytest.approx(16.820486, abs=6e-7)
    assert value(result, "range_start") / MM == pytest.approx(7.88, abs=3 * 0.072)
    assert 16.8 - value(result, "range_start") / MM == pytest.approx(8.96, abs=3 * 0.072)


def test_the_prototype_of_the_experiment():
    result = solved("beam_lan2010", "mechanism.thickness=0.85 mm", "analysis.window=[7mm,16mm]")
    assert value(result, "nominal_force") == pytest.approx(6.055030, abs=2e-6)


def test_stretching_and_shear():
    """F(0.5 mm) falls by 1.53 and 2.56 %, F_d rises by 0.14 and 0.06 %."""
    force = {
        name: at(solved("beam_lan2010", f"analysis.fidelity={name}"), np.array([0.5, 13.6]) * MM)
        for name in ("inextensible", "extensible", "reissner")
    }
    for name, first, last in (("extensible", -1.53, 0.14), ("reissner", -2.56, 0.06)):
        assert 100 * (force[name] / force["inextensible"] - 1) == pytest.approx([first, last], abs=0.006)


def test_extensible_force_of_an_independent_finite_element_program():
    """A corotational program, extrapolated from 160 and 320 elements, gives 9.7534534 N at 13.5 mm."""
    result = solved("beam_lan2010", "analysis.fidelity=extensible", "analysis.tolerance=1e-9")
    assert at(result, np.array([13.5]) * MM) == pytest.approx(9.753453385, abs=2e-8)


def test_table_4_force_of_eight_legs_and_stress():
    result = solved("beam_lan2010_subcfm", "analysis.tolerance=1e-9")
    np.testing.assert_allclose(at(result, LEG[:, 0] * MM), 8 * LEG[:, 1], atol=8 * 6e-7)
    np.testing.assert_allclose(at(result, LEG[:, 0] * MM, "max_stress") / 1e6, LEG[:, 2], atol=6e-5)
    assert value(result, "peak_force") == pytest.approx(8 * 1.09560, abs=8 * 6e-6)
    assert value(result, "peak_displacement") / MM == pytest.approx(2.62, abs=6e-3)
    assert value(result, "valley_force") == pytest.approx(8 * 1.03746, abs=8 * 6e-6)
    assert value(result, "valley_displacement") / MM == pytest.approx(4.32, abs=6e-3)


def test_table_4_keeps_the_measured_band_over_3_5_mm_and_not_over_5():
    """The paper reports 8 to 8.59 N over 5 mm; with that ratio of largest to smallest force 3.50 mm is the longest."""
    motion = np.linspace(0, 6, 601)
    force = solved("beam_lan2010_subcfm", "analysis.points=601").curve.force
    longest = 0.0
    for first in range(100, 400):
        inside = force[first:] / np.minimum.accumulate(force[first:])
        ratio = np.maximum.accumulate(force[first:]) / np.minimum.accumulate(force[first:])
        assert inside.min() >= 1
        last = first + int(np.argmax(ratio > 8.59 / 8)) - 1
        longest = max(longest, motion[last] - motion[first])
    assert longest == pytest.approx(3.50, abs=0.02)


def test_raw_closure_of_table_4():
    result = solved("beam_lan2010_subcfm", "mechanism.closure=raw")
    assert value(result, "prestress_force") / 8 == pytest.approx(0.0996, abs=6e-5)


# --- section 2.3: scaling ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "changes",
    [
        ("mechanism.material.youngs_modulus=70 GPa", "mechanism.width=3 mm"),
        ("mechanism.thickness=0.4 mm",),
    ],
)
def test_force_times_size_squared_over_rigidity_is_invariant(changes):
    """F L_x^2 / EI = 5.984067475666 at 13.6 mm, with L_x = 32 mm."""
    result = solved("beam_lan2010", "analysis.tolerance=1e-10", *changes)
    mechanism = result.spec.mechanism
    rigidity = mechanism.material.youngs_modulus * mechanism.width * mechanism.thickness**3 / 12
    assert value(result, "nominal_force") * 0.032**2 / rigidity == pytest.approx(5.984067475666, abs=1e-8)


def test_the_end_effector_keeps_its_force_along_the_cam():
    """Between the extremes of the force, 8.30 to 8.76 N; the measured band has the ratio 8.59/8."""
    result = solved("beam_end_effector")
    low, high = value(result, "tip_force_min"), value(result, "tip_force_max")
    assert high / low <= 8.59 / 8
    assert (low, high) == (pytest.approx(8.24, abs=0.006), pytest.approx(8.85, abs=0.006))
    assert value(result, "surface_relief") / MM == pytest.approx(3.5)


def test_two_layers_double_the_travel_at_the_same_force():
    """Figure 15: exactly, up to the peak; there one layer runs ahead of the other."""
    one, two = solved("beam_lan2010"), solved("beam_two_layers")
    steps = np.arange(0.4, 22.0, 0.8) * MM
    np.testing.assert_allclose(at(two, steps), at(one, steps / 2), rtol=2e-6)
    assert value(two, "bifurcation_displacement") == pytest.approx(2 * value(one, "peak_displacement"), rel=1e-6)


def test_layers_that_split_carry_one_force_at_two_displacements():
    """Past the peak the lower and the upper layer are where one mechanism has the force of the stack."""
    one, two = solved("beam_lan2010"), solved("beam_two_layers")
    path, keep = two.state.path, two.state.keep
    first = -path.motion("n5")[keep, 1]
    second = two.curve.motion - first
    past = two.curve.motion > 22.5 * MM
    assert (np.abs(first - second)[past] > 1 * MM).all()
    for each in (first, second):
        force = np.interp(each[past], one.curve.motion, one.curve.force)
        np.testing.assert_allclose(force, two.curve.force[past], atol=2e-4)
    assert two.curve.stable.all()


def test_rescaling_follows_equation_6():
    """Before lengths are rounded to the digits of a process."""
    design = design_exactly(config("beam_lan2010", "design.rescale.force=15 N"))
    assert design.mechanism.width == pytest.approx(0.010 * 15 / 9.7396931, rel=1e-6)
    half = design_exactly(config("beam_lan2010", "design.rescale.force=15 N", "design.rescale.free=size"))
    assert half.mechanism.nodes["n2"].at[0] == pytest.approx(0.0345 * np.sqrt(9.7396931 / 15), rel=1e-6)
    result = cfmkit.analyze(half)
    assert value(result, "nominal_force") == pytest.approx(15, rel=1e-8)
    assert value(result, "range_fraction") == pytest.approx(0.486489, abs=2e-6)


def test_rounding_of_the_tables_costs_what_it_is_said_to():
    """300 tables within half an ulp had F_d 9.7395 +- 0.0047 N, c 6.983 +- 0.072 mm; here 60 of them.

    There the x of n3, printed as 3.05, counted with three decimals; with two F_d spreads by 0.028 N.
    """
    spec = config("studies/beam_rounding")
    ranges = {path: item.uniform for path, item in spec.sensitivity.parameters.items()}
    bounds = {path: read_quantity(text, KINDS[path.split(".")[-2]]) for path, text in ranges.items()}
    bounds["mechanism.nodes.n3.at.0"] = 0.005 * MM
    numbers = np.random.default_rng(2010)
    found = []
    for _ in range(60):
        moved = {path: spec.get_value(path) + bound * numbers.uniform(-1, 1) for path, bound in bounds.items()}
        result = cfmkit.analyze(spec.replace(moved))
        found.append([value(result, name) for name in ("nominal_force", "range_start")])
    mean, sd = np.mean(found, axis=0), np.std(found, axis=0, ddof=1)
    error = np.array([0.0047, 0.072e-3])
    np.testing.assert_array_less(np.abs(mean - [9.7395, 6.983e-3]), 3 * error / np.sqrt(60) + [5e-5, 5e-7])
    np.testing.assert_allclose(sd, error, rtol=0.3)
