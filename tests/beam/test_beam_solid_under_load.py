"""Parts as solids under a force or a moment, along a surface, and driven in the middle of a beam."""

from __future__ import annotations

import numpy as np
import pytest
from vee_leaf import VEE

import cfmkit
from cfmkit.families.beam.network_from_spec import assemble
from cfmkit.families.beam.solid_part import driven_part
from cfmkit.results import Status

STRIP = """
cfmkit: 1
family: beam
name: strip
mechanism:
  material: {youngs_modulus: 2.4 GPa, poisson_ratio: 0.3}
  thickness: 1 mm
  width: 1 mm
  nodes:
    root: {at: [0 mm, 0 mm], support: clamped}
    tip: {at: [12 mm, 0 mm]}
  beams:
    beam: {start: root, end: tip}
  drive: {kind: displacement, node: tip, direction: -90 deg}
analysis: {travel: 7 mm, points: 21, fidelity: solid, solid: {poses: 11, error: 0.1}}
"""


def spec_of(text=STRIP, **changes):
    """Return a spec with some keys changed; two underscores in a name stand for a dot."""
    return cfmkit.loads(text).replace({name.replace("__", "."): value for name, value in changes.items()})


FORCE = {"mechanism__drive": {"kind": "force", "node": "tip", "direction": "-90 deg"}, "analysis__travel": None}
TWIST = {"mechanism__drive": {"kind": "moment", "node": "tip"}, "analysis__travel": None}


def test_a_solid_under_a_force_has_rows_at_even_loads_on_the_curve_of_its_travel():
    moved = cfmkit.analyze(spec_of()).curve
    loaded = cfmkit.analyze(spec_of(**FORCE, analysis__force="-3 N"))
    assert loaded.status is Status.COMPLETE
    assert loaded.curve.effort == pytest.approx(np.linspace(0.0, -3.0, 21), abs=1e-6)
    assert -loaded.curve.effort == pytest.approx(np.interp(-loaded.curve.motion, moved.motion, moved.effort), abs=5e-3)
    assert loaded.values["travel_end"].value == loaded.curve.motion[-1]
    assert loaded.curve.stable.all()


def test_the_ends_of_a_window_on_a_load_are_poses():
    spec = spec_of(**FORCE, analysis__force="3 N", analysis__window=("10 %", "66 %"))
    result = cfmkit.analyze(spec)
    travel = result.state.fine.course.travel
    assert [np.abs(travel - share * travel[-1]).min() for share in (0.1, 0.66)] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert result.state.worst[0] == pytest.approx(cfmkit.evaluate(result)["stress_max"].value, rel=1e-3)


def test_a_solid_under_a_moment_turns_as_the_beam_does():
    spec = spec_of(**TWIST, analysis__moment="20 N*mm")
    curve = cfmkit.analyze(spec).curve
    angle = 20e-3 * 12e-3 / (2.4e9 * 1e-12 / 12)  # M L/EI
    assert (curve.kind, curve.effort[-1]) == ("torque", pytest.approx(20e-3))
    assert curve.motion[-1] == pytest.approx(angle, rel=0.01)


@pytest.mark.slow
def test_a_load_that_a_leaf_cannot_carry_ends_at_its_largest_force():
    spec = spec_of(VEE, analysis__solid__error=0.1, analysis__solid__poses=21)
    moved = cfmkit.analyze(spec).state.densely
    peak = float(moved.effort.max())

    drive = {"kind": "force", "node": "shuttle", "direction": "-90 deg"}
    loaded = spec.replace({"mechanism.drive": drive, "analysis.travel": None, "analysis.force": 1.5 * peak})
    snapped = cfmkit.analyze(loaded)
    assert snapped.status is Status.PARTIAL
    assert "the load cannot grow further" in snapped.message
    assert snapped.values["limit_force"].value == pytest.approx(peak, rel=2e-3)
    assert snapped.curve.effort.max() <= peak * 1.002
    beyond = cfmkit.analyze(loaded.replace({"analysis.through_folds": True, "analysis.force": 1.01 * peak}))
    assert beyond.values["limit_force"].value == pytest.approx(peak, rel=2e-3)
    assert not beyond.curve.stable.all()


def test_a_surface_is_followed_by_a_solid_with_the_force_of_its_curve():
    profile = {"kind": "formula", "height": "1 + cos(x)", "length": "6 mm"}
    spec = spec_of(analysis__surface={"profile": profile, "preload": "2 mm"})
    result = cfmkit.analyze(spec)
    assert result.status is Status.COMPLETE
    ends = np.interp([2e-3, 4e-3], result.curve.motion, result.curve.effort)
    assert [result.values[f"tip_force_{name}"].value for name in ("min", "max")] == pytest.approx(ends, rel=2e-3)
    assert result.values["surface_stress_max"].value == pytest.approx(
        np.interp(4e-3, result.curve.motion, result.curve.extra["max_stress"].values), rel=1e-2
    )


def test_a_node_in_the_middle_of_a_straight_beam_is_moved_over_its_whole_section():
    nodes = {
        "root": {"at": ["0 mm", "0 mm"], "support": "clamped"},
        "tip": {"at": ["10 mm", "0 mm"]},
        "end": {"at": ["24 mm", "0 mm"], "support": "clamped"},
    }
    beams = {"left": {"start": "root", "end": "tip"}, "right": {"start": "tip", "end": "end"}}
    spec = spec_of(mechanism__nodes=nodes, mechanism__beams=beams)
    part = driven_part(spec, assemble(spec))
    problem = part.part.create_mesh().problem
    (group,) = (one for one in problem.supports.groups if one.name == "tip")
    heights = problem.elements.mesh.nodes[group.nodes, 1]
    assert [heights.min(), heights.max()] == pytest.approx([-0.5e-3, 0.5e-3], abs=2e-6)


@pytest.mark.slow
def test_a_strip_of_400_thicknesses_has_poses():
    nodes = {"root": {"at": ["0 mm", "0 mm"], "support": "clamped"}, "tip": {"at": ["400 mm", "0 mm"]}}
    spec = spec_of(mechanism__nodes=nodes, analysis__travel="12 mm")
    part = driven_part(spec, assemble(spec))
    problem = part.part.create_mesh().problem
    rest = problem.solve(np.zeros(problem.supports.size), 0.0)
    assert rest is not None
    bent = problem.solve(rest.slope * 3e-3, 3e-3)
    assert bent is not None
    assert bent.effort == pytest.approx(3 * 2.4e9 * 1e-12 / 12 / 0.4**3 * 3e-3, rel=0.01)
