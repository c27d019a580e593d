"""The bifurcation diagram of docs/beam.md, from the shipped specification."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
from beam_support import solved

SCRIPT = Path(__file__).parents[2] / "docs" / "draw_bifurcation.py"
FEW = ("analysis.points=41", "analysis.modes=0")


def test_both_branches_leave_the_symmetric_path_and_come_back_as_mirror_images():
    one, other = (solved("beam_v_bifurcation", *FEW, f"analysis.other_side={side}") for side in ("false", "true"))
    primary = solved("beam_v_bifurcation", *FEW, "analysis.branch=primary")
    turn = one.curve.extra["eye_rotation"].values
    np.testing.assert_allclose(turn, -other.curve.extra["eye_rotation"].values, atol=1e-6)
    np.testing.assert_allclose(one.curve.force, other.curve.force, atol=1e-5)
    off = np.abs(turn) > 1e-6
    assert off.any()
    assert (~primary.curve.stable == off).all()
    assert one.curve.stable.all()


def test_the_diagram_draws_stable_and_unstable_equilibria_apart():
    spec = importlib.util.spec_from_file_location("draw_bifurcation", SCRIPT)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    figure = script.diagram("analysis.points=41")
    for ax in figure.axes:
        looks = [line.get_linestyle() for line in ax.lines]
        assert looks.count("-") >= 4  # before, behind, and two branches
        assert looks.count("--") == 1
    dots = figure.axes[0].lines[-1].get_xdata()
    assert abs(dots[0] - 0.4174) < 1e-3
    assert len(dots) == 4
