"""Beams whose paths are looked at together have the numbers of runs of their own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cfmkit
from cfmkit.families.beam.model import solve, solve_rows

CONFIGS = Path(__file__).parents[2] / "configs"
LAN = "beam_lan2010"


def config(stem, **changes):
    return cfmkit.load(CONFIGS / f"{stem}.yaml").replace({"analysis.points": 25, **changes})


def test_variants_whose_paths_have_events_are_no_rows():
    spec = config("beam_v_bifurcation")
    assert list(solve_rows([spec])) == []


def test_largest_stresses_of_many_paths_are_those_of_each():
    """Of other thicknesses and windows, with and without the axial part."""
    for stress in ("bending", "total"):
        specs = [config(LAN, **{"mechanism.thickness": size, "analysis.stress": stress}) for size in (0.9e-3, 1.1e-3)]
        laws = [solve(spec).model_between_points for spec in specs]
        low, high = np.array([0.0031, 0.0]), np.array([0.0117, 0.018])
        ((_, rows),) = solve_rows(specs)
        found = rows.solution.branches["load"].stress.largest(low, high)
        own = [law.largest_stress("", *ends) for law, *ends in zip(laws, low, high, strict=True)]
        assert found == pytest.approx(own, rel=1e-12)
