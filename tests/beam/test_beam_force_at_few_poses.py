"""Forces of networks at a few poses, with exact derivatives: those of whole analyses and of neighbours."""

from __future__ import annotations

import numpy as np
import pytest

import cfmkit
from cfmkit.families.beam.force_at_few_poses import sample_poses

LAN = "configs/studies/beam_lan2010_yield.yaml"


@pytest.mark.parametrize("changes", [{}, {"mechanism.wide_beams": True, "analysis.fidelity": "reissner"}])
def test_the_engines_derivatives_are_those_of_neighbouring_parts(changes):
    spec = cfmkit.load(LAN).replace(changes)
    places, paths = np.array([0.004, 0.0136]), ["mechanism.nodes.n3.at.0", "mechanism.beams.b3.thickness"]
    paths += ["mechanism.beams.b2.shape.coefficients.1", "mechanism.material.youngs_modulus", "mechanism.width"]
    seen = sample_poses(spec, places, [*paths, "mechanism.safety_factor"])
    assert set(seen.slopes) == set(paths)  # what no exact derivative is known by is left out
    for path in paths:
        value = spec.get_value(path)
        ends = [sample_poses(spec.replace({path: value * (1 + sign * 1e-5)}), places) for sign in (1, -1)]
        force, stress = ((a - b) / (2e-5 * value) for a, b in (
            [one.effort["load"] for one in ends], [one.stress for one in ends]))  # fmt: skip
        assert seen.slopes[path].effort["load"] == pytest.approx(force, rel=1e-5, abs=1e-6 * abs(force).max()), path
        assert seen.slopes[path].stress == pytest.approx(stress, rel=1e-4, abs=1e-6 * seen.stress.max() / abs(value)), (
            path
        )


def test_loads_that_grow_with_the_drive_are_seen_quickly_too():
    spec = cfmkit.load("configs/beam_design_arch.yaml")
    node = spec.mechanism.drive.node
    load = {"kind": "point", "node": node, "fx": 0.0, "fy": -0.2, "moment": 1e-3, "follows": False}
    changes = {"mechanism.loads": (load,), "analysis.loads_first": False, "design": None, "requirements": ()}
    grown = spec.replace(changes)
    curve = cfmkit.analyze(grown).curve
    places = curve.motion[[10, 20, -1]]
    assert sample_poses(grown, places).effort["load"] == pytest.approx(curve.effort[[10, 20, -1]], rel=1e-4)
    assert abs(curve.effort[-1] / cfmkit.analyze(spec).curve.effort[-1] - 1) > 0.01  # the load is felt
