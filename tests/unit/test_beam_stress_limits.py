"""What stress is allowed, and where a network of beams is said to exceed it."""

from __future__ import annotations

import pytest
from beam_support import cantilever, config, value

import cfmkit

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
