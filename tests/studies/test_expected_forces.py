"""The sentence for the bench: the force at two places, for 95 % of parts."""

from __future__ import annotations

import re

import numpy as np
import pytest

import cfmkit
from cfmkit import Run
from cfmkit.studies.parts import near_parts
from cfmkit.studies.parts.near_parts import expected_forces

MODULUS = "mechanism.material.youngs_modulus"


def test_the_range_is_that_of_the_normal_law_where_the_force_is_proportional_to_the_error():
    # without stretch the force is proportional to E: 95 % lie within 1.96 standard deviations of 3 %
    asked = ({"metric": "force_mean", "min": "1 N"},)
    spec = cfmkit.load("configs/beam_rescaled.yaml").replace({"requirements": asked})
    spec = spec.replace({"design.tolerances": {MODULUS: {"normal": "3 %"}, "mechanism.width": {"normal": "0.1 %"}}})
    result = cfmkit.analyze(spec)
    reported = expected_forces(result, Run())
    assert "measure width (10 mm as drawn), determine material.youngs_modulus (2000 MPa in the design)" in reported
    first = r"expect ([\d.]+) N at [^(]* \(([\d.]+) to ([\d.]+) N\)"
    force, low, high = (float(text) for text in re.search(first, reported).groups())
    window = spec.analysis.window or (0.5 * result.curve.motion.max(), 0.0)
    assert force == pytest.approx(np.interp(window[0], result.curve.motion, result.curve.effort), rel=5e-3)
    assert (high - force) / force == pytest.approx(1.96 * 0.03, rel=0.12)
    assert (force - low) / force == pytest.approx(1.96 * 0.03, rel=0.12)


def test_of_a_mechanism_whose_errors_nobody_knows_nothing_is_said():
    spec = cfmkit.load("configs/slider_crank_lumped.yaml")  # flexures: which of their sizes err, nobody says
    assert expected_forces(cfmkit.analyze(spec), Run()) == ""


def test_a_travel_to_the_other_side_is_measured_at_its_end_not_at_rest():
    """Before, the places of a negative travel were its middle and 0, where the force is 0."""
    changes = {"analysis.travel": "-2 mm", "analysis.window": None, "analysis.points": 11, "requirements": ()}
    spec = cfmkit.load("configs/beam_lan2010.yaml").replace(changes)
    spec = spec.replace({"design": {"rescale": {"width": "10 mm"}, "tolerances": {MODULUS: {"normal": "3 %"}}}})
    result = cfmkit.analyze(spec)
    reported = expected_forces(result, Run())
    force = float(re.search(r"displace to -1 mm and -2 mm, and expect .* and (-?[\d.]+) N at -2 mm \(", reported)[1])
    assert force == pytest.approx(result.curve.effort[-1], rel=5e-3)


def measured(name, **changes):
    """Return what the sentence says to measure and to determine."""
    spec = cfmkit.load(f"configs/{name}.yaml").replace(changes)
    return re.search(r"geometry/, (.*), displace to", expected_forces(cfmkit.analyze(spec), Run())).group(1)


def test_a_modulus_is_no_dimension_and_takes_no_place_of_one():
    reported = {
        "mechanism.material.youngs_modulus": {"normal": "5 %"},
        "mechanism.springs.stiffness": {"normal": "2 %"},
    }
    reported |= {f"mechanism.bistable.{name}": {"normal": "1 %"} for name in ("width", "length", "thickness")}
    found = measured("vcfm_bought_springs", **{"design.tolerances": reported})
    assert re.fullmatch(r"measure (\S+ \([^)]*\)(, | and )?){3}, determine .*youngs_modulus.*", found)
    assert "springs" not in found.split("determine")[0]


def test_of_a_strip_its_thickness_is_measured_not_the_error_of_it():
    assert "measure beam.thickness (0.9605 mm as drawn)" in measured("make_pom_strip")
    assert "measure beam.thickness (0.7 mm to 1.1 mm as drawn)" in measured(
        "make_pom_strip", **{"mechanism.beam.thickness": ["1.1 mm", "0.7 mm", "1 mm"]}
    )


def test_ranges_by_the_engines_derivatives_are_those_by_neighbouring_parts(monkeypatch):
    spec = cfmkit.load("configs/beam_design_arch.yaml")
    result, numbers = cfmkit.analyze(spec), []
    exact = near_parts.rr.exact_derivatives
    for slopes in (exact, lambda *_: {}):
        monkeypatch.setattr(near_parts.rr, "exact_derivatives", slopes)
        numbers.append([float(text) for text in re.findall(r"([\d.]+) (?:N|to)\b", expected_forces(result, Run()))])
    assert exact(result.spec, np.array([0.006, 0.012]), ("mechanism.beams.s.thickness", "mechanism.thickness"))
    assert len(numbers[0]) == 6
    np.testing.assert_allclose(*numbers, rtol=5e-3)


def test_many_errors_need_no_part_more_where_the_engine_has_the_derivatives():
    spec = cfmkit.load("configs/studies/beam_lan2010_yield.yaml")
    assert 2 * len(spec.design.tolerances) > 24  # more parts than are solved for a sentence
    reported = expected_forces(cfmkit.analyze(spec), Run())
    assert re.search(r"measure (beams|nodes)\..* [\d.]+ N at [\d.]+ mm \([\d.]+ to [\d.]+ N\)", reported)
