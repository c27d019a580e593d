"""The largest stress in a window, found at few points, is that of all beams at all places."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import config

from cfmkit import Run
from cfmkit.families import family
from cfmkit.families.beam.model import solve
from cfmkit.metrics import evaluate
from cfmkit.studies import Study, metrics_of

LAN = "beam_lan2010"
SAMPLES = 400


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        (LAN, ["analysis.points=13"]),
        (LAN, ["analysis.points=181", "analysis.stress=total"]),
        ("beam_design_arch", []),
        ("beam_design_arch", ["analysis.points=9"]),
        ("beam_end_effector", []),
        ("beam_cantilever", []),
    ],
)
def test_nothing_in_a_window_is_stressed_more(name: str, changes: list[str]) -> None:
    law = solve(config(name, *changes)).model_between_points
    assert law is not None
    assert not len(law.corners)
    for first, last in [(0.0, 1.0), (0.013, 0.31), (0.4, 0.77), (0.512, 0.513), (0.8, 1.0)]:
        low, high = (float(law.places[0] + share * np.ptp(law.places)) for share in (first, last))
        there = law.solve_at(np.linspace(low, high, SAMPLES))
        sampled = there.beam_stresses(law.axial)[0].max(axis=0)
        found = law.largest_stress("", low, high)
        assert found >= sampled.max() * (1 - 1e-12)
        # between two of so many places it rises by less than from one to the next
        assert found <= sampled.max() + np.abs(np.diff(sampled)).max()


@pytest.mark.parametrize("name", [LAN, "beam_v_bifurcation", "beam_lee_frame", "beam_cantilever"])
def test_metrics_of_a_part_are_those_of_its_analysis(name: str) -> None:
    spec = config(name)
    whole = family("beam").analyze(spec, Run())
    metrics = metrics_of(spec, ["stress_max", "safety_factor", "half_band", "force_mean"], whole.curve)
    study = Study(spec, (), metrics, findings=False)
    result = study.solve(spec)
    known = evaluate(whole, study.names)
    for metric, found in zip(study.names, study.quantities(result), strict=True):
        assert (found.value is None) == (known[metric].value is None)
        assert found.value is None or found.value == pytest.approx(known[metric].value, rel=1e-9)
