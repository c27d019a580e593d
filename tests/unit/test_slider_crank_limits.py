"""Slider-cranks at the ends of what they can do: equal links, folded starts, many turns, windows elsewhere."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from slider_crank import DEG, config

import cfmkit

EQUAL = {
    "mechanism": {
        "crank_length": "100 mm", "coupler_length": "100 mm", "unloaded_offset": 0.0,
        "springs": {"pivot": "10 N*mm/rad"},
    },
    "analysis": {"drive": "force", "side": "beyond"},
}  # fmt: skip


def test_equal_links_in_line_with_the_pivot_fold_there():
    """Both links turn by t with x = 2 r cos t, so the force is K t/(2 r sin t); the slider's way ends at the pivot."""
    result = cfmkit.analyze(config("li2019", **EQUAL))
    turned = np.arccos(1 - result.curve.displacement[1:] / 0.2)
    assert result.curve.force[0] == pytest.approx(0.01 / 0.2)
    assert result.curve.force[1:] == pytest.approx(0.01 * turned / (0.2 * np.sin(turned)), rel=1e-9)
    assert 0.199 < result.curve.displacement[-1] < 0.2
    assert result.values["stiffness_class"].word == "positive"
    beyond = cfmkit.analyze(config("li2019", **EQUAL, analysis__travel=("0 mm", "250 mm")))
    assert beyond.status.key == "partial"
    assert "out_of_reach" in {item.name for item in beyond.warnings}


def test_springs_relaxed_folded_can_only_be_pulled():
    folded = math.pi + math.asin(30 / 400)
    about = {"analysis": {"drive": "force"}, "mechanism__unloaded_angle": folded}
    result = cfmkit.analyze(config("li2019", **about))
    assert result.curve.displacement[-1] == 0.0
    assert result.curve.displacement[0] == pytest.approx(-200e-3, rel=0.01)
    assert (result.curve.force[:-1] < 0).all()


def test_positions_are_the_same_after_each_turn():
    turns = config("li2019_full_turn", analysis__angle=(-5 * DEG, -5 * DEG + 6 * math.pi))
    result = cfmkit.analyze(turns)
    told = {item.name: item.message for item in result.warnings}["same_position_twice"]
    assert result.values["stable_positions"].value == 7
    assert "has 2 different stable positions" in told


def test_a_window_outside_the_motion_is_no_trouble():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = cfmkit.analyze(config("li2019", analysis__window=("60 deg", "70 deg")))
    assert "stretched_outside_window" in {item.name for item in result.warnings}


@pytest.mark.parametrize(("start", "side"), [(-30.0, "beyond"), (0.542 / DEG, "before")])
def test_on_the_other_side_the_springs_are_nowhere_relaxed(start, side):
    base = "li2019" if start < 0 else "bilancia2019"
    changes = {"mechanism__unloaded_angle": f"{start} deg", "analysis__travel": ("0 mm", "20 mm")}
    spec = config(base, **changes, analysis__drive="force", analysis__side=side, analysis__window=None)
    result = cfmkit.analyze(spec)
    assert abs(result.curve.force).min() > 0.05
    assert result.values["stable_positions"].value == 0
    assert "run_in" not in {item.name for item in result.warnings}
    if base == "bilancia2019":
        assert "force_unbounded" in {item.name for item in result.warnings}
