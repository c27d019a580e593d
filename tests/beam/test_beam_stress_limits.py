"""What stress is allowed, and where a network of beams is said to exceed it."""

from __future__ import annotations

import pytest
from beam_support import TOGGLE, cantilever, config, value, warned

import cfmkit
from cfmkit import Run
from cfmkit.families.beam.design import design
from cfmkit.specs.units import format_short

TWO = (
    "tip: {at: [400 mm, 0 mm]}\n  beams:\n    beam: {start: root, end: tip}",
    "mid: {at: [200 mm, 0 mm]}\n    tip: {at: [400 mm, 0 mm]}\n"
    "  beams:\n    beam: {start: root, end: mid, material: {youngs_modulus: 2 GPa}}\n    far: {start: mid, end: tip}",
)


def test_a_strength_that_is_not_known_is_not_that_of_another_material():
    """Before, the stress of the beam without a strength was compared with the strength of the other."""
    result = cfmkit.analyze(cantilever(TWO, ("travel: 100 mm", "travel: 20 mm")))
    assert value(result, "stress_max") > 0
    assert value(result, "allowable_stress") is None
    assert value(result, "safety_factor") is None


def test_the_search_of_shapes_keeps_to_the_strengths_that_are_known():
    from cfmkit.families.beam.shaping.design import task_of

    spec = config("beam_design_lan")
    own = spec.replace({"mechanism.beams.b1.material": {"youngs_modulus": "2 GPa"}})
    one, other = (task_of(each, each.design.optimise).limits.stress for each in (spec, own))
    assert one is not None
    assert other == pytest.approx(one)


def overstressed(result):
    return [found.message for found in result.warnings if found.name == "overstressed"]


@pytest.mark.parametrize(
    "changes",
    [
        ("analysis.points=6", "analysis.window=[12 mm, 15 mm]", "mechanism.material.yield_strength=74 MPa"),
        ("analysis.points=5", "analysis.window=[0.5 mm, 2 mm]", "mechanism.material.yield_strength=20 MPa"),
    ],
    ids=["between two points", "a window without points"],
)
def test_a_stress_between_the_points_is_reported_as_the_metric_has_it(changes):
    """Before, 50.37 MPa were reported of 51.96 MPa, and nothing in a window without points."""
    result = cfmkit.analyze(config("beam_lan2010", *changes))
    assert value(result, "safety_factor") < 1
    (reported,) = overstressed(result)
    stress = format_short(value(result, "stress_max"), "stress")
    assert f"the largest stress in the window is {stress}, at " in reported


def test_too_much_stress_is_reported_of_the_beams_whose_strength_is_known():
    travel = ("travel: 100 mm", "travel: 395 mm")
    (reported,) = overstressed(cfmkit.analyze(cantilever(TWO, travel, ("50 MPa", "1 MPa"))))
    assert "of beam far" in reported


def test_a_rescaled_part_that_is_overstressed_before_the_end_of_its_window_is_reported():
    """A toggle: its stress is largest half way. Before, only the stress at the end was looked at."""
    text = TOGGLE + "design: {rescale: {width: 12 mm}}\nanalysis: {travel: 8.5 mm, points: 21}\n"
    reported = warned(design(cfmkit.loads(text), Run()))
    assert "the stress at the end of the window is 23.81 MPa" in reported["rescale_stress"]
    assert "28 MPa, is reached at 2.58" in reported["rescale_stress"]
    calm = design(cfmkit.loads(text.replace("28 MPa", "35 MPa")), Run())
    assert "rescale_stress" not in {one.name for one in calm.warnings}
