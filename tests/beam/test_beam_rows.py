"""Beams whose paths are looked at together have the numbers of runs of their own."""

from __future__ import annotations

import numpy as np
import pytest
from beam_support import config

import cfmkit
from cfmkit.families.beam.model import solve, solve_rows
from cfmkit.specs.units import to_border


def test_variants_whose_paths_have_events_are_no_rows():
    assert list(solve_rows([config("beam_v_bifurcation", "analysis.points=25")])) == []


def test_largest_stresses_of_many_paths_are_those_of_each():
    """Of other thicknesses and windows, with and without the axial part."""
    for stress in ("bending", "total"):
        lan = config("beam_lan2010", "analysis.points=25", f"analysis.stress={stress}")
        specs = [lan.replace({"mechanism.thickness": size}) for size in (0.9e-3, 1.1e-3)]
        laws = [solve(spec).model_between_points for spec in specs]
        low, high = np.array([0.0031, 0.0]), np.array([0.0117, 0.018])
        ((_, rows),) = solve_rows(specs)
        found = rows.solution.branches["load"].stress.largest(low, high)
        own = [law.largest_stress("", *ends) for law, *ends in zip(laws, low, high, strict=True)]
        assert found == pytest.approx(own, rel=1e-12)


@pytest.mark.parametrize("switches", [(False, True, True), (True, False, False)])
def test_wide_and_narrow_beams_of_one_network_are_looked_at_by_themselves(switches):
    """Their elements have other arrays: the largest stresses of a sweep are those of each run."""
    spec = config("studies/beam_rounding", "analysis.points=25").replace({"sweep": None, "sensitivity": None})
    vary = {"mechanism.wide_beams": list(switches), "mechanism.thickness": ["0.9 mm", "1 mm", "1.1 mm"]}
    swept = cfmkit.sweep(spec, vary=vary, combine="zip", metrics=["stress_max", "force_mean"]).table
    variants = [dict(zip(vary, values, strict=True)) for values in zip(*vary.values(), strict=True)]
    runs = [cfmkit.analyze(spec.replace(changes)) for changes in variants]
    for name, dimension in (("stress_max", "stress"), ("force_mean", "force")):
        own = [to_border(run.metrics[name].value, dimension) for run in runs]
        assert list(swept[name]) == pytest.approx(own, rel=1e-12)
