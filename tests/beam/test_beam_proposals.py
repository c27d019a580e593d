"""Shapes of networks that are kept for `suggest`."""

from __future__ import annotations

import pytest
from suggest_support import offered

import cfmkit
from cfmkit import api
from cfmkit.families.beam.proposals import _write_shape, load_kept_shapes


def test_kept_shapes_scale_as_beams_that_only_bend():
    """Twice as large with twice the thickness: twice the force at twice the travel, the stress as before."""
    shape = load_kept_shapes()[0]
    own = shape.spec.mechanism
    block = {"youngs_modulus": 2e9, "poisson_ratio": 0.35, "yield_strength": 76e6}
    end = float(shape.motion[-1])
    spec = _write_shape(shape, 2.0, block, (2.0 * own.thickness, own.width), (end, 2.0 * end))
    curve = cfmkit.analyze(spec.replace({"analysis.fidelity": "inextensible"})).curve
    assert curve.effort[-1] == pytest.approx(2.0 * shape.force[-1], rel=1e-5)
    assert curve.extra["max_stress"].values[-1] == pytest.approx(shape.stress[-1], rel=1e-4)


@pytest.mark.parametrize("force", ["3 N", "10 N"])
def test_offered_shapes_of_one_layer_have_the_force_required_before_they_are_corrected(force):
    """But for stretching and shear, which rescaling leaves out."""
    asked, candidates = offered("beam", force=force)
    plain = [candidate for candidate in candidates if candidate.spec.mechanism.layers == 1]
    for candidate in plain[:4]:
        metrics = api.evaluate(cfmkit.analyze(candidate.spec), ["force_mean"])
        assert metrics["force_mean"].value == pytest.approx(asked.target, rel=0.02), candidate.variant


def test_no_stored_shape_touches_itself():
    for kept in load_kept_shapes():
        result = cfmkit.analyze(kept.spec.replace({"analysis.fidelity": "reissner", "analysis.points": 11}))
        assert "beams_touch" not in {one.name for one in result.warnings}, kept.name
