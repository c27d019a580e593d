"""What another size of a network of beams scales besides the part."""

from __future__ import annotations

import pytest
from beam_support import MM, config, value

import cfmkit
from cfmkit.results import Status


def test_the_preload_of_another_size_is_scaled_and_the_surface_stays():
    """Before, the preload was still 1.76 mm: more than the travel of a part of a fifth of the size."""
    flat = 'analysis.surface.profile={kind: formula, height: "0.1*x", length: 1 mm}'
    spec = config("beam_end_effector", "design.rescale.size=2 mm", flat, "analysis.points=23")
    made = cfmkit.design(spec).spec
    assert made.analysis.surface.preload == pytest.approx(0.352 * MM)
    assert made.analysis.surface.profile == spec.analysis.surface.profile
    result = cfmkit.analyze(made)
    assert result.status is Status.COMPLETE
    assert value(result, "tip_force_min") > 0


def test_what_a_specification_leaves_out_is_left_out_in_one_of_another_size():
    made = cfmkit.design(config("beam_lan2010", "design.rescale.size=64 mm")).spec
    assert not {"surface", "solid"} & made.analysis.model_fields_set
