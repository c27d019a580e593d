"""Designs of strips: what is proposed where a target is out of reach, and what the written strip is held to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flexure_support import ABS, MM, WIDTH, corners

import cfmkit
from cfmkit.families.slider_crank.printed.sqp_program import Form, StripProgram, StripTask
from cfmkit.families.slider_crank.printed.strip_thickness_search import FoundStrip, Ranges, infeasible
from cfmkit.numerics.sqp import Optimum, SearchEnding
from cfmkit.results import Status

CONFIGS = Path(__file__).parents[2] / "configs"
TASK = StripTask(corners(), np.pi, ABS, 1.5, MM, 20 * MM, 0.01)


def spec(name: str, *changes: str) -> Any:
    return cfmkit.load(CONFIGS / f"slider_crank_{name}.yaml", ("analysis.recheck=false", *changes))


def found(task: StripTask, z: list[float]) -> FoundStrip:
    """Return a strip of two thicknesses as where a search ended."""
    form = Form(2, width=WIDTH)
    end = Optimum(np.array(z), 0.0, np.zeros(0), SearchEnding.OPTIMUM, 1, 0.0)
    return FoundStrip(task, form, Ranges(np.tile([0.5, 2.0], (2, 1)), 40 * MM), StripProgram(task, form), end, None)


# --- what is proposed ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("width", "sets", "most"),
    [
        ("[5 mm, 8 mm]", "mechanism.legs=2", "4.64 N"),
        ("[5 mm, 8 mm]", "mechanism.copies=mirrored", "4.64 N"),
        ("[5 mm, 7.77 mm]", "mechanism.legs=1", "2.253 N"),  # 2.254 N would need 7.772 mm
    ],
)
def test_the_force_proposed_is_that_of_all_strips_and_can_be_had(width: str, sets: str, most: str) -> None:
    about = f"design.beam.width={width}", sets
    refused = cfmkit.design(spec("strip", *about, "design.force=20 N"))
    assert refused.status is Status.INFEASIBLE
    assert refused.nearest_feasible["design.force"] == most
    assert "20 N need a width" in refused.message
    assert cfmkit.design(spec("strip", *about, f"design.force={most}")).status is Status.COMPLETE


def test_the_force_proposed_after_a_search_is_that_of_all_strips() -> None:
    one, two = (infeasible(found(replace(TASK, force=10.0, sets=n), [0.977, 0.977, 2.0])) for n in (1, 2))
    forces = [float(each.nearest_feasible["design.force"].removesuffix(" N")) for each in (one, two)]
    assert forces[1] == pytest.approx(2.0 * forces[0], rel=1e-3)


# --- what the written strip is held to ----------------------------------------------------------------------------


def test_the_stress_of_a_uniform_strip_is_the_largest_of_its_travel() -> None:
    """Pressed this far it is largest before the end: 43.3 MPa where 42.5 were allowed."""
    free = "beam: {shape: uniform, goal: ripple, width: [1 mm, 500 mm], thickness: [0.1 mm, 4 mm]}"
    design = cfmkit.design(spec("strip", f"design={{force: 1.5 N, travel: [1 mm, 125 mm], {free}}}", "requirements=[]"))
    assert design.status is Status.COMPLETE
    assert cfmkit.evaluate(design.spec, ("stress_max",))["stress_max"].value == pytest.approx(42.49e6, rel=1e-3)
