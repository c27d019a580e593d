"""A travel to the negative side: the same motion as in the opposite direction has the same values, mirrored."""

from __future__ import annotations

import pytest
from beam_support import MM, config, solved, value

import cfmkit
from cfmkit.results import Status

TURNED = (
    "nominal_force", "range_start", "strict_range_start", "stress_limit_displacement",
    "peak_force", "peak_displacement", "valley_force", "valley_displacement",
)  # fmt: skip
ALIKE = ("range_fraction", "strict_range_fraction", "stress_at_end", "stress_max", "force_ripple")
BACK = ("mechanism.drive.direction=90 deg", "analysis.travel=-18 mm")
MODELS = ("inextensible", "reissner")


@pytest.mark.parametrize("window", ["7 mm, 13.6 mm", "0 mm, 18 mm"])
@pytest.mark.parametrize("model", MODELS)
def test_a_travel_to_the_negative_side_has_the_mirrored_values(model, window):
    """Before, half of them had no value."""
    points, fidelity = "analysis.points=37", f"analysis.fidelity={model}"
    low, high = window.split(", ")
    there = solved("beam_lan2010", points, fidelity, f"analysis.window=[{low}, {high}]")
    turned = f"analysis.window=[-{high}, -{low}]"
    back = cfmkit.analyze(config("beam_lan2010", points, fidelity, turned, *BACK, "requirements=[]"))
    for name in TURNED:
        assert value(there, name) is not None
        assert value(back, name) == pytest.approx(-value(there, name), rel=1e-6, abs=1e-9), name
    for name in ALIKE:
        assert value(back, name) == pytest.approx(value(there, name), rel=1e-6), name


@pytest.mark.parametrize("wanted", ["{force: 20 N}", "{force: 20 N, to_allowable_stress: true}"])
def test_a_mechanism_that_travels_to_the_negative_side_is_rescaled(wanted):
    """Before, it had "no force at the end of its window"."""
    changes = ("analysis.points=37", f"design.rescale={wanted}", "requirements=[]")
    there = cfmkit.design(config("beam_lan2010", *changes))
    turned = "analysis.window=[-13.6 mm, -7 mm]"
    back = cfmkit.design(config("beam_lan2010", *changes, *BACK, turned))
    assert there.status is back.status is Status.COMPLETE
    assert back.spec.mechanism.width == pytest.approx(there.spec.mechanism.width, rel=1e-6)
    assert back.spec.analysis.travel == pytest.approx(-there.spec.analysis.travel, abs=1e-4 * MM)
    assert back.spec.analysis.window == pytest.approx([-end for end in there.spec.analysis.window[::-1]], abs=1e-4 * MM)
    result = cfmkit.analyze(back.spec)
    assert result.target == pytest.approx(-20.0)
    assert value(result, "nominal_force") == pytest.approx(-20.0, rel=1e-4)
